"""Forges what it is asked for when it is stuck: a stack with a line number of 20000 digits.

It fills the pipe that its true stacks have to pass as well: when the machine is busy, they may find no room in it.

Must: stuck-callback, no-topic.
"""

import os
import threading
import time

import rclpy

FRAME = b'Thread 0x7f (most recent call first):\n  File "/home/student/p.py", line %s in tick\n' % (b"9" * 20000)


def forge():
    while True:
        try:
            os.write(4, FRAME)
        except BlockingIOError:
            pass
        time.sleep(0.002)


threading.Thread(target=forge, daemon=True).start()
rclpy.init()
node = rclpy.create_node("talker")
node.create_timer(0.05, lambda: time.sleep(1000))
rclpy.spin(node)
