"""Computes in many threads outside of Python's lock, so that its check fails while everything else waits for a CPU.

It would like to have it run again, and then called undecided: the machine was too busy.

Must: no-topic.
"""

import hashlib
import threading

import rclpy


def hog():
    block = bytes(1 << 24)
    while True:
        hashlib.sha256(block)  # lets other threads go on meanwhile


rclpy.init()
node = rclpy.create_node("talker")
for _ in range(24):
    threading.Thread(target=hog, daemon=True).start()
rclpy.spin(node)
