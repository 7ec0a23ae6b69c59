%%node health
import time

import rclpy
from std_msgs.msg import Int32, String

rclpy.init()
node = rclpy.create_node("health")
node.declare_parameter("topics", ["scan"])
node.declare_parameter("silence", 1.0)
heard = dict.fromkeys(node.get_parameter("topics").value, float("-inf"))


def watch(topic):
    def remember(_):
        heard[topic] = time.monotonic()

    node.create_subscription(Int32, topic, remember, 10)


def tell():
    limit = node.get_parameter("silence").value
    words = [topic for topic in heard if time.monotonic() - heard[topic] > limit]
    out.publish(String(data=" ".join(words or ["ok"])))


for name in heard:
    watch(name)
out = node.create_publisher(String, "health", 10)
node.create_timer(0.2, tell)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    pass
