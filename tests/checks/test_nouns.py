"""Each thing that a noun can be asked, of programs for which it holds and for which it does not."""

from __future__ import annotations

import pytest
from graded_cell import Grade

from autograder.checks.nouns import NOUNS

BUSY = """
import threading
import time
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64, String

rclpy.init()
node = Node("busy")
ticks, activity = node.create_publisher(Int64, "ticks", 10), node.create_publisher(String, "activity", 50)

def tells(name, work):
    def callback():
        activity.publish(String(data=f"{name} begin"))
        time.sleep(work)
        activity.publish(String(data=f"{name} end"))
    return callback

apart, together = MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup()
node.create_timer(0.1, lambda: ticks.publish(Int64(data=7)), MutuallyExclusiveCallbackGroup())
node.create_timer(0.4, tells("slow", 0.3), MutuallyExclusiveCallbackGroup())
node.create_timer(0.2, tells("read", 0.05), apart)
node.create_timer(0.2, tells("write", 0.05), apart)
node.create_timer(0.2, tells("itself", 0.6), together)
print("it runs", flush=True)
rclpy.spin(node, MultiThreadedExecutor(8))
"""

SERVES = """
import time
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

rclpy.init()
node = Node("serves")
group = ReentrantCallbackGroup()
node.declare_parameter("speed", 1.5)

def positive(parameters):
    wrong = [one for one in parameters if one.name == "speed" and one.value < 0]
    return SetParametersResult(successful=not wrong, reason="it is negative" if wrong else "")

node.add_on_set_parameters_callback(positive)

def answer(request, response):
    node.get_logger().warn("somebody asked")
    response.success = True
    return response

def execute(goal):
    told = Fibonacci.Feedback()
    for number in range(goal.request.order):
        told.sequence = [*told.sequence, number]
        goal.publish_feedback(told)
        time.sleep(0.3 if goal.request.order == 60 and number < 4 else 0.1)  # held up at first
        if goal.is_cancel_requested:
            goal.canceled()
            return Fibonacci.Result(sequence=told.sequence)
    goal.succeed()
    return Fibonacci.Result(sequence=told.sequence)

node.create_service(Trigger, "answer", answer)
ActionServer(node, Fibonacci, "count", execute, callback_group=group,
             goal_callback=lambda goal: GoalResponse.ACCEPT if goal.order > 0 else GoalResponse.REJECT,
             cancel_callback=lambda goal: CancelResponse.ACCEPT)
ticks = node.create_publisher(Int64, "ticks", 10)
node.create_timer(0.1, lambda: ticks.publish(Int64(data=1)), group)
said = node.create_publisher(String, "said", QoSProfile(depth=1, durability=1))
node.create_subscription(String, "say", lambda message: said.publish(message), 10)
node.create_subscription(String, "said", lambda message: None, 10)
gate = node.create_client(Trigger, "gate", callback_group=group)
node.create_subscription(String, "go", lambda message: gate.call(Trigger.Request()), 10, callback_group=group)
rclpy.spin(node, MultiThreadedExecutor(8))
"""

CAMERA = """
import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

class Camera(LifecycleNode):
    def on_activate(self, state):
        return TransitionCallbackReturn.FAILURE

rclpy.init()
rclpy.spin(Camera("camera"))
"""

CLEAN = """
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

rclpy.init()
try:
    rclpy.spin(Node("clean"))
except (KeyboardInterrupt, ExternalShutdownException):
    pass
finally:
    rclpy.try_shutdown()
"""

DRIVES = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

rclpy.init()
node = Node("drives")
publisher = node.create_publisher(Twist, "cmd_vel", 10)
command = Twist()
command.linear.x = 1.0
node.create_timer(0.05, lambda: publisher.publish(command))
rclpy.spin(node)
"""

ENDS = "import sys, time\nprint('over', flush=True)\ntime.sleep(0.5)\nsys.exit(3)\n"

LINES = {
    "busy": [
        ("ros.topic('/ticks', Int64).expect_publisher(node='/busy')", ""),
        ("ros.topic('/ticks', Int64).expect_publisher(count=2, within=1)", "count"),
        ("ros.topic('/nothing').expect_publisher(count=0)", ""),
        ("ros.topic('/ticks').expect_publisher(count=0, within=0.3)", "publisher-present"),
        ("ros.topic('/ticks', Int64).expect_subscription(within=1)", "wrong-end"),
        ("ros.topic('/ticks').expect_subscription(count=0)", ""),
        ("ros.topic('/ticks').expect_unused(within=0.3)", "topic-present"),
        ("ros.topic('/nothing').expect_unused()", ""),
        ("ros.topic('/ticks', Int64).expect_messages(at_least=5, rate=10, publisher='/busy')", ""),
        ("ros.topic('/ticks', Int64).expect_messages(at_least=5, rate=2, within=1)", "rate"),
        ("ros.topic('/ticks', Int64).expect_last(7, times=3)", ""),
        ("ros.topic('/ticks', Int64).expect_last(8, within=0.5)", "content"),
        ("ros.topic('/ticks', Int64).expect_last(8, within=0.5, code='own-code', because='It is {said}.')", "own-code"),
        ("ros.topic('/ticks', Int64).expect_silence(for_seconds=60)", "not-silent"),
        ("ros.require('messages' in ros.topic('/ticks', Int64).account(), 'It is told')", ""),
        ("ros.activity('/activity').expect_runs(['slow', 'read'], runs=2)", ""),
        ("ros.activity('/activity').expect_runs(['slower'], runs=2, within=2)", "silent"),
        ("ros.activity('/activity').expect_overlap(['slow', 'itself'])", ""),
        ("ros.activity('/activity').expect_overlap(['itself'], itself=True)", ""),
        ("ros.activity('/activity').expect_overlap(['read', 'write'])", "no-overlap"),
        ("ros.activity('/activity').expect_no_overlap(['read', 'write'])", ""),
        ("ros.activity('/activity').expect_no_overlap(['slow', 'itself'])", "overlap"),
        ("ros.activity('/activity').expect_period(['slow'], 0.4, runs=3)", ""),
        ("ros.activity('/activity').expect_period(['slow'], 0.1, runs=3)", "period"),
        ("ros.activity('/activity').expect_messages_during('slow', ros.topic('/ticks', Int64), at_least=2)", ""),
        ("ros.activity('/activity').expect_messages_during('slow', ros.topic('/ticks', Int64), at_least=9)", "paused"),
        ("ros.program('busy').expect_started()", ""),
        ("ros.program('busy').expect_running()", ""),
        ("ros.require('it runs' in ros.program('busy').output(), 'It says so')", ""),
        ("ros.program('busy').expect_exit(within=0.5)", "still-running"),
        ("ros.program('other').expect_running()", "failed"),
        ("ros.program('other').expect_started()", "failed"),
    ],
    "serves": [
        ("ros.node('/serves').expect()", ""),
        ("ros.node('/serve').expect(within=1)", "node-name"),
        ("ros.node('/serves').expect_parameter('speed', 1.5)", ""),
        ("ros.node('/serves').expect_parameter('speed', 2.0)", "parameter-value"),
        ("ros.node('/serves').expect_parameter_refused('speed', -1.0)", ""),
        ("ros.node('/serves').expect_parameter_refused('speed', 1.0)", "parameter-accepted"),
        ("ros.require_equal('It is set', ros.node('/serves').parameters(['speed']), {'speed': 1.0})", ""),
        ("ros.require(ros.node('/serves').set_parameter('speed', 1.5).successful, 'It may be set')", ""),
        ("ros.service('/answer', Trigger).expect()", ""),
        ("ros.service('/answers', Trigger).expect(within=1)", "service-name"),
        ("ros.require(ros.service('/answer', Trigger).call(Trigger.Request()).success, 'It answers')", ""),
        ("ros.require_equal('Both', len(ros.service('/answer', Trigger).call_many([Trigger.Request()] * 2)), 2)", ""),
        ("ros.require_equal('At once', ros.service('/answer', Trigger).kept_waiting(), '')", ""),
        ("ros.node('/serves').expect_log('asked', level='WARN')", ""),
        ("ros.node('/serves').expect_log('asked', level='ERROR', within=1)", "no-log"),
        ("ros.node('/serves').expect_log('asked', count=9, within=1)", "no-log"),
        ("ros.qos('/said').expect(reliability='reliable', durability='transient_local')", ""),
        ("ros.qos('/said').expect(durability='volatile')", "qos-durability"),
        ("ros.qos('/said').expect_match()", ""),
        ("ros.qos('/say').expect_match(within=1)", "topic-name"),
        ("ros.publisher('/say', String).publish(String(data='hello'))", ""),
        ("ros.topic('/said', String).expect_last('hello')", ""),
        ("ros.publisher('/says', String).publish(String(), within=1)", "topic-name"),
        ("sender = ros.publisher('/say', String, 5).stream(String(data='again'), rate=20); sender.start()", ""),
        ("ros.topic('/said', String).expect_last('again', times=3)", ""),
        ("sender.stop(); ros.topic('/said', String).expect_silence()", ""),
        ("[ros.publisher('/go', String).publish(String()) for _ in 'abc']", ""),
        ("ros.wait(lambda: ros.server('/gate').served(), 5); ros.require(ros.server('/gate').requests(), 'Asked')", ""),
        ("ros.server('/gate').expect_messages_during(ros.topic('/ticks', Int64), at_least=2)", ""),
        ("ros.server('/gate').expect_messages_during(ros.topic('/said', String), runs=1, within=1)", "paused"),
        ("goal = ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=5), accepted=True)", ""),
        ("goal.expect_feedback(at_least=5, rate=10); goal.expect_result()", ""),
        ("goal.expect_feedback(exactly=9, within=1)", "goal-feedback"),
        ("held_up = ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=60))", ""),
        ("held_up.expect_feedback(at_least=5, rate=10)", ""),
        ("held_up.expect_feedback(at_least=5, rate=40)", "rate"),
        ("held_up.expect_canceled()", ""),
        ("goal.expect_messages_during(ros.topic('/ticks', Int64), at_least=2)", ""),
        ("goal.expect_messages_during(ros.topic('/said', String), within=1)", "paused"),
        ("goal.expect_result(status='aborted')", "goal-status"),
        ("ros.require_equal('All', list(goal.result.sequence), list(range(5)))", ""),
        ("ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=0), accepted=True)", "goal-rejected"),
        ("ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=1), accepted=False)", "goal-accepted"),
        ("ros.action('/counts', Fibonacci).send_goal(Fibonacci.Goal(order=1), within=1)", "action-name"),
        ("ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=99), accepted=True).expect_canceled()", ""),
        ("goal.expect_canceled()", "cancel-refused"),
        ("ros.action('/count', Fibonacci).expect_one_at_a_time()", ""),
        ("[ros.action('/count', Fibonacci).send_goal(Fibonacci.Goal(order=9)) for _ in 'ab'][-1].expect_result()", ""),
        ("ros.action('/count', Fibonacci).expect_one_at_a_time()", "goals-together"),
    ],
    "camera": [
        ("ros.lifecycle('/camera').expect_state('unconfigured')", ""),
        ("ros.lifecycle('/camera').expect_state('active', within=10)", "state"),
        ("ros.lifecycle('/camera').transition('configure')", ""),
        ("ros.lifecycle('/camera').transition('configure')", "state"),
        ("ros.lifecycle('/camera').transition('activate')", "transition-failed"),
        ("ros.lifecycle('/camera').transition('activate', expect='failure')", ""),
        ("ros.lifecycle('/camera').transition('cleanup', expect='failure')", "transition-succeeded"),
        ("ros.require_equal('It is back', ros.lifecycle('/camera').state(), 'unconfigured')", ""),
        ("ros.require('configure' in ros.lifecycle('/camera').available_transitions(), 'It may begin again')", ""),
        ("ros.lifecycle('/camera').expect_transitions([('unconfigured', 'active')], within=0.5)", "transitions"),
        ("ros.lifecycle('/camera').expect_transitions(CONFIGURED + 2 * REFUSED + CLEANED_UP)", ""),
        ("ros.require_equal('All', ros.changes('/camera')[0].step, ('unconfigured', 'configuring'))", ""),
        ("ros.require('/camera' in ros.graph.nodes(), 'It is there')", ""),
        ("ros.require(ros.graph.wait(lambda: ros.graph.publishers('/camera/transition_event')), 'It tells')", ""),
        ("ros.require('/rosout' in ros.graph.topics() and not ros.graph.subscriptions('/rosout'), 'It logs')", ""),
        ("ros.program('camera').expect_clean_end(by='SIGTERM')", "unclean-end"),
    ],
    "clean": [
        ("ros.program('clean').expect_clean_end(by='SIGINT')", ""),
    ],
    "drives": [
        ("ros.car().expect_driven(0.5)", ""),
        ("ros.car().expect_driven(50, within=0.2)", "not-driven"),
        ("ros.car().expect_no_touch()", ""),
        ("ros.car().expect_stopped_within(0.1)", "not-stopped"),
        ("ros.car().expect_reached('parking', within=0.2)", "place-not-reached"),
        ("ros.car().expect_reached('end', within=20)", ""),
        ("ros.car().expect_stopped_within(5, at='end')", ""),
        ("ros.car().expect_stopped_within(5, at='end', stays=2)", ""),
        ("ros.car().expect_stopped_within(0.1, at='parking', stays=2)", "not-stopped"),
        ("ros.car().expect_no_touch()", "touched"),
        ("ros.require(ros.car().pose.x > 7 and ros.car().trail()[0].pose.x < 1, 'It drove')", ""),
        ("ros.require_equal('The wall', ros.car().touches()[0].what, 'a wall')", ""),
        ("ros.car().place(4.0, 1.4); ros.require_equal('It is put there', ros.car().trail()[-1].time > 5, True)", ""),
        ("ros.require('touched something' in str(ros.draw.world()), 'It is drawn')", ""),
        ("ros.require(str(ros.draw.film(frames=4)).startswith('4 moments'), 'It is a film')", ""),
    ],
    "ends": [
        ("ros.program('ends').expect_exit(status=3)", ""),
        ("ros.program('ends').expect_exit(status=0)", "exit-status"),
        ("ros.require_equal('Status', ros.program('ends').exit_status(), 3)", ""),
    ],
}
PROGRAMS = {"busy": BUSY, "serves": SERVES, "camera": CAMERA, "clean": CLEAN, "drives": DRIVES, "ends": ENDS}
SET_UP = """\
from std_msgs.msg import Int64
from test_msgs.action import Fibonacci
CONFIGURED = [("unconfigured", "configuring"), ("configuring", "inactive")]
REFUSED = [("inactive", "activating"), ("activating", "inactive")]
CLEANED_UP = [("inactive", "cleaningup"), ("cleaningup", "unconfigured")]
"""
WORDS = {
    "busy": "'busy', listen=[('/activity', String)]",
    "serves": "'serves', listen=[('/said', String), ('/ticks', Int64)],"
    " serve=[('/gate', Trigger, lambda request, response: response, 0.5)]",
    "camera": "'camera', lifecycle=['/camera']",
    "clean": "'clean'",
    "drives": "'drives', world='street'",
    "ends": "'ends'",
}


def test_each_expectation_has_a_line_where_it_holds_and_one_where_it_fails() -> None:
    lines = [line for program in LINES.values() for line in program]
    missing = [
        f"{noun}.{name}: a line where it {'fails' if fails else 'holds'}"
        for noun in NOUNS
        for name in dir(NOUNS[noun])
        for fails in (False, True)
        if name.startswith("expect") and f"{noun} {name}" != "ros expect_argument_needed"  # which takes a launch file
        if not any(f".{name}(" in line and noun in line and bool(code) is fails for line, code in lines)
    ]
    assert missing == [], "add a line of `LINES` for each of these"


@pytest.mark.parametrize("program", LINES)
def test_each_expectation_holds_where_it_should_and_fails_with_its_code(grade: Grade, program: str) -> None:
    parts = "".join(f"    with ros.part('{n}'):\n        {line}\n" for n, (line, _) in enumerate(LINES[program]))
    score = {str(n): 2 / len(LINES[program]) for n in range(len(LINES[program]))}
    check = f"{SET_UP}with launch({WORDS[program]}) as ros:\n{parts}ros.score({score})\n"
    result = grade(check, **{f"{program}__py": PROGRAMS[program]})
    codes = {outcome.part: outcome.code for outcome in result.outcomes if outcome.code}
    found = [(line, codes.get(str(n), "")) for n, (line, _) in enumerate(LINES[program])]
    wrong = [
        f"{got}, and not {wanted[1]!r}" for got, wanted in zip(found, LINES[program], strict=True) if got != wanted
    ]
    assert not wrong, "\n".join(wrong)
