"""Changes Python, rclpy and the probe in its own memory; the next program must not notice.

Must: refused.
"""

import builtins
import os
import sys

import rclpy
import rclpy.node

rclpy.init = rclpy.spin = lambda *_, **__: None
rclpy.node.Node.__init__ = None
for name in list(sys.modules):
    if name.startswith(("json", "socket", "_autograder")):
        sys.modules[name] = None
builtins.open = builtins.__import__ = None
os.fork = os.write = lambda *_: 0
builtins.print("done")
