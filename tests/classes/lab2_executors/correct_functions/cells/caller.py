import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Empty, Int64, String
from std_srvs.srv import Trigger


def main():
    """As the lab says it: `await`, with the callback in a group of its own, and rclpy.spin."""
    rclpy.init()
    node = rclpy.create_node("caller")
    node.declare_parameter("tick_period", 0.1)
    ticks = node.create_publisher(Int64, "ticks", 10)
    reply = node.create_publisher(String, "reply", 10)
    gate = node.create_client(Trigger, "gate")
    seen = [0]

    def tick():
        seen[0] += 1
        ticks.publish(Int64(data=seen[0]))

    async def on_request(_):
        response = await gate.call_async(Trigger.Request())
        reply.publish(String(data=response.message))

    node.create_timer(node.get_parameter("tick_period").value, tick)
    node.create_subscription(Empty, "request", on_request, 10, callback_group=MutuallyExclusiveCallbackGroup())
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
