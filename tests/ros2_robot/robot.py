"""The three nodes that the real tool was measured on: `tests/ros2_robot/measured.txt`."""

import itertools
import time

import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci


def agree(handle):
    return CancelResponse.ACCEPT


class Demo(Node):
    def __init__(self):
        super().__init__("demo")
        self.count = 0
        self.chatter = self.create_publisher(String, "chatter", 10)
        self.create_subscription(String, "in", lambda message: None, 10)
        self.create_service(SetBool, "switch", self.switch)
        self.create_service(Trigger, "~/reset", lambda request, response: response)
        self.create_timer(0.1, self.tick)
        per_second = ParameterDescriptor(
            description="ticks per second", integer_range=[IntegerRange(from_value=1, to_value=60, step=1)]
        )
        self.declare_parameter("frame", "map")
        self.declare_parameter("rate", 10, per_second)
        self.declare_parameter("gain", 1.5)
        self.declare_parameter("limits.top", 2.0)
        self.declare_parameter("list", [1, 2])
        self.declare_parameter("names", ["a", "b"])
        self.declare_parameter("on", True)
        self.declare_parameter("ro", "fixed", ParameterDescriptor(read_only=True))
        self.add_on_set_parameters_callback(self.look_at)
        self.server = ActionServer(
            self, Fibonacci, "fibonacci", self.compute, goal_callback=self.decide, cancel_callback=agree,
            callback_group=ReentrantCallbackGroup(),
        )  # fmt: skip

    def tick(self):
        self.count += 1
        self.chatter.publish(String(data=f"hello {self.count}"))

    def switch(self, request, response):
        response.success, response.message = True, f"now {request.data}"
        return response

    def look_at(self, parameters):
        bad = any(one.name == "frame" and one.value == "bad" for one in parameters)
        return SetParametersResult(successful=not bad, reason="frame must not be bad" if bad else "")

    def decide(self, goal):
        return GoalResponse.REJECT if goal.order > 100 else GoalResponse.ACCEPT

    def compute(self, handle):
        if handle.request.order == 7:
            handle.abort()
            return Fibonacci.Result()
        feedback = Fibonacci.Feedback(sequence=[0, 1])
        rounds = itertools.count() if handle.request.order == 100 else range(handle.request.order - 1)
        for _ in rounds:  # a goal of order 100 goes on until it is cancelled, however late that is
            time.sleep(0.1)
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result()
            following = (feedback.sequence[-1] + feedback.sequence[-2]) % 2**31  # a long goal would not fit
            feedback.sequence = [*feedback.sequence, following]
            handle.publish_feedback(feedback)
        handle.succeed()
        return Fibonacci.Result(sequence=feedback.sequence)


class RightDemo(Node):
    def __init__(self):
        super().__init__("right_demo", namespace="/vehicle")
        self.create_publisher(String, "status", 10)
        any_type = ParameterDescriptor(dynamic_typing=True)
        self.declare_parameter("loose", "", any_type)
        self.declare_parameter("unset", descriptor=any_type)
        self.create_publisher(String, "~/status", 10)
        self.create_subscription(Bool, "/emergency_stop", lambda message: None, 10)


class CameraDriver(LifecycleNode):
    def __init__(self):
        super().__init__("camera_driver", namespace="/vehicle")
        self.failed = False
        self.image = self.create_publisher(Image, "camera/image_color", 10)
        self.create_timer(0.1, self.tick)

    def tick(self):
        image = Image()
        image.header.frame_id = "camera_frame"
        self.image.publish(image)

    def on_configure(self, state):
        # The first time it succeeds, and after a cleanup it does not.
        result = TransitionCallbackReturn.FAILURE if self.failed else TransitionCallbackReturn.SUCCESS
        self.failed = True
        return result

    def on_cleanup(self, state):
        return TransitionCallbackReturn.SUCCESS


rclpy.init()
executor = MultiThreadedExecutor(num_threads=4)
nodes = [Demo(), RightDemo(), CameraDriver()]
for node in nodes:
    executor.add_node(node)
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
finally:
    rclpy.try_shutdown()
