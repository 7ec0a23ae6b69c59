"""Forges notes of the probe with halves of surrogate pairs, which no result could be written with.

Must: message-field.
"""

import os

import rclpy

NOTE = (
    b'{"e": "bad_message", "kind": "m", "name": "/talk", "field": "\\ud800", "expected": "x", "given": "", "value": ""}'
)
os.write(3, NOTE + b"\n")
rclpy.init()
rclpy.spin(rclpy.create_node("talker"))
