%%node follower
import time
from functools import partial

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Header


def follow(out, work, frame):
    began = time.time() - frame.stamp.sec - frame.stamp.nanosec * 1e-9
    time.sleep(work)
    out.publish(Float64(data=began))


def main():
    with_newest = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    rclpy.init()
    node = rclpy.create_node("follower")
    work = node.declare_parameter("work", 0.05).value
    out = node.create_publisher(Float64, "age", 1)
    node.create_subscription(Header, "frames", partial(follow, out, work), with_newest)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
