%%node courier
import math
import threading
import time
from typing import List, Optional, Tuple

import rclpy
from geometry_msgs.msg import Pose, PoseArray
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from test_msgs.action import Fibonacci

Place = Tuple[float, float]


def heading_of(orientation) -> float:
    return 2.0 * math.atan2(orientation.z, orientation.w)


class Courier(Node):
    STANDS = 25  # messages on `odom`, of which 20 are a second of the world
    NEAR = 0.2  # metres

    def __init__(self) -> None:
        super().__init__("courier")
        self.lock = threading.Lock()
        self.places: List[Place] = []
        self.target: Optional[Place] = None
        self.stood = 0  # messages on `odom` for which the car has stood near the target
        self.before: Optional[Tuple[float, float, float]] = None
        self.busy = False
        latched = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        group = MutuallyExclusiveCallbackGroup()
        self.route = self.create_publisher(PoseArray, "route", 10)
        self.create_subscription(PoseArray, "parcels", self.on_parcels, latched, callback_group=group)
        self.create_subscription(Odometry, "odom", self.on_odom, qos_profile_sensor_data, callback_group=group)
        self.server = ActionServer(
            self,
            Fibonacci,
            "deliver",
            self.execute,
            goal_callback=self.decide,
            cancel_callback=lambda goal_handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def on_parcels(self, parcels: PoseArray) -> None:
        with self.lock:
            self.places = [(pose.position.x, pose.position.y) for pose in parcels.poses]
        self.get_logger().info(f"{len(parcels.poses) // 2} parcels")

    def on_odom(self, odom: Odometry) -> None:
        """Count for how long the car stands, and tell the driver where to drive: the world's clock is the clock of both."""
        pose = odom.pose.pose
        here = (pose.position.x, pose.position.y, heading_of(pose.orientation))
        with self.lock:
            before, self.before = self.before or here, here
            moved = math.dist(here[:2], before[:2]) > 0.005 or abs(math.remainder(here[2] - before[2], math.tau)) > 0.01
            moved = moved or abs(odom.twist.twist.linear.x) > 0.02 or abs(odom.twist.twist.angular.z) > 0.02
            near = self.target is not None and math.dist(here[:2], self.target) < self.NEAR
            self.stood = self.stood + 1 if near and not moved else 0
            self.publish_route()

    def publish_route(self) -> None:
        message = PoseArray()
        message.header.frame_id = "odom"
        if self.target is not None:
            pose = Pose()
            pose.position.x, pose.position.y = self.target
            message.poses.append(pose)
        self.route.publish(message)

    def go(self, target: Optional[Place]) -> None:
        with self.lock:
            self.target, self.stood = target, 0
            self.publish_route()

    def decide(self, goal: Fibonacci.Goal) -> GoalResponse:
        with self.lock:
            known = 2 * goal.order <= len(self.places)
            if not known or self.busy:
                self.get_logger().warning(f"order {goal.order} is rejected")
                return GoalResponse.REJECT
            self.busy = True
        return GoalResponse.ACCEPT

    def execute(self, goal_handle) -> Fibonacci.Result:
        number = goal_handle.request.order
        done: List[int] = []
        try:
            with self.lock:
                way = [self.places[2 * number - 2], self.places[2 * number - 1]]
            for leg, place in enumerate(way, start=1):
                if not self.visit(place, goal_handle):
                    self.go(None)
                    goal_handle.canceled()
                    return Fibonacci.Result(sequence=done)
                done.append(leg)
                goal_handle.publish_feedback(Fibonacci.Feedback(sequence=done))
            goal_handle.succeed()
            return Fibonacci.Result(sequence=done)
        finally:
            self.go(None)
            self.busy = False

    def visit(self, place: Place, goal_handle) -> bool:
        """Wait until the car has stood there; return False if the order is canceled before."""
        self.go(place)
        while not goal_handle.is_cancel_requested:
            with self.lock:
                if self.stood >= self.STANDS:
                    return True
            time.sleep(0.02)
        return False


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=6)
    executor.add_node(Courier())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
