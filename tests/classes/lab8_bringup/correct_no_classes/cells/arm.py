%%node arm
import rclpy
import rclpy.callback_groups
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


class Arm(Node):
    """One thread; the service waits with `await`, for a timer."""

    def __init__(self):
        super().__init__("arm")
        self.beats = 0
        self.heartbeat = self.create_publisher(Int32, "heartbeat", 10)
        self.create_timer(0.1, self.beat)
        self.create_service(Trigger, "grip", self.on_grip, callback_group=rclpy.callback_groups.ReentrantCallbackGroup())

    def beat(self):
        self.beats += 1
        self.heartbeat.publish(Int32(data=self.beats))

    async def on_grip(self, request, response):
        closed = Future()
        timer = self.create_timer(1.0, lambda: closed.done() or closed.set_result(True),
                                  callback_group=rclpy.callback_groups.ReentrantCallbackGroup())
        await closed
        self.destroy_timer(timer)
        response.success = True
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(Arm())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


main()
