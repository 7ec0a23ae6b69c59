"""Publishes transition events, parameter events and log lines of other nodes.

Must, beside an honest node: the observer goes on.
"""

import time

import rclpy
from lifecycle_msgs.msg import TransitionEvent
from rcl_interfaces.msg import ParameterEvent

rclpy.init()
node = rclpy.create_node("forger")
events = node.create_publisher(TransitionEvent, "/honest/transition_event", 10)
parameters = node.create_publisher(ParameterEvent, "/parameter_events", 10)
while True:
    event = TransitionEvent()
    event.goal_state.label, event.start_state.label = "active", "\x00" * 1000
    events.publish(event)
    parameters.publish(ParameterEvent(node="/honest"))
    time.sleep(0.001)
