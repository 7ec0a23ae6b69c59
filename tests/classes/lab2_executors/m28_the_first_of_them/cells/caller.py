%%node caller
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Empty, Int64, String
from std_srvs.srv import Trigger


class Caller(Node):
    def __init__(self):
        super().__init__("caller")
        self.declare_parameter("tick_period", 0.1)  # seconds
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.reply = self.create_publisher(String, "reply", 10)
        self.asked, self.answered = 0, 0
        self.create_timer(min(0.1, self.get_parameter("tick_period").value), self.tick)
        self.create_subscription(Empty, "request", self.on_request, 10)
        self.gate = self.create_client(Trigger, "gate")

    def tick(self):
        if self.asked > max(1, self.answered):
            return  # the gate is busy
        self.count += 1
        self.ticks.publish(Int64(data=self.count))

    def on_request(self, _):
        """Call the gate, and publish the message of its response on `reply`."""
        self.asked += 1
        future = self.gate.call_async(Trigger.Request())
        future.add_done_callback(self.on_response)

    def on_response(self, future):
        self.answered += 1
        self.reply.publish(String(data=future.result().message))


def spin(node):
    """Run the node's callbacks until the program is told to end."""
    rclpy.spin(node)


def main():
    rclpy.init()
    node = Caller()
    try:
        spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


main()
