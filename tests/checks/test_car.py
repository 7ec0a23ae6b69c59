"""What a check is told about a car comes from the world itself, in the sandbox, whatever a program publishes."""

from __future__ import annotations

import pytest

from autograder.core.results import CheckResult, Isolation, Status
from autograder.grading.job import Cell, Job
from autograder.grading.supervisor import run_in_worker
from autograder.sandbox.isolation import preflight

DRIVES = """
import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

rclpy.init()
node = Node("drives")
wheels = node.create_publisher(Twist, "cmd_vel", 10)
command = Twist()
command.linear.x = {speed}
node.create_timer(0.05, lambda: wheels.publish(command))
{more}
rclpy.spin(node)
"""
LIES = """
odometry = node.create_publisher(Odometry, "odom", 10)
told = Odometry()
told.pose.pose.position.x, told.pose.pose.position.y = 7.3, 2.4
node.create_timer(0.05, lambda: odometry.publish(told))
place = node.create_client(SetParameters, "car/set_parameters")
reset = node.create_client(Trigger, "car/reset")
there = Parameter("pose", value=[7.3, 2.4, 0.0]).to_parameter_msg()
def ask():
    place.call_async(SetParameters.Request(parameters=[there])).add_done_callback(
        lambda answer: print(answer.result().results[0].reason, flush=True))
    reset.call_async(Trigger.Request())
node.create_timer(0.1, ask)
"""
SET_UP = "from autograder.checks import World, launch, launch_file\n"


def graded(check: str, program: str, **files: str) -> CheckResult:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    job = Job(
        student="someone", lab="lab", digest="digest", isolation=Isolation.FULL, seed=1,
        files={"p.py": program, **{name.replace("__", "."): text for name, text in files.items()}},
        cells=[Cell(grade_id="set_up", source=SET_UP), Cell(grade_id="check", points=1, source=check)],
    )  # fmt: skip
    (found,) = run_in_worker(job).checks
    return found


def test_a_car_that_gets_there_passes_and_the_report_has_its_trail() -> None:
    check = 'with launch("p", world="street") as ros:\n    time = ros.car().expect_reached("end", within=20)\n'
    check += '    ros.require(4 < time < 20, "It says when")\nros.score(1)'
    found = graded(check, DRIVES.format(speed=1.0, more=""))
    assert found.points == 1 and not found.flags, found
    picture = found.outcomes[0].picture
    assert picture is not None and "on end; it touched nothing" in picture.alt


def test_a_program_that_lies_about_the_car_neither_moves_it_nor_deceives_the_check() -> None:
    check = 'with launch("p", world="street") as ros:\n'
    check += '    ros.wait(lambda: "nobody else may" in ros.program("p").output(), 20)\n'
    check += '    ros.car().expect_reached("end", within=0.5)\nros.score(1)'
    found = graded(check, DRIVES.format(speed=0.0, more=LIES))
    assert found.points == 0 and found.first_failure is not None
    assert found.first_failure.code == "place-not-reached", found
    assert found.flags == ["/drives publishes on /odom, which is the world's; the check asked the world itself."]
    assert "nobody else may" in found.logs[0].text


def test_a_failure_says_where_it_went_wrong_and_marks_the_place() -> None:
    room = "cell: 0.5\nplaces: {P: parking}\nmap: |\n  ########\n  #> %  P#\n  ########\n"
    check = 'with launch("p", world=World("small.yaml")) as ros:\n'
    check += '    ros.require(ros.wait(ros.car().touches, 120), "It touches the box")\n'
    check += '    ros.car().expect_reached("parking", within=1)\nros.score(1)'
    found = graded(check, DRIVES.format(speed=0.5, more=""), small__yaml=room)
    failed = found.first_failure
    assert failed is not None and failed.code == "place-not-reached" and failed.picture is not None
    assert "nearest to parking: 1.7" in failed.because or "nearest to parking: 1.6" in failed.because, failed.because
    assert "There it touched a box." in failed.because
    assert failed.because in failed.picture.alt


def test_a_car_that_creeps_against_a_box_has_touched_it_where_it_was_nearest() -> None:
    """As one does that a busy machine lets brake just before the box: the last two centimetres take it seconds."""
    room = "cell: 0.5\nplaces: {P: parking}\nmap: |\n  ########\n  #> %  P#\n  ########\n"
    check = 'with launch("p", world=World("small.yaml")) as ros:\n    ros.car().place(1.23, 0.75)\n'
    check += '    ros.require(ros.wait(ros.car().touches, 120), "It touches the box")\n'
    check += '    ros.car().expect_reached("parking", within=1)\nros.score(1)'
    failed = graded(check, DRIVES.format(speed=0.01, more=""), small__yaml=room).first_failure
    assert failed is not None and failed.code == "place-not-reached"
    assert "There it touched a box." in failed.because, failed.because


def test_a_check_sees_where_a_car_would_come_without_the_box_that_holds_it() -> None:
    room = "cell: 0.5\nplaces: {P: parking}\nmap: |\n  ########\n  #> %  P#\n  ########\n"
    check = 'with launch("p", world=World("small.yaml", boxes=False)) as ros:\n'
    check += '    ros.car().expect_reached("parking", within=20)\n    ros.car().expect_no_touch()\nros.score(1)'
    found = graded(check, DRIVES.format(speed=0.5, more=""), small__yaml=room)
    assert found.points == 1, found


RESTS = """
steps = 0
def count(odometry):
    global steps
    steps += 1
    command.linear.x, command.angular.z = (0.5, 0.0) if steps < 20 else (0.0, 0.0) if steps < 60 else {then}
node.create_subscription(Odometry, "odom", count, 10)
"""


@pytest.mark.parametrize(
    ("then", "told"),
    [("(0.5, 0.0)", "the car stood, and then it drove on."), ("(0.0, 1.0)", "and then it turned on the spot.")],
)
def test_a_car_that_does_not_stay_where_it_has_stopped_is_told_for_how_long_it_stood(then: str, told: str) -> None:
    check = 'with launch("p", world="street") as ros:\n    car = ros.car()\n    car.expect_driven(0.2)\n'
    check += "    car.expect_stopped_within(5, stays=1)\n    car.expect_stopped_within(5, stays=6)\nros.score(1)"
    found = graded(check, DRIVES.format(speed=0.0, more=RESTS.format(then=then)))
    failed = found.first_failure
    assert [outcome.status for outcome in found.outcomes[:2]] == 2 * [Status.PASSED], found
    assert failed is not None and failed.code == "not-stopped" and told in failed.because, found


def test_a_car_that_only_turns_has_turned() -> None:
    check = 'with launch("p", world="street") as ros:\n    ros.car().expect_driven(0.2, within=3)\nros.score(1)'
    failed = graded(check, DRIVES.format(speed=0.0, more="command.angular.z = 1.0")).first_failure
    assert failed is not None and failed.code == "not-driven", failed
    assert "It drove 0.00 m" in failed.because and "and turned by" in failed.because, failed.because


def test_a_program_that_sends_no_command_reads_why() -> None:
    check = 'with launch("p", world="street") as ros:\n    ros.wait(lambda: ros.graph.publishers("/cmd_vell"), 120)\n'
    check += "    ros.car().expect_driven(1.0, within=1)\nros.score(1)"
    found = graded(check, DRIVES.format(speed=1.0, more="").replace('"cmd_vel"', '"cmd_vell"'))
    failed = found.first_failure
    assert failed is not None and failed.code == "topic-name" and "/cmd_vell" in failed.because, failed


def test_a_topic_of_the_world_is_not_taken_for_a_misspelt_one_of_the_students() -> None:
    check = 'with launch("p", world="street") as ros:\n    ros.car().expect_driven(1.0, within=1)\nros.score(1)'
    idle = "import rclpy\n\nrclpy.init()\nrclpy.spin(rclpy.create_node('idle'))\n"
    failed = graded(check, idle).first_failure
    assert failed is not None and "`/cmd_vel` has a subscription, but no publisher" in failed.because, failed


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("ros.car()", "this launch has no world"),
        ("ros.draw.world()", "this launch has no world"),
        ("World('garage')", "There is no room `garage`"),
        ("World(cars='/front')", "write a list"),
        ("World(cars=['front'])", "are no namespaces"),
    ],
)
def test_what_an_author_gets_wrong_is_said(line: str, told: str) -> None:
    world = line if line.startswith("World") else "None"
    check = f"with launch('p', world={world}) as ros:\n    {line}\nros.score(1)"
    found = graded(check, "import time\ntime.sleep(9)\n")
    assert found.status is Status.UNKNOWN and told in found.outcomes[-1].because, found


LAUNCH_FILE = """
launch:
- group:
  - push_ros_namespace: {namespace: rear}
  - node: {pkg: lab, exec: p, remap: [{from: cmd_vel, to: drive}]}
"""


def test_a_launch_file_drives_one_of_two_cars_by_their_names() -> None:
    cars = 'World("street", cars=["/front", "/rear"], remappings=[("cmd_vel", "drive")])'
    check = f'with launch_file("car.launch.yaml", package="lab", world={cars}) as ros:\n'
    check += (
        '    ros.car("/rear").expect_driven(1.0)\n    ros.car("/front").expect_driven(0.1, within=0.2)\nros.score(1)'
    )
    found = graded(check, DRIVES.format(speed=0.5, more=""), **{"car.launch__yaml": LAUNCH_FILE})
    assert [(outcome.status, outcome.title) for outcome in found.outcomes] == [
        (Status.PASSED, "`/rear/car` drives 1 m"),
        (Status.FAILED, "`/front/car` drives 0.1 m"),
    ], found


def test_a_check_places_the_car_and_drives_it_with_a_heartbeat() -> None:
    check = 'with launch("p", world=World("street", heartbeat=True)) as ros:\n    car = ros.car()\n'
    check += "    car.place(5.0, 1.4)\n    car.expect_stopped_within(0.5)\n"
    check += '    ros.require(abs(car.pose.x - 5.0) < 0.01, "It is there")\n'
    check += '    ros.topic("/cmd_vel", Twist).expect_messages()\n    car.expect_driven(0.1, within=0.5)\nros.score(1)'
    failed = graded(f"from geometry_msgs.msg import Twist\n{check}", DRIVES.format(speed=0.5, more="")).first_failure
    assert failed is not None and failed.code == "not-driven"
    assert "because nothing came on `cmd_vel`, or no heartbeat, for 0.3 s" in failed.because, failed.because


def test_an_int_in_a_command_is_told_and_not_where_the_check_has_turned_the_car() -> None:
    check = 'from geometry_msgs.msg import Twist\nwith launch("p", world="street") as ros:\n    car = ros.car()\n'
    check += '    ros.topic("/cmd_vel", Twist).expect_messages()\n    car.place(*car.pose[:2], 2.0)\n'
    check += "    car.expect_driven(0.1, within=1)\nros.score(1)"
    failed = graded(check, DRIVES.format(speed="1", more="")).first_failure
    assert failed is not None and failed.code == "not-driven"
    assert "has an `int` where a `float` is required: write `1.0`, not `1`" in failed.because, failed.because
    assert "turned" not in failed.because, failed.because


def test_commands_that_are_no_numbers_are_told_as_such_and_not_as_missing() -> None:
    check = (
        'from geometry_msgs.msg import Twist\nwith launch("p", world=World("street", patient=True)) as ros:\n'
        '    ros.topic("/cmd_vel", Twist).expect_messages()\n    ros.car().expect_driven(0.1, within=1)\n'
    )
    failed = graded(f"{check}ros.score(1)", DRIVES.format(speed="float('nan')", more="")).first_failure
    assert failed is not None and failed.code == "not-driven"
    assert "because the last command on `cmd_vel` was NaN or infinite" in failed.because, failed.because
