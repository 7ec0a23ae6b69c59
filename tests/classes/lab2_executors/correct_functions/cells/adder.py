import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from std_msgs.msg import Int64
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = rclpy.create_node("adder")
    work = node.declare_parameter("work", 0.05)
    total = 0
    publisher = node.create_publisher(Int64, "total", 10)

    def add(message):
        nonlocal total
        then = total + message.data
        time.sleep(work.value)
        total = then
        publisher.publish(Int64(data=total))

    node.create_subscription(Int64, "add", add, 50)
    node.create_service(
        Trigger,
        "get_total",
        lambda request, response: Trigger.Response(success=True, message=f"{total}"),
        callback_group=MutuallyExclusiveCallbackGroup(),
    )
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
