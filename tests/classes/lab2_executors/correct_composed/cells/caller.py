import threading

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Empty, Int64, String
from std_srvs.srv import Trigger


class Gate:
    """The client, which hands each answer on."""

    def __init__(self, node):
        self.client = node.create_client(Trigger, "gate", callback_group=MutuallyExclusiveCallbackGroup())

    def ask(self):
        answer, come = [], threading.Event()
        self.client.call_async(Trigger.Request()).add_done_callback(lambda future: (answer.append(future), come.set()))
        come.wait()
        return answer[0].result().message


class Caller(Node):
    def __init__(self):
        super().__init__("caller")
        self.declare_parameter("tick_period", 0.1)
        self.count = 0
        self.ticks = self.create_publisher(Int64, "ticks", 10)
        self.reply = self.create_publisher(String, "reply", 10)
        self.gate = Gate(self)
        self.create_timer(self.get_parameter("tick_period").value, self.tick, MutuallyExclusiveCallbackGroup())
        self.create_subscription(Empty, "request", lambda _: self.reply.publish(String(data=self.gate.ask())), 10)

    def tick(self):
        self.count += 1
        self.ticks.publish(Int64(data=self.count))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Caller())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
