"""The world as ROS nodes: another node drives the car and sees what its sensors send."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, Image, LaserScan
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
from autograder.sandbox.environment import profile_environment
from autograder.world import RunningWorld, Simulation, read_room
from autograder.world.simulation import STEP

WITHIN = 120.0
"""Far beyond what anything here takes on a busy machine, in seconds."""


@pytest.fixture
def observer() -> Iterator[Observer]:
    os.environ.update(profile_environment())
    domain = claim_domain()
    watching = Observer(domain.id, left=domain.release)
    yield watching
    watching.close()


def commands(observer: Observer, topic: str, speed: float, turn: float = 0.0) -> None:
    """Command a car 20 times a second from now on."""
    message = Twist()
    message.linear.x, message.angular.z = speed, turn
    publisher = observer.node.create_publisher(Twist, topic, 10)
    observer.node.create_timer(0.05, lambda: publisher.publish(message))


def ask(observer: Observer, kind: type, name: str, request: object) -> object:
    client = observer.node.create_client(kind, name)
    assert client.wait_for_service(WITHIN)
    answer = client.call_async(request)
    assert observer.wait(answer.done, WITHIN)
    return answer.result()


def place(observer: Observer, pose: object) -> tuple[bool, str]:
    return set_parameter(observer, Parameter("pose", value=pose))


def set_parameter(observer: Observer, parameter: Parameter) -> tuple[bool, str]:
    request = SetParameters.Request(parameters=[parameter.to_parameter_msg()])
    result = ask(observer, SetParameters, "/car/set_parameters", request).results[0]
    return result.successful, result.reason


def test_a_node_drives_the_car_and_gets_what_its_sensors_measure(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id)
    try:
        heard: dict[type, list[object]] = {}
        moving: list[object] = []
        for kind, topic in (
            (Odometry, "/odom"),
            (LaserScan, "/scan"),
            (Image, "/camera/image_raw"),
            (BatteryState, "/battery_state"),
        ):
            heard[kind] = []
            observer.node.create_subscription(kind, topic, heard[kind].append, qos_profile_sensor_data)
        commands(observer, "/cmd_vel", 0.4, 0.2)
        assert observer.wait(lambda: all(heard.values()) and world.simulation.records[""].metres > 0.5, WITHIN)

        def at_speed() -> list[object]:  # a busy machine may be late with a command, and the car brakes meanwhile
            one = heard[Odometry][-1]
            return [one] if one.pose.pose.position.x > 1.2 and one.twist.twist.linear.x == pytest.approx(0.4) else []

        assert observer.wait(lambda: moving.extend(at_speed()) or moving, WITHIN)
        odometry = moving[0]
        scan, image, battery = (heard[kind][-1] for kind in (LaserScan, Image, BatteryState))
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")
        assert 0 < odometry.pose.pose.orientation.z < 1
        assert scan.header.frame_id == "laser" and len(scan.ranges) == 180
        assert scan.angle_min == pytest.approx(-math.pi) and scan.angle_max == pytest.approx(math.pi * 178 / 180)
        assert (image.height, image.width, image.encoding, len(image.data)) == (48, 64, "rgb8", 64 * 48 * 3)
        assert 0.9 < battery.percentage <= 1.0 and battery.present
        assert world.nodes[""].counts["cmd_vel"] > 5
        assert observer.wait(lambda: observer.nodes() == ["/car"], WITHIN)
    finally:
        world.close()


def test_two_cars_have_their_names_and_frames_in_two_namespaces(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("street"), ["front", "rear"]), observer.domain_id)
    try:
        heard: list[Odometry] = []
        observer.node.create_subscription(Odometry, "/rear/odom", heard.append, 10)
        commands(observer, "/rear/cmd_vel", 0.4)
        records = world.simulation.records
        assert observer.wait(lambda: records["rear"].metres > 0.3 and heard, WITHIN)
        assert (heard[0].header.frame_id, heard[0].child_frame_id) == ("rear/odom", "rear/base_link")
        assert records["front"].metres == 0.0
        assert world.full_name("front", "scan") == "/front/scan"
    finally:
        world.close()


def test_its_names_can_be_remapped(observer: Observer) -> None:
    rules = ["--ros-args", "-r", "cmd_vel:=/control/command"]
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id, arguments=rules)
    try:
        commands(observer, "/control/command", 0.4)
        assert observer.wait(lambda: world.simulation.records[""].metres > 0.1, WITHIN)
    finally:
        world.close()


def test_the_car_is_placed_and_reset_by_services(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id)
    try:
        car = world.simulation.driven[""]
        assert place(observer, [5.0, 3.0, 1.0]) == (True, "")
        assert car.pose == (5.0, 3.0, 1.0)
        refused, why = place(observer, [0.1, 3.0, 1.0])
        assert not refused and why.startswith("a wall is at (") and car.pose == (5.0, 3.0, 1.0)
        assert place(observer, [1.0, 2.0]) == (False, "`pose` has three numbers: x, y, heading")
        assert ask(observer, Trigger, "/car/reset", Trigger.Request()).success
        assert car.pose == world.simulation.room.starts[0]
    finally:
        world.close()


def test_in_a_check_nobody_but_the_check_places_the_car(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id, closed=True)
    try:
        told = (False, "The check has placed the car; nobody else may place it, or set a parameter of it.")
        assert place(observer, [5.0, 3.0, 1.0]) == told
        assert set_parameter(observer, Parameter("use_sim_time", value=True)) == told  # else it could stop the world
        begun = world.simulation.time
        assert observer.wait(lambda: world.simulation.time > begun + 0.2, WITHIN)
        assert not ask(observer, Trigger, "/car/reset", Trigger.Request()).success
        assert world.simulation.driven[""].pose == world.simulation.room.starts[0]
    finally:
        world.close()


def test_a_heartbeat_is_needed_where_the_lab_says_so(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room"), heartbeat=True), observer.domain_id)
    try:
        record = world.simulation.records[""]
        commands(observer, "/cmd_vel", 0.4)
        assert observer.wait(lambda: record.commands > 10, WITHIN)
        assert record.metres == 0.0
        publisher = observer.node.create_publisher(Empty, "/heartbeat", 10)
        observer.node.create_timer(0.1, lambda: publisher.publish(Empty()))
        assert observer.wait(lambda: record.metres > 0.1, WITHIN)
    finally:
        world.close()


def test_a_world_that_is_paused_stands_still(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id)
    try:
        assert observer.wait(lambda: world.simulation.steps > 3, WITHIN)
        world.paused = True
        passed: list[float] = []  # in the world's own thread, which may be in the middle of a step now
        world.nodes[""].node.create_timer(STEP, lambda: passed.append(time.monotonic()))
        assert observer.wait(lambda: len(passed) > 1, WITHIN)
        before = world.simulation.steps
        assert observer.wait(lambda: len(passed) > 5, WITHIN) and world.simulation.steps == before
    finally:
        world.close()


def test_a_patient_world_waits_a_second_for_a_program_that_is_late_and_then_brakes(observer: Observer) -> None:
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id, patient=True)
    try:
        publisher = observer.node.create_publisher(Twist, "cmd_vel", 10)
        assert observer.wait(publisher.get_subscription_count, WITHIN)
        message = Twist()
        message.linear.x = 1.0
        began = time.monotonic()
        publisher.publish(message)
        car = world.simulation.driven[""]
        assert observer.wait(lambda: world.simulation.time > car.commanded + 0.2 >= 0.2, WITHIN)
        assert time.monotonic() - began > 1.0
        assert observer.wait(lambda: world.simulation.time > car.commanded + 0.6, WITHIN)
        assert car.speed == 0 and world.simulation.records[""].metres > 0.01
    finally:
        world.close()


def test_a_patient_world_does_not_wait_for_a_program_that_sends_no_numbers(observer: Observer) -> None:
    """Otherwise its time would stand still, and so would each check that waits for a moment of the world."""
    world = RunningWorld(Simulation(read_room("room")), observer.domain_id, patient=True)
    try:
        publisher = observer.node.create_publisher(Twist, "cmd_vel", 10)
        assert observer.wait(publisher.get_subscription_count, WITHIN)
        message = Twist()
        publisher.publish(message)
        car = world.simulation.driven[""]
        assert observer.wait(lambda: car.commanded >= 0, WITHIN)
        message.linear.x = math.nan
        observer.node.create_timer(0.05, lambda: publisher.publish(message))
        record, before = world.simulation.records[""], world.simulation.records[""].commands
        assert observer.wait(lambda: record.commands > before + 5, WITHIN)
        steps, before = world.simulation.steps, record.commands
        assert observer.wait(lambda: world.simulation.steps > steps + 20 and record.commands > before, WITHIN)
    finally:
        world.close()
