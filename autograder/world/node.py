"""The ROS side of the world: a node `car` for each car that is driven, and the timer that lets the world go on.

Each car's names are relative, so that a namespace and remap rules work as for any node: it subscribes to `cmd_vel`
(`geometry_msgs/Twist`) and publishes `odom`, `scan`, `camera/image_raw` and `battery_state`; `~/reset` puts it back to
its start, and setting its parameter `pose` to [x, y, heading] puts it somewhere else. Units and frames are those of
REP 103 and REP 105: metres, radians, x ahead and y to the left; `base_link` is the car's middle. The frame `odom` has
its origin in the lower left corner of the map, and does not drift. A scan has infinity where nothing was hit (REP 117).

What the car did is in the record of the simulation, in the process of the world: no message of another program can
change it. A program can only command the car, as it should; in a check, `closed` refuses reset and `pose`, too.
"""

from __future__ import annotations

import array
import contextlib
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, Image, LaserScan
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from autograder.world import car as cars
from autograder.world.room import Pose
from autograder.world.simulation import RANGE_MAX, RANGE_MIN, STEP, Simulation

NAME = "car"
TOPICS = ("cmd_vel", "odom", "scan", "camera/image_raw", "battery_state")
"""The relative names of a car's topics."""
_STEPS_A_PICTURE, _STEPS_A_BATTERY = 4, 20
"""The steps between two pictures of the camera (5 Hz), and between two messages of the battery (1 Hz)."""
_LATE, _LONGEST = 0.1, 1.0
"""A patient world waits when the last command is older than so many of its seconds, for at most so many real ones."""
_CLOSED = "The check has placed the car; nobody else may place it, or set a parameter of it."


class CarNode:
    """The node of one car.

    Args:
        simulation: the world.
        name: the car's namespace.
        context: the ROS context.
        closed: whether nobody but the world itself may place the car.
        arguments: the ROS arguments of the node, such as remap rules.
    """

    def __init__(
        self, simulation: Simulation, name: str, context: Context, *, closed: bool, arguments: Sequence[str]
    ) -> None:
        """Create the node with its topics, its service and its parameter."""
        self._world, self._name, self._closed = simulation, name, closed
        self._heard = -math.inf
        self.node: Node = rclpy.create_node(
            NAME, namespace=name, context=context, cli_args=list(arguments), use_global_arguments=not arguments,
            enable_rosout=False, enable_logger_service=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )  # fmt: skip
        prefix = f"{name}/" if name else ""
        self._odom_frame, self._base = f"{prefix}odom", f"{prefix}base_link"
        self._laser, self._camera = f"{prefix}laser", f"{prefix}camera_optical_frame"
        node = self.node
        self.counts = dict.fromkeys(TOPICS, 0)
        """The messages that came on `cmd_vel` and `heartbeat`, and that were sent on the other topics."""
        self._odometry = node.create_publisher(Odometry, "odom", 10)
        self._scan = node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self._image = node.create_publisher(Image, "camera/image_raw", qos_profile_sensor_data)
        self._battery = node.create_publisher(BatteryState, "battery_state", 10)
        node.create_subscription(Twist, "cmd_vel", self._commanded, QoSProfile(depth=1))
        if simulation.heartbeat:
            self.counts["heartbeat"] = 0
            node.create_subscription(Empty, "heartbeat", self._beat, QoSProfile(depth=1))
        node.create_service(Trigger, "~/reset", self._reset)
        start = simulation.driven[name].pose
        about = ParameterDescriptor(description="x and y in metres, heading in radians; setting it places the car")
        node.declare_parameter("pose", [float(value) for value in start], about)
        node.add_on_set_parameters_callback(self._place)

    def _commanded(self, message: Twist) -> None:
        self.counts["cmd_vel"] += 1
        # A command that is passed over does not make a patient world wait: the next one would be passed over, too.
        if self._world.command(self._name, message.linear.x, message.angular.z):
            self._heard = time.monotonic()

    def _beat(self, _: Empty) -> None:
        self.counts["heartbeat"] += 1
        self._world.beat(self._name)

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = not self._closed, _CLOSED if self._closed else "The car is at its start."
        if not self._closed:
            self._world.reset(self._name)
        return response

    def _place(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        if self._closed:
            return SetParametersResult(successful=False, reason=_CLOSED)
        for parameter in parameters:
            if parameter.name == "pose":
                value = list(parameter.value or ())
                if len(value) != 3:
                    return SetParametersResult(successful=False, reason="`pose` has three numbers: x, y, heading")
                reason = self._world.place(self._name, Pose(*map(float, value)))
                if reason:
                    return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def is_awaited(self) -> bool:
        """Whether the program that drives the car is late with a command, but not so late that it must be gone."""
        age = self._world.time - self._world.driven[self._name].commanded
        return age > _LATE + STEP / 2 and time.monotonic() - self._heard < _LONGEST

    def publish(self) -> None:
        """Publish what the sensors measure after a step; what nobody subscribes to is not computed."""
        steps = self._world.steps
        stamp = self.node.get_clock().now().to_msg()
        self._send(self._odometry, "odom", lambda: self._odometry_message(stamp))
        self._send(self._scan, "scan", lambda: self._scan_message(stamp))
        if steps % _STEPS_A_PICTURE == 0:
            self._send(self._image, "camera/image_raw", lambda: self._image_message(stamp))
        if steps % _STEPS_A_BATTERY == 0:
            self._send(self._battery, "battery_state", lambda: self._battery_message(stamp))

    def _send(self, publisher: Any, topic: str, message: Callable[[], Any]) -> None:
        self.counts[topic] += 1
        if publisher.get_subscription_count():
            publisher.publish(message())

    def _odometry_message(self, stamp: Any) -> Odometry:
        car = self._world.driven[self._name]
        message = Odometry(child_frame_id=self._base)
        message.header.stamp, message.header.frame_id = stamp, self._odom_frame
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y = car.pose.x, car.pose.y
        pose.orientation.z, pose.orientation.w = math.sin(car.pose.heading / 2), math.cos(car.pose.heading / 2)
        twist.linear.x, twist.angular.z = car.speed, car.turn
        return message

    def _scan_message(self, stamp: Any) -> LaserScan:
        angles = self._world.angles
        step = 2 * math.pi / len(angles)
        message = LaserScan(
            angle_min=-math.pi, angle_max=-math.pi + step * (len(angles) - 1), angle_increment=step, scan_time=STEP,
            range_min=RANGE_MIN, range_max=RANGE_MAX,
        )  # fmt: skip
        message.header.stamp, message.header.frame_id = stamp, self._laser
        message.ranges = array.array("f", self._world.scan(self._name).tobytes())
        return message

    def _image_message(self, stamp: Any) -> Image:
        seen = self._world.picture(self._name)
        height, width, colours = seen.shape
        message = Image(height=height, width=width, encoding="rgb8", step=width * colours)
        message.header.stamp, message.header.frame_id = stamp, self._camera
        message.data = array.array("B", seen.tobytes())
        return message

    def _battery_message(self, stamp: Any) -> BatteryState:
        car = self._world.driven[self._name]
        message = BatteryState(
            voltage=cars.EMPTY + (cars.FULL - cars.EMPTY) * car.charge, percentage=car.charge, present=True,
            temperature=math.nan, current=math.nan, charge=math.nan, capacity=math.nan, design_capacity=math.nan,
            power_supply_status=BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
            power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        )  # fmt: skip
        message.header.stamp, message.header.frame_id = stamp, self._base
        return message


class RunningWorld:
    """A world that runs in a thread of this process until `close`.

    Args:
        simulation: the world.
        domain_id: the ROS domain; by default that of the environment.
        closed: whether nobody but the world itself may place the cars, as in a check.
        patient: whether it takes no step while a program is late with its command.
        arguments: the ROS arguments of its nodes; by default those of this process.
    """

    def __init__(
        self, simulation: Simulation, domain_id: int | None = None, *, closed: bool = False,
        patient: bool = False, arguments: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Create the nodes and start the time of the world."""
        self.simulation = simulation
        self.paused, self._patient = False, patient
        with contextlib.ExitStack() as leaving:
            self._context = Context()
            rclpy.init(context=self._context, domain_id=domain_id, args=list(arguments) or None)
            leaving.callback(rclpy.try_shutdown, context=self._context)
            self.nodes: dict[str, CarNode] = {}
            self._executor = SingleThreadedExecutor(context=self._context)
            for name in simulation.driven:
                self.nodes[name] = CarNode(simulation, name, self._context, closed=closed, arguments=arguments)
                leaving.callback(self.nodes[name].node.destroy_node)
                self._executor.add_node(self.nodes[name].node)
            # Whoever sets `use_sim_time` of a car decides about the clock of its node, and not about that of the world.
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            next(iter(self.nodes.values())).node.create_timer(STEP, self._tick, clock=steady)
            self._thread = threading.Thread(target=self._spin, name="world", daemon=True)
            self._thread.start()
            self._leaving = leaving.pop_all()

    def _tick(self) -> None:
        late = self._patient and any(node.is_awaited() for node in self.nodes.values())
        if not self.paused and not late:
            self.simulation.step()
            for node in self.nodes.values():
                node.publish()

    def _spin(self) -> None:
        # While `close` shuts down, waiting may end with an error of the context, which is no longer of interest.
        with contextlib.suppress(ExternalShutdownException, RuntimeError):
            self._executor.spin()

    def full_name(self, car: str, topic: str) -> str:
        """Return the name of a car's topic after its namespace and remap rules."""
        return str(self.nodes[car].node.resolve_topic_name(topic))

    def close(self) -> None:
        """End the world. The thread is joined, because one that spins at exit would abort the process."""
        with self._leaving:
            self._executor.shutdown(timeout_sec=2.0)
            rclpy.try_shutdown(context=self._context)
            self._thread.join(timeout=5.0)
