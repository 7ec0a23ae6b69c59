"""What `launch` and the expectations find out about real nodes, right ones and wrong ones."""

from __future__ import annotations

import textwrap
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from graded_cell import TALKER, Grade, failure

from autograder.checks import current
from autograder.checks.program import Program
from autograder.checks.running_launch import RunningLaunch
from autograder.core.results import Status
from autograder.report.audience import check_for


def test_a_right_node_earns_the_points_under_names_and_values_that_vary(grade: Grade) -> None:
    result = grade(
        """\
        name = vary.name("robot")
        with launch("talker", namespace=f"/{name}", parameters={"word": name}, remappings=[("chatter", "talk")]) as ros:
            ros.node(f"/{name}/talker").expect()
            ros.topic(f"/{name}/talk", String).expect_publisher(node=f"/{name}/talker")
            ros.topic(f"/{name}/chatter").expect_unused()
            ros.qos(f"/{name}/talk").expect(reliability="reliable", durability="volatile", deadline=None)
            ros.topic(f"/{name}/talk", String).expect_messages(at_least=10, rate=20,
                                values=lambda heard: all(m.data.startswith(name) for m in heard))
            ros.node(f"/{name}/talker").expect_parameter("word", name)
            ros.service(f"/{name}/how_many", Trigger).expect()
            ros.require(ros.service(f"/{name}/how_many", Trigger).call(Trigger.Request()).success, "It counts")
            ros.node(f"/{name}/talker").set_parameter("word", "changed")
            ros.topic(f"/{name}/talk", String).expect_messages(where=lambda m: m.data.startswith("changed"))
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert [outcome for outcome in result.outcomes if outcome.status is not Status.PASSED] == []
    assert result.points == 2.0


@pytest.mark.parametrize(
    ("old", "new", "expectation", "code", "because"),
    [
        ('"talker"', '"talkr"', 'ros.node("/talker").expect()', "node-name", "/talkr"),
        ('"chatter"', '"chattr"', 'ros.topic("/chatter", String).expect_publisher()', "topic-name", "/chattr"),
        ("rclpy.spin(Talker())", "node = Talker(); import threading; threading.Event().wait()",
         'ros.topic("/chatter", String).expect_messages(within=6)', "not-spinning", "nothing spins"),
        ("        self.count = 0", "        self.count = nothing", 'ros.node("/talker").expect()', "crashed",
         "self.count = nothing"),
        ("        self.count = 0", "        self.handle = 0", 'ros.node("/talker").expect()', "crashed",
         "another name"),
        ("        self.count = 0", "        self.timers = []", 'ros.node("/talker").expect()', "crashed",
         "needs another name"),
        ("def tick(self):", "def tick(self):\n        self.handle = 0",
         'ros.topic("/chatter", String).expect_messages(within=6)', "callback-exception", "another name"),
        ("def main():", "class NoWord(Exception): pass\n\n\ndef main():\n    raise NoWord(1)",
         'ros.node("/talker").expect()', "crashed", "line 32: NoWord: 1"),
        ("rclpy.spin(Talker())", "node = Talker(); node.destroy_publisher(node.publisher); node.tick()",
         'ros.topic("/chatter", String).expect_messages(within=6)', "used-after-destroy", "InvalidHandle"),
        ("rclpy.spin(Talker())",
         "node = Talker(); node.create_publisher(String, 'other', 1).destroy(); rclpy.spin(node)",
         'ros.topic("/chatter", String).expect_messages(at_least=9, within=6)', "used-after-destroy",
         "stays in the node's list"),
        ("def tick(self):", "def handle(self):\n        pass\n\n    def tick(self):", 'ros.node("/talker").expect()',
         "crashed", "a method of yours is called `handle`"),
        ("def main():", "def main()", 'ros.node("/talker").expect()', "syntax-error", "line"),
        ("        return response", "        return", 'ros.service("/how_many", Trigger).call(Trigger.Request())',
         "service-no-return",
         "did not return the response"),
        ("response.success = True", "raise ValueError('no')",
         'ros.service("/how_many", Trigger).call(Trigger.Request())',
         "service-exception", "ValueError: no"),
        ("self.count += 1", "self.count += 1; self.count == 60 and self.get_logger().info('tick')",
         'ros.topic("/rosout", Log).expect_messages(at_least=3, within=6)', "too-few",
         "the timer of `tick` (line 16, every 0.05 s) fired "),
        ("self.count += 1", "self.count += 1; print('tick', self.count)",
         'ros.node("/talker").expect_log("tick", within=6)', "no-log", "was printed, not logged"),
        ("self.count += 1", "self.count += 1; self.get_logger().info('tick')",
         'ros.node("/talker").expect_log("tick", level="WARN", within=6)', "no-log", "at level INFO, not at WARN"),
        ("self.count += 1", "self.count += 1; self.get_logger().debug('tick')",
         'ros.node("/talker").expect_log("tick", within=2)', "no-log", "logs at level DEBUG"),
        ("self.count += 1", "self.count += 1; rclpy.logging.get_logger('mine').info('tick')",
         'ros.node("/talker").expect_log("tick", within=6)', "no-log", "by a logger called `mine`"),
        ('"chatter", 10', '"chatter", rclpy.qos.qos_profile_sensor_data',
         'ros.topic("/chatter", String).expect_messages(qos=QoSProfile(depth=10), within=6)',
         "qos-reliability", "best effort"),
        ("", "", 'ros.topic("/chatter", Int32).expect_messages(within=6)', "wrong-type", "std_msgs/msg/String"),
        ("", "", 'ros.topic("/chatter", String).expect_messages(rate=5)', "rate", "instead of 5 Hz"),
        ("", "", 'ros.node("/talker").expect_parameter("wrd", 1)', "parameter-undeclared", "; it has period, word."),
        ("", "", 'ros.node("/talker").expect_parameter("period", 1.0)', "parameter-value", "0.05"),
        ('"period", 0.05)', '"period", 0.05)\n        self.declare_parameter("unset", rclpy.Parameter.Type.DOUBLE)',
         'ros.node("/talker").expect_parameter("unset", 1.0)', "parameter-value", "without a default"),
        ("", "", 'ros.publisher("/topic", String).publish(String())', "no-topic", ""),
        ("", "", 'ros.program("talker").expect_exit(within=4)', "still-running", "is still running"),
        ("    rclpy.spin(Talker())",
         "    from rclpy.action import ActionClient\n    from test_msgs.action import Fibonacci\n"
         "    ActionClient(Talker(), Fibonacci, 'far').send_goal(Fibonacci.Goal())",
         'ros.program("talker").expect_exit(within=4)', "still-running", "only if another thread spins"),
    ],
)  # fmt: skip
def test_a_wrong_node_loses_the_points_for_its_own_reason(
    grade: Grade, old: str, new: str, expectation: str, code: str, because: str
) -> None:
    program = TALKER.replace(old, new) if old else TALKER
    assert not old or program != TALKER
    if "ros.publish" in expectation:
        expectation = expectation.replace("String())", "String(), within=6)")
    result = grade(
        f"""\
        with launch("talker") as ros:
            {expectation}
        ros.score(2)
        """,
        talker__py=program,
    )
    outcome = failure(result)
    assert outcome.code == code, outcome
    assert because in f"{outcome.because} {outcome.hint}", outcome


def test_an_int_where_a_float_belongs_is_told(grade: Grade) -> None:
    result = grade(
        """\
        from std_msgs.msg import Float64
        with launch("speed") as ros:
            ros.topic("/speed", Float64).expect_messages(where=lambda m: m.data == 5.0, within=6)
        ros.score(2)
        """,
        speed__py="""\
import rclpy
from std_msgs.msg import Float64
rclpy.init()
node = rclpy.create_node("speed")
publisher = node.create_publisher(Float64, "speed", 10)
node.create_timer(0.1, lambda: publisher.publish(Float64(data=5)))
rclpy.spin(node)
""",
    )
    assert "because an `int` was assigned" in failure(result).because


CAREFUL = TALKER.replace(
    "    rclpy.spin(Talker())\n",
    "    try:\n        rclpy.spin(Talker())\n    except (KeyboardInterrupt, ExternalShutdownException):\n        pass\n"
    "    rclpy.try_shutdown()\n",
).replace("import rclpy\n", "import rclpy\nfrom rclpy.executors import ExternalShutdownException\n", 1)

SIGNALS_NOT_TAKEN = "from rclpy.signals import SignalHandlerOptions as Take; rclpy.init(signal_handler_options=Take.NO)"
THREAD_LEFT = "    import threading, time\n    threading.Thread(target=lambda: time.sleep(60)).start()\n    rclpy.try_"


@pytest.mark.parametrize("by", ["SIGINT", "SIGTERM"])
def test_a_program_that_is_told_to_end_may_end_cleanly(grade: Grade, by: str) -> None:
    result = grade(
        f"""\
        with launch("talker", parameters={{"period": 60.0}}) as ros:
            ros.node("/talker").expect()
            ros.program("talker").expect_clean_end(by={by!r})
        ros.score(2)
        """,
        talker__py=CAREFUL,
    )
    assert result.points == 2, result


@pytest.mark.parametrize(
    ("old", "new", "by", "code", "because"),
    [
        ("KeyboardInterrupt, ", "", "SIGINT", "unclean-end", "KeyboardInterrupt. This happened after Ctrl-C"),
        (", ExternalShutdownException)", ",)", "SIGTERM", "unclean-end", "ExternalShutdownException. This happened"),
        ("try_shutdown()", "shutdown()", "SIGINT", "unclean-end", "already called"),
        ("    rclpy.try_shutdown()", "    raise SystemExit(4)", "SIGTERM", "unclean-end", "with exit status 4."),
        ("        pass", "        import time; time.sleep(60)", "SIGTERM", "signal-ignored", "still running; it is in"),
        ("rclpy.init()", SIGNALS_NOT_TAKEN, "SIGTERM", "unclean-end", "The program did not handle the signal"),
        ("    rclpy.try_", THREAD_LEFT, "SIGTERM", "signal-ignored", "except daemon threads"),
        ('super().__init__("talker")', 'raise ValueError("no")', "SIGINT", "crashed", "ValueError: no"),
    ],
)  # fmt: skip
def test_a_program_that_does_not_end_cleanly_is_told_what_it_did(
    grade: Grade, old: str, new: str, by: str, code: str, because: str
) -> None:
    assert old in CAREFUL
    result = grade(
        f"""\
        with launch("talker", parameters={{"period": 60.0}}) as ros:
            ros.graph.wait(lambda: "/talker" in ros.graph.nodes())
            ros.program("talker").expect_clean_end(by={by!r})
        ros.score(2)
        """,
        talker__py=CAREFUL.replace(old, new),
    )
    outcome = failure(result)
    assert (outcome.code, because in outcome.because + outcome.hint) == (code, True), outcome


@pytest.mark.parametrize(
    ("what", "where", "points"),
    [
        ("initialize wait set", "_wait_for_ready_callbacks", None),
        ("create timer", "_wait_for_ready_callbacks", None),
        ("create timer", "switch_off", 0),
    ],
)
def test_what_rclpy_raises_by_chance_at_a_signal_costs_nothing_and_each_time_an_instructor_decides(
    grade: Grade, what: str, where: str, points: int | None
) -> None:
    fails = f'def {where}():\n    raise RuntimeError("failed to {what}: the given context is not valid, at rcl")'
    result = grade(
        """\
        with launch("talker", parameters={"period": 60.0}) as ros:
            ros.node("/talker").expect()
            ros.program("talker").expect_clean_end(by="SIGTERM")
        ros.score(2)
        """,
        talker__py=fails + "\n\n\n" + CAREFUL.replace("        pass", f"        {where}()"),
    )
    assert result.points == points and bool(result.flags) == (points is None), result


def test_who_catches_no_signal_is_not_saved_by_what_rclpy_raises_by_chance(grade: Grade, tmp_path: Path) -> None:
    # Its first run ends with what rclpy raises once in a while, and its next one with its own mistake.
    raced = f"""\
import pathlib
from rclpy.executors import ExternalShutdownException as Interrupted

ran = pathlib.Path("{tmp_path}/ran")
first = not ran.exists()
ran.touch()


def _wait_for_ready_callbacks():
    raise RuntimeError("failed to initialize wait set: the given context is not valid, at rcl")


"""
    spins = "    rclpy.spin(Talker())\n"
    catches = f"    try:\n    {spins}    except Interrupted:\n        if not first:\n            raise\n"
    assert spins in TALKER
    result = grade(
        """\
        with launch("talker", parameters={"period": 60.0}) as ros:
            ros.node("/talker").expect()
            ros.program("talker").expect_clean_end(by="SIGTERM")
        ros.score(2)
        """,
        talker__py=raced + TALKER.replace(spins, catches + "        _wait_for_ready_callbacks()\n"),
    )
    outcome = failure(result)
    assert (outcome.code, "ExternalShutdownException" in outcome.because) == ("unclean-end", True), outcome


@pytest.mark.parametrize(("shuts_down", "points"), [("try_shutdown()", 2), ("shutdown()", 0)])
def test_ctrl_c_finds_rclpy_shut_down_each_time(grade: Grade, shuts_down: str, points: int) -> None:
    # In the middle of a callback is where Python and rclpy's own thread would be in a race.
    program = CAREFUL.replace("try_shutdown()", shuts_down).replace(
        "def tick(self):", "def tick(self):\n        busy()"
    )
    program = program.replace(
        "class Talker", "def busy():\n    for _ in range(300_000):\n        pass\n\n\nclass Talker"
    )
    for _ in range(3):
        result = grade(
            """\
            with launch("talker") as ros:
                ros.topic("/chatter", String).expect_messages(at_least=2)
                ros.program("talker").expect_clean_end()
            ros.score(2)
            """,
            talker__py=program,
        )
        assert result.points == points, result


def test_a_status_is_asked_of_a_program_that_need_not_spin(grade: Grade) -> None:
    result = grade(
        """\
        with launch("asker") as ros:
            ros.program("asker").expect_exit(status=1)
        ros.score(2)
        """,
        asker__py="import rclpy\nfrom rclpy.node import Node\nrclpy.init()\nNode('asker')\nrclpy.shutdown()\n",
    )
    assert (failure(result).code, failure(result).because) == ("exit-status", "It ended with status 0.")


def test_of_two_runs_of_a_program_the_reason_is_that_of_the_one_that_is_meant(grade: Grade) -> None:
    result = grade(
        """\
        with launch(Program("asker", namespace="/other")) as ros:
            ros.node("/other/asker").expect(within=30)
            ros.start(Program("asker", namespace="/meant"))
            ros.node("/meant/asker").expect(within=30)
            ros.server("/meant/gate", Trigger, lambda request, response: response)
            ros.wait(lambda: ros.server("/meant/gate").requests(), 30)
            ros.program("asker").expect_exit(within=1)
        ros.score(2)
        """,
        asker__py="""\
import time, rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger
rclpy.init()
node = Node("asker")
client = node.create_client(Trigger, "gate")
client.wait_for_service()
future = client.call_async(Trigger.Request())
while not future.done():
    time.sleep(0.1)
""",
    )
    assert failure(result).code == "still-running" and "while not future.done()" in failure(result).because
    assert "Nothing spins the node" in failure(result).hint


def test_what_follows_a_failure_is_listed_as_not_checked_and_hidden_lines_stay_marked(grade: Grade) -> None:
    result = grade(
        """\
        with launch("talker") as ros:
            ros.topic("/chatter", String).expect_messages(where=lambda m: False, within=1)
            ros.service("/how_many", Trigger).expect()
            ### BEGIN HIDDEN TESTS
            ros.require("/secret" not in ros.graph.nodes(), "Nobody is called /secret")
            ### END HIDDEN TESTS
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert [(o.status, o.hidden) for o in result.outcomes] == [
        (Status.FAILED, False),
        (Status.NOT_CHECKED, False),
        (Status.NOT_CHECKED, True),
    ]


@pytest.mark.parametrize("ticks", [0, 3, 12])
def test_how_much_was_seen_of_a_program_that_fails_makes_no_difference(grade: Grade, ticks: int) -> None:
    fails = TALKER.replace("        self.count += 1\n", f"        self.count += 1 / max(0, {ticks} - self.count)\n")
    result = grade(
        """\
        with launch("talker") as ros:
            ros.topic("/chatter", String).expect_publisher()
            ros.topic("/chatter", String).expect_messages(at_least=2)
            ros.topic("/chatter", String).expect_messages(at_least=100)
        ros.score(2)
        """,
        talker__py=fails,
    )
    assert [outcome.status for outcome in result.outcomes] == [Status.FAILED, *[Status.NOT_CHECKED] * 3]
    assert failure(result).title == "`talker` runs until it is stopped"
    assert failure(result).code == "callback-exception" and "ZeroDivisionError" in failure(result).because


def test_a_new_program_has_time_to_fail_before_something_else_is_held_against_it(
    grade: Grade, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("autograder.checks.running_launch.SETTLE", 60.0)  # which the program's end makes shorter
    late = TALKER.replace('"period", 0.05', '"period", 0.5').replace("self.count += 1", "self.count += one")
    result = grade(
        """\
        with launch("talker") as ros:
            ros.node("/talker").expect_parameter("word", "goodbye")
        ros.score(2)
        """,
        talker__py=late,
    )
    assert failure(result).code == "callback-exception" and "one" in failure(result).because


def test_when_an_executor_notices_an_error_makes_no_difference(grade: Grade) -> None:
    # With several threads it looks for errors only at its next event, and here none comes.
    lingers = TALKER.replace("rclpy.spin(Talker())", "rclpy.spin(Talker(), MultiThreadedExecutor(num_threads=2))")
    lingers = lingers.replace("import rclpy\n", "import rclpy\nfrom rclpy.executors import MultiThreadedExecutor\n", 1)
    result = grade(
        """\
        with launch("talker", parameters={"period": 600.0}) as ros:
            ros.node("/talker").expect()
            ros.service("/how_many", Trigger).call(Trigger.Request())
            ros.topic("/chatter", String).expect_messages()
        ros.score(2)
        """,
        talker__py=lingers.replace("response.success = True", "raise ValueError('no')"),
    )
    assert [outcome.status for outcome in result.outcomes] == [Status.FAILED, *[Status.NOT_CHECKED] * 2]
    assert failure(result).code == "service-exception" and "ValueError: no" in failure(result).because


def test_a_program_that_starts_processes_is_told_why_it_may_not(grade: Grade) -> None:
    source = "import subprocess\nsubprocess.run(['true'])\n"
    result = grade(
        'with launch("starter") as ros:\n    ros.node("/starter").expect()\nros.score(2)', starter__py=source
    )
    assert failure(result).code == "refused-call" and "subprocess.run" in failure(result).because


def test_a_missing_program_is_the_students_failure(grade: Grade) -> None:
    result = grade('with launch("talker") as ros:\n    ros.node("/talker").expect()\nros.score(2)')
    assert failure(result).code == "program-missing"


@pytest.mark.parametrize(
    ("program", "observed"),
    [
        (TALKER.replace("talker", "talking"), "/talking"),
        ("import threading; threading.Event().wait()", "no node"),
    ],
)
def test_the_nodes_that_are_there_are_told_where_one_is_missing(grade: Grade, program: str, observed: str) -> None:
    check = 'with launch("talker") as ros:\n    ros.node("/talker").expect(within=5)\nros.score(2)'
    assert failure(grade(check, talker__py=program)).observed == observed


@pytest.mark.parametrize(
    "check",
    [
        'with launch("talker") as ros:\n    ros.node("/talker").expect()\n    1 / 0\nros.score(2)',
        'with launch("talker") as ros:\n    ros.node("/talker").expect()',
        "ros_is_not_defined.score(2)",
        'with launch("talker") as ros:\n    pass\nros.score(2)',
    ],
)
def test_a_check_that_breaks_takes_no_points_and_gives_none(grade: Grade, check: str) -> None:
    result = grade(check, talker__py=TALKER)
    assert result.points is None
    assert result.status is Status.UNKNOWN


USED = "        self.create_timer(0.05, lambda: self.more.publish(String()))\n"
OF_ANOTHER_NODE = '        self.more = rclpy.create_node("more").create_publisher(String, "chatter", 10)\n'
MADE_TWICE = '        self.more = self.create_publisher(String, "chatter", 10)\n'


@pytest.mark.parametrize("more", [MADE_TWICE + USED, OF_ANOTHER_NODE], ids=["used", "of another node"])
def test_a_second_publisher_on_a_counted_topic_is_told(grade: Grade, more: str) -> None:
    twice = TALKER.replace("        self.count = 0\n", "        self.count = 0\n" + more)
    result = grade(
        """\
        with launch("talker") as ros:
            ros.topic("/chatter", String).expect_messages(at_least=3)
        ros.score(2)
        """,
        talker__py=twice,
    )
    assert failure(result).code == "extra-publisher"


def test_a_publisher_that_its_node_makes_once_more_and_never_uses_is_no_mistake(grade: Grade) -> None:
    result = grade(
        """\
        with launch("talker") as ros:
            ros.topic("/chatter", String).expect_messages(at_least=3, publisher="/talker")
        ros.score(2)
        """,
        talker__py=TALKER.replace("        self.count = 0\n", "        self.count = 0\n" + MADE_TWICE),
    )
    assert result.points == 2.0


TWIN = """
import time
class Twin(Node):
    def __init__(self):
        probe = rclpy.create_node("probe")
        names = []
        while not names:
            names = [name for name in probe.get_node_names() if name.startswith("grading_observer")]
            time.sleep(0.01)
        super().__init__(names[0])
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(0.05, lambda: self.publisher.publish(String(data="hello 7")))
"""


def test_the_observers_own_name_hides_nothing(grade: Grade) -> None:
    def twin(spin: str) -> str:
        return TALKER.replace("def main():", TWIN + "\n\ndef main():").replace("    rclpy.spin(Talker())", spin)

    both = twin(
        "    from rclpy.executors import SingleThreadedExecutor\n    executor = SingleThreadedExecutor()\n"
        "    for node in (Talker(), Twin()):\n        executor.add_node(node)\n    executor.spin()"
    )
    check = """\
        with launch("talker") as ros:
            ros.{expectation}
        ros.score(2)
        """
    result = grade(check.format(expectation='topic("/chatter", String).expect_messages(at_least=40)'), talker__py=both)
    assert failure(result).code == "extra-publisher" and "grading_observer" in failure(result).because
    result = grade(
        check.format(expectation='topic("/chatter", String).expect_publisher(node="/talker")'),
        talker__py=twin("    rclpy.spin(Twin())"),
    )
    assert "grading_observer" in failure(result).because, result


COUNTER = """
import time
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci


class Counter(Node):
    def __init__(self):
        super().__init__("counter")
        self.server = ActionServer(
            self,
            Fibonacci,
            "count",
            self.count,
            goal_callback=lambda goal: GoalResponse.ACCEPT if goal.order >= 0 else GoalResponse.REJECT,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def count(self, handle):
        counted = []
        while len(counted) < handle.request.order:
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=counted)
            counted.append(len(counted))
            handle.publish_feedback(Fibonacci.Feedback(sequence=counted))
            time.sleep(0.02)
        handle.succeed()
        return Fibonacci.Result(sequence=counted)


rclpy.init()
executor = MultiThreadedExecutor(num_threads=4)
executor.add_node(Counter())
executor.spin()
"""


ASKS_BESIDE_A_THREAD = """
import threading
import time

import rclpy
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci


class Slow(dict):
    def __contains__(self, key):  # rclpy asks this after sending, before noting: a busy machine may stop there
        time.sleep(0.3)
        return super().__contains__(key)


rclpy.init()
node = rclpy.create_node("asks")
client = ActionClient(node, Fibonacci, "count")
client._pending_goal_requests, client._pending_result_requests = Slow(), Slow()
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
client.wait_for_server()
asked = client.send_goal_async(Fibonacci.Goal(order=2))
while not asked.done():
    time.sleep(0.01)
ended = asked.result().get_result_async()
while not ended.done():
    time.sleep(0.01)
rclpy.shutdown()
"""


def test_an_answer_to_an_action_client_is_not_lost_by_chance(grade: Grade) -> None:
    result = grade(
        """\
        with launch("counter", "asks") as ros:
            ros.program("asks").expect_exit(within=30)
        ros.score(2)
        """,
        counter__py=COUNTER,
        asks__py=ASKS_BESIDE_A_THREAD,
    )
    assert result.points == 2.0, result


LAST_WORD_LATE = COUNTER.replace("import time\n", "import threading\nimport time\n").replace(
    "        handle.succeed()\n",
    """\
        last = Fibonacci.Impl.FeedbackMessage(goal_id=handle.goal_id)
        last.feedback.sequence = [*counted, len(counted)]
        told = self.create_publisher(Fibonacci.Impl.FeedbackMessage, "count/_action/feedback", 10)
        while told.get_subscription_count() == 0:
            time.sleep(0.01)
        threading.Timer(0.3, told.publish, [last]).start()
        handle.succeed()
""",
)


def test_feedback_that_comes_after_the_result_counts(grade: Grade) -> None:
    result = grade(
        """\
        from test_msgs.action import Fibonacci
        with launch("counter") as ros:
            goal = ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=3))
            goal.expect_result()
            goal.expect_feedback(values=lambda told: len(told[-1].sequence) == 4 or "The last one is missing.")
        ros.score(2)
        """,
        counter__py=LAST_WORD_LATE,
    )
    assert result.points == 2.0, result


def test_the_ends_of_two_goals_of_an_action_are_two_expectations(grade: Grade) -> None:
    result = grade(
        """\
        from test_msgs.action import Fibonacci
        with launch("counter") as ros:
            for order in (1, 2):
                ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=order)).expect_result()
        ros.score(2)
        """,
        counter__py=COUNTER,
    )
    titles = [outcome.title for outcome in result.outcomes if "ends as" in outcome.title]
    assert titles == ["The goal of `/count` ends as `succeeded`", "Goal 2 of `/count` ends as `succeeded`"]


def test_an_action_is_followed_from_the_goal_to_its_end(grade: Grade) -> None:
    result = grade(
        """\
        from test_msgs.action import Fibonacci
        with launch("counter") as ros:
            short = ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=30))
            ended = short.wait_for_result(within=10)
            ros._expect_that(ended and short.status == "succeeded", "it succeeds", observed=short.status)
            ros._expect_that(list(short.result.sequence) == list(range(30)), "its result", observed=short.result)
            lengths = [len(feedback.sequence) for feedback in short.feedback]
            ros._expect_that(lengths == list(range(1, 31)), "all feedback, in order", observed=lengths)
            endless = ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=100_000))
            ros._expect_that(endless.wait_for_feedback(3, within=10), "feedback while it runs")
            ros._expect_that(endless.result is None, "no result while it runs")
            ros._expect_that(endless.cancel() and endless.wait_for_result(within=10), "cancelling is agreed to")
            ros._expect_that(endless.status == "canceled", "and done", observed=endless.status)
            ros._expect_that(len(endless.result.sequence) >= 3, "with what was counted", observed=endless.result)
            groups = {run.group for run in ros.runs().of("count")}
            ros._expect_that(groups == {"outside of all groups"}, "rclpy runs it in no group", observed=groups)
            refused = ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=-1))
            ros._expect_that(refused.accepted is False, "a goal below zero is rejected")
            ros._expect_that(not refused.cancel(), "and cannot be cancelled")
        ros.score(2)
        """,
        counter__py=COUNTER,
    )
    assert result.points == 2.0, result
    decided = [one.title.rpartition("the goal ")[2] for one in result.outcomes if "decides" in one.title]
    assert decided == ["`order=30`", "`order=100000`", "`order=-1`"]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('"count"', '"cuont"', "action-name"),
        ("executor.spin()", "__import__('threading').Event().wait()", "not-spinning"),
    ],
)
def test_a_missing_action_and_a_silent_one_are_told_apart(grade: Grade, old: str, new: str, code: str) -> None:
    result = grade(
        """\
        from test_msgs.action import Fibonacci
        with launch("counter") as ros:
            ros.action("/count", Fibonacci).send_goal(Fibonacci.Goal(order=1), within=4)
        ros.score(2)
        """,
        counter__py=COUNTER.replace(old, new),
    )
    assert failure(result).code == code, result


SECOND = '        self.create_publisher(String, "chatter", BEST)\n        self.create_service'
PAIR = TALKER.replace("        self.create_service", SECOND).replace(
    "import rclpy\n", "import rclpy\nfrom rclpy.qos import qos_profile_sensor_data as BEST\n", 1
)


@pytest.mark.parametrize("swapped", [False, True])
def test_the_qos_of_every_endpoint_counts_whichever_was_made_first(grade: Grade, swapped: bool) -> None:
    program = PAIR.replace('"chatter", 10)', '"chatter", "x")').replace('"chatter", BEST)', '"chatter", 10)')
    program = program.replace('"chatter", "x")', '"chatter", BEST)') if swapped else PAIR
    result = grade(
        'with launch("talker") as ros:\n    ros.qos("/chatter").expect(reliability="reliable")\nros.score(2)',
        talker__py=program,
    )
    assert failure(result).code == "qos-reliability"
    assert "best effort" in failure(result).observed and "`/talker`" in failure(result).because


def test_names_keep_their_capitals_and_an_end_that_is_not_there_has_its_nearest_name(grade: Grade) -> None:
    program = TALKER.replace('"chatter"', '"camRaw/Image"')
    result = grade(
        """\
        with launch("talker") as ros:
            ros.topic("/camRaw/Image", String).expect_messages(at_least=1)
            ros.qos("/CamRaw/Image").expect(reliability="reliable", within=4)
        ros.score(2)
        """,
        talker__py=program,
    )
    assert result.outcomes[0].title == "At least 1 message arrives on `/camRaw/Image`"
    assert failure(result).code == "topic-name" and "`/camRaw/Image`" in failure(result).because


OTHERS = {  # the name in the code, the expected one, and what the hint says
    "talker/say": ("/robot/speaker/say", "and a private name, `~/say`, follows it"),
    "halt/now": ("/robot/halt/soon", "it has to be `soon` and is `now`."),
    "stop_now": ("/stop_now", "`/robot` is too much."),
    "/rest/now": ("/robot/rest/now", "Remove the slash"),
    "turn/lleft/now": ("/robot/turn/now", "part by part"),
}


def test_a_name_that_differs_comes_with_what_differs(grade: Grade) -> None:
    ends = "".join(f'        self.create_publisher(String, "{name}", 10)\n' for name in OTHERS)
    lines = [
        f'    with ros.part("{name}"):\n        ros.topic("{wanted}", String).expect_publisher(within=1)'
        for name, (wanted, _) in OTHERS.items()
    ]
    there = "ros.graph.publishers('/robot/talker/say') and ros.graph.publishers('/robot/turn/lleft/now')"
    result = grade(
        f'with launch("talker", namespace="/robot", name="speaker") as ros:\n    ros.wait(lambda: {there}, 120)\n'
        + "\n".join(lines)
        + f"\nros.score({dict.fromkeys(OTHERS, 0.4)})",
        talker__py=TALKER.replace("        self.create_service", ends + "        self.create_service", 1),
    )
    hints = {outcome.part: outcome.hint for outcome in result.outcomes if outcome.status is Status.FAILED}
    assert [name for name, (_, hint) in OTHERS.items() if hint not in hints[name]] == []


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('ros.qos("/chatter").expect(reliabilty="reliable")', "no policy called reliabilty"),
        ('ros.qos("/chatter").expect(depth=10)', "no policy called depth"),
        ('ros.qos("/chatter").expect(reliability="relaible")', "'relaible' is neither 'reliable' nor 'best_effort'"),
        ('ros.qos("/chatter").expect(deadline="0.2")', "a number of seconds"),
        ('ros.node("/talker").expect(wihtin=3)', "wihtin"),
        ('ros.node("/talker").expect(within=-1)', "within=-1 is no time"),
        ("ros.wait(lambda: True, -1)", "within=-1 is no time"),
        ('ros.topic("/chatter", String).expect_silence(for_seconds=-0.5)', "for_seconds=-0.5 is no time"),
        ("ros.pause(-1)", "-1 is no time"),
        ('ros.topic("/chatter", String).expect_messages(exactly=3, at_most=4)', "exactly"),
        ('ros.topic("/chatter", String).expect_messages(at_least=-1)', "not negative"),
        ('ros.activity("/activity").expect_overlap("tick", itself=True)', "no list"),
        ('ros.activity("/activity").expect_period(["tick"], 0.5, runs=2)', "begins late"),
        ('ros.node("/talker").expect_log("x", level="WARNING")', "none of DEBUG"),
        ('name = "talker"; ros.node(name).expect()', "no full name"),
        ('ros.program(Program("talker")).expect_running()', "is no full name"),
        ('with launch("talker") as second: pass', "inside another one"),
        ("with ros: pass", "inside another one"),
        ('launch("talker", ros_arguments="-r a:=b")', "ros_arguments='-r a:=b' is one text"),
        ('launch("talker", lifecycle="/talker")', "lifecycle='/talker' is one text"),
        ("ros.require(ros.graph.nodes, 'There is a node')", "call it"),
        ('ros.topic("/chatter", "String").expect_publisher()', "the message class String without quotes"),
        ('ros.topic("/chatter", "std_msgs/msg/String").listen()', "`from std_msgs.msg import String`"),
        ('ros.topic("/chatter", Trigger).listen()', "Trigger is not a message class"),
        ('ros.publisher("/chatter", String(data="x")).open()', "is not a message class"),
        ('ros.service("/add", "Trigger").expect()', "`from PACKAGE.srv import Trigger`"),
        ('ros.service("/add", Trigger.Request).expect()', "Trigger_Request is not a service class"),
        ('ros.server("/gate", "Trigger", print)', "the service class Trigger without quotes"),
        ('ros.action("/dock", "Fibonacci").send_goal(1)', "`from PACKAGE.action import Fibonacci`"),
        ('launch("talker", listen=[("/chatter", "String")])', "listen, \"/chatter\": 'String' is a text"),
    ],
)
def test_what_a_lab_author_gets_wrong_is_refused_with_its_line_and_is_no_students_failure(
    grade: Grade, line: str, said: str
) -> None:
    result = grade(f"with launch() as ros:\n    {line}\nros.score(2)")
    (outcome,) = result.outcomes
    assert result.points is None and outcome.status is Status.UNKNOWN
    assert said in outcome.because and f"line 2: {line}" in outcome.because


def test_a_launch_that_ran_is_refused_a_second_time_and_the_next_one_runs(grade: Grade) -> None:
    again = grade("ros = launch()\nwith ros: pass\nwith ros: pass\nros.score(2)")
    assert "has run already" in again.outcomes[0].because and "line 3" in again.outcomes[0].because
    assert grade(
        'with launch("talker") as ros:\n    ros.node("/talker").expect()\nros.score(2)', talker__py=TALKER
    ).points


def test_what_is_required_holds_if_it_is_true_in_pythons_sense(grade: Grade) -> None:
    result = grade(
        """\
        import re
        import numpy as np
        with launch() as ros:
            ros.require(np.bool_(True), "numpy's truth")
            ros.require(re.match("a", "abc"), "a match")
            ros.require_equal("two lists", [1, 2], [1, 2])
            with ros.part("nothing"):
                ros.require(None, "None")
            with ros.part("zero"):
                ros.require(0, "0")
            with ros.part("equal"):
                ros.require_equal("The order is right", ["b", "a"], ["a", "b"])
        ros.score({"nothing": 0.5, "zero": 0.5, "equal": 1})
        """
    )
    assert [outcome.status for outcome in result.outcomes] == [Status.PASSED] * 3 + [Status.FAILED] * 3
    last = result.outcomes[-1]
    assert (last.expected, last.observed, last.because) == ("a, b", "b, a", "It is b, a, not a, b.")
    assert last.code == "content"


def test_what_is_true_in_another_form_holds_and_none_at_all_means_silence(grade: Grade) -> None:
    result = grade(
        """\
        import re
        import numpy as np
        with launch("talker") as ros:
            ros.topic("/chatter", String).expect_messages(where=lambda m: re.match("hello", m.data),
                                values=lambda heard: np.all([m.data for m in heard]))
            ros.topic("/chatter", String).expect_messages(values=lambda heard: re.match("hello", heard[0].data))
            ros.topic("/nothing", String).expect_messages(at_most=0, for_seconds=0.2)
            ros.topic("/chatter", String).expect_messages(at_most=0, for_seconds=2)
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert [outcome.status for outcome in result.outcomes] == [Status.PASSED] * 3 + [Status.FAILED]
    assert failure(result).code == "too-many"


def test_a_message_that_was_under_way_does_not_break_a_silence_however_late_it_comes(grade: Grade) -> None:
    program = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

rclpy.init()
node = Node("last_words")
out = node.create_publisher(String, "chatter", 10)
hold = node.create_client(Trigger, "hold")
while not (out.get_subscription_count() and hold.service_is_ready()):
    rclpy.spin_once(node, timeout_sec=0.1)


def speak():
    out.publish(String(data="the last one"))
    print("published", flush=True)
    timer.cancel()


hold.call_async(Trigger.Request())
timer = node.create_timer(0.3, speak)
rclpy.spin(node)
"""
    result = grade(
        """\
        import time


        def hold(request, response):
            time.sleep(2.0)  # so long the observer hears nothing
            return response


        with launch("last_words", listen=[("/chatter", String)], serve=[("/hold", Trigger, hold)]) as ros:
            ros.require(ros.wait(lambda: "published" in ros.program("last_words").output()), "It has published")
            ros.topic("/chatter", String).expect_silence(for_seconds=3.0)
            ros.require_equal("It came all the same", ros.topic("/chatter", String).listen().count, 1)
        ros.score(2)
        """,
        last_words__py=program,
    )
    assert result.points == 2.0, result


def test_the_fields_that_a_check_looked_at_stand_first_in_what_was_observed(grade: Grade) -> None:
    program = TALKER.replace("import rclpy\n", "import rclpy\nfrom sensor_msgs.msg import Range\n", 1)
    program = program.replace('String, "chatter"', 'Range, "chatter"')
    program = program.replace("String(data=f\"{self.get_parameter('word').value} {self.count}\")", "Range(range=2.5)")
    result = grade(
        """\
        from sensor_msgs.msg import Range
        with launch("talker") as ros:
            chatter = ros.topic("/chatter", Range)
            chatter.expect_messages()
            chatter.expect_messages(where=lambda m: m.range > 3 and m.header.frame_id == "x", within=2)
        ros.score(2)
        """,
        talker__py=program,
    )
    assert "`header.frame_id='', range=2.5, " in failure(result).because


LAUNCHED = """\
launch:
- arg: {name: "side"%s}
- node: {pkg: "lab", exec: "robot", name: "$(var side)_robot", args: "word"}
"""


def test_a_launch_file_starts_the_course_s_program_in_place_of_a_student_s(grade: Grade) -> None:
    check = """\
        from autograder.checks import launch_file
        course = Program("talker", arguments_of_its_own=("first",))
        with launch_file("a.launch.yaml", {"side": "left"}, package="lab", programs={"robot": course}) as ros:
            ros.node("/left_robot").expect()
            ros.require(ros.programs()[0].arguments()[:2] == ["first", "word"], "Both have their words")
        ros.score(2)
        """
    result = grade(check, talker__py=TALKER, robot__py="raise ValueError(1)\n", a__launch__yaml=LAUNCHED % "")
    assert result.points == 2.0, result


@pytest.mark.parametrize(
    ("default", "points", "code"),
    [
        ("", 2.0, ""),
        (', default: "left"', 0.0, "argument-not-needed"),
        # A path that reads like the refusal of the argument.
        (', default: "x"}\n- include: {file: "the launch argument `side` has no value"', 0.0, "launch-file"),
    ],
)
def test_an_argument_without_a_default_is_needed(grade: Grade, default: str, points: float, code: str) -> None:
    check = """\
        from autograder.checks import launch_file
        with launch_file("a.launch.yaml", package="lab") as ros:
            ros.expect_argument_needed("side")
        ros.score(2)
        """
    result = grade(check, robot__py=TALKER, a__launch__yaml=LAUNCHED % default)
    assert result.points == points
    assert (result.first_failure.code if result.first_failure else "") == code


def test_a_parameter_file_that_is_no_yaml_is_named_with_its_line(grade: Grade) -> None:
    check = """\
        with launch("talker", params_file="p.yaml") as ros:
            ros.node("/talker").expect()
            ros.node("/talker").expect_parameter("word", "hi")
        ros.score(2)
        """
    found = failure(grade(check, talker__py=TALKER, p__yaml="talker:\n  ros__parameters:\n    word: [hi\n"))
    assert found.code == "params-file" and "line 5 of the cell is not YAML" in found.because
    # What rcl reads is not refused for being more than a loader of answers takes.
    found = failure(grade(check, talker__py=TALKER, p__yaml="talker:\n  ros__parameters:\n    word: 2026-13-45\n"))
    assert found.code == "parameter-value" and "2026-13-45" in found.because


def test_a_launch_files_own_value_wins_over_the_file_before_it_and_its_variables_arrive(grade: Grade) -> None:
    check = """\
        from autograder.checks import launch_file
        with launch_file("a.launch.yaml", package="lab") as ros:
            ros.node("/veh/robot").expect_parameter("word", "inline")
            ros.node("/veh/robot").expect_parameter("mode", "fast")
        ros.score(2)
        """
    program = TALKER.replace(
        '"period", 0.05)', '"period", 0.05)\n        self.declare_parameter("mode", os.environ["MODE"])'
    )
    launched = """\
launch:
- set_env: {name: MODE, value: fast}
- push_ros_namespace: {namespace: veh}
- node: {pkg: lab, exec: robot, name: robot, param: [{from: $(dirname)/p.yaml}, {name: word, value: inline}]}
"""
    params = "/veh/robot:\n  ros__parameters: {word: from the file}\n"
    result = grade(check, robot__py=f"import os\n{program}", a__launch__yaml=launched, p__yaml=params)
    assert result.points == 2.0, result
    assert not list(current.check.folder.glob(".launch_params_*"))


def test_a_parameter_file_that_ros2_launch_would_not_find_is_the_reason(grade: Grade) -> None:
    check = """\
        from autograder.checks import launch_file
        with launch_file("a.launch.yaml", package="lab") as ros:
            ros.node("/talker").expect()
            ros.node("/talker").expect_parameter("word", "hi")
        ros.score(2)
        """
    launched = "launch:\n- node: {pkg: lab, exec: robot, param: [{from: p.yaml}]}\n"
    params = "/**:\n  ros__parameters: {word: hi}\n"
    found = failure(grade(check, robot__py=TALKER, a__launch__yaml=launched, p__yaml=params))
    assert found.code == "params-file-missing"
    assert "in the folder that it is called from" in found.because


def test_a_parameter_rule_that_rcl_refuses_is_explained(grade: Grade) -> None:
    check = """\
        with launch("talker", ros_arguments=["-p", "my-word:=hi"]) as ros:
            ros.node("/talker").expect()
        ros.score(2)
        """
    found = failure(grade(check, talker__py=TALKER))
    assert found.code == "name-characters" and "`-` is not allowed in the name" in found.because


LATE = """
import threading
import time
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Late(Node):
    def __init__(self):
        super().__init__("late")
        self.create_timer(2.5, self.once)
        self.made = None

    def once(self):
        if self.made is None:
            self.made = self.create_publisher(String, "chatter", 10)


rclpy.init()
BODY
"""
SLOW_MAIN = """node = Late()
spinning = threading.Thread(target=rclpy.spin, args=(node,))
spinning.start()
time.sleep(2.5)
second = rclpy.create_node("second")
spinning.join()
"""


@pytest.mark.parametrize(
    ("expectation", "code"),
    [
        ('ros.node("/talkr").expect(within=300)', "node-name"),
        ('ros.topic("/chater", String).expect_publisher(within=300)', "topic-name"),
        ('ros.topic("/chatter", String).expect_subscription(within=300)', "wrong-end"),
        ('ros.topic("/chater", String).expect_messages(within=300)', "topic-name"),
        ('ros.publisher("/words", String).publish(String(), within=300)', "no-topic"),
        ('ros.service("/how_mny", Trigger).expect(within=300)', "service-name"),
        ('ros.service("/how_mny", Trigger).call(Trigger.Request(), within=300)', "service-name"),
        ('ros.node("/talkr").expect_parameter("word", "hello", within=300)', "node-name"),
        ('ros.lifecycle("/talkr").expect_state("active", within=300)', "node-name"),
    ],
)
def test_a_decided_verdict_does_not_wait_for_its_deadline(grade: Grade, expectation: str, code: str) -> None:
    deadline = time.monotonic() + 200
    result = grade(f'with launch("talker") as ros:\n    {expectation}\nros.score(2)', talker__py=TALKER)
    assert failure(result).code == code
    assert time.monotonic() < deadline


@pytest.mark.parametrize(
    ("body", "expectation"),
    [
        ("rclpy.spin(Late())", 'ros.topic("/chatter", String).expect_publisher(node="/late")'),
        (SLOW_MAIN, 'ros.node("/second").expect()'),
    ],
)
def test_what_comes_late_is_waited_for(grade: Grade, body: str, expectation: str) -> None:
    check = f'with launch("late") as ros:\n    ros.node("/late").expect()\n    {expectation}\nros.score(2)'
    result = grade(check, late__py=LATE.replace("BODY", body))
    assert result.points == 2, result.first_failure


ECHO = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

rclpy.init()
node = Node("echo")
out = node.create_publisher(String, "heard", 1)
node.create_subscription(String, "say", out.publish, 10)
rclpy.spin(node)
"""

HELD_UP = """
import time

import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class HeldUp(Node):
    def __init__(self):
        super().__init__("held_up")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_subscription(String, "stop", self.stop, 10)
        self.timer = self.create_timer(0.05, self.tick)

    def tick(self):
        self.publisher.publish(String(data="on"))
        time.sleep(0.3)  # as on a busy machine: what was sent meanwhile waits, and the next tick comes first

    def stop(self, message):
        self.timer.cancel()


rclpy.init()
rclpy.spin(HeldUp())
"""


def test_a_program_that_is_held_up_is_silent_from_when_it_has_taken_what_was_sent(grade: Grade) -> None:
    check = """
    with launch("held_up", listen=[("/chatter", String)]) as ros:
        heard = ros.topic("/chatter", String).listen()
        stop = ros.publisher("/stop", String).open()
        ros.wait(lambda: stop.get_subscription_count(), 30)
        ros.node("/held_up").expect()
        before = heard.count
        ros.wait(lambda: heard.count > before, 30)  # it sleeps now
        stop.publish(String())
        ros.topic("/chatter", String).expect_silence()
    ros.score(2)"""
    result = grade(textwrap.dedent(check), held_up__py=HELD_UP)
    assert result.points == 2, result.first_failure


ECHO_OF_TWO = """
import threading

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String


def node(name):
    context = rclpy.Context()
    rclpy.init(context=context)
    made = rclpy.create_node(name, context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(made)
    return made, executor


ear, hears = node("ear")
ear.create_subscription(String, "say", lambda said: out.publish(said), 10)
mouth, speaks = node("mouth")  # a participant of its own: the graph learns of it later than of the subscription
out = mouth.create_publisher(String, "heard", 1)
threading.Thread(target=speaks.spin, daemon=True).start()
hears.spin()
"""


@pytest.mark.parametrize("echo", [ECHO, ECHO_OF_TWO], ids=["one node", "a node of its own that answers"])
def test_what_a_message_sets_off_is_heard_from_the_first_one_on(grade: Grade, echo: str) -> None:
    result = grade(
        """\
        for _ in range(4):
            with launch("echo", listen=[("/heard", String)]) as ros:
                ros.publisher("/say", String).publish(String(data="once"))
                ros.topic("/heard", String).expect_messages(exactly=1, for_seconds=0.05)
        ros.score(2)
        """,
        echo__py=echo,
    )
    assert result.points == 2.0, result


LATECOMER = """
import time

time.sleep(1.5)  # it reads a large map first

import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String


def told(request, response):
    print("asked", flush=True)
    return response


rclpy.init()
no_types = Parameter("start_type_description_service", value=False)
node = Node("latecomer", start_parameter_services=False, parameter_overrides=[no_types])
node.create_service(ListParameters, "~/list_parameters", told)
out = node.create_publisher(String, "late", 1)
node.create_subscription(String, "again", out.publish, 10)
rclpy.spin(node)
"""


def test_a_program_that_comes_up_after_the_first_message_is_asked_before_the_next_one(grade: Grade) -> None:
    result = grade(
        """\
        with launch("echo", "latecomer", listen=[("/late", String)]) as ros:
            ros.publisher("/say", String).publish(String(data="to the other one"))
            ros.publisher("/again", String).publish(String(data="to it"))
            ros.topic("/late", String).expect_messages()
            ros.require("asked" in ros.log("latecomer"), "It was asked whether it knows who listens", code="content")
        ros.score(2)
        """,
        echo__py=ECHO,
        latecomer__py=LATECOMER,
    )
    assert result.points == 2.0, result


def test_one_run_of_a_program_is_killed_and_started_again_with_the_same_words(grade: Grade) -> None:
    result = grade(
        """\
        def talker(side):
            return Program("talker", namespace=f"/{side}", name=side, parameters={"word": side})


        with launch(talker("left"), talker("right")) as ros:
            for side in ("left", "right"):
                ros.topic(f"/{side}/chatter", String).expect_messages(at_least=3)
            ros.program("left").stop(kill=True)
            ros.require(not ros.program("left").running(), "The left one has ended")
            ros.program("right").expect_running()
            before = ros.topic("/left/chatter", String).listen().count
            ros.program("left").restart()
            again = ros.topic("/left/chatter", String).expect_messages(at_least=3, skip=before, publishers=2)
            ros.require_equal("It has its word again", again[-1].data.split()[0], "left")
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert result.points == 2.0, result


WORKS_ON = """
import time

import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("works_on")
out = node.create_publisher(String, "done", 1)


def work(message):
    out.publish(message)
    while rclpy.ok():
        time.sleep(0.01)
    out.publish(message)


node.create_subscription(String, "job", work, 1)
rclpy.spin(node)
"""


def test_a_program_that_the_check_ends_in_its_callback_is_not_blamed_for_it(grade: Grade) -> None:
    result = grade(
        """\
        with launch("works_on", "talker", listen=[("/done", String)]) as ros:
            ros.publisher("/job", String).publish(String(data="a lot"))
            ros.topic("/done", String).expect_messages()
            ros.program("works_on").stop()
            ros.require("context is invalid" in ros.program("works_on").output(), "It failed when it was ended")
            ros.topic("/nothing", String).expect_publisher(within=0.5)
        ros.score(2)
        """,
        works_on__py=WORKS_ON,
        talker__py=TALKER,
    )
    assert failure(result).code == "no-topic", result


def test_what_still_runs_is_not_started_again(grade: Grade) -> None:
    result = grade(
        """\
        with launch("talker") as ros:
            ros.program("talker").restart()
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert result.points is None
    assert "restart: `talker` still runs" in result.outcomes[0].because, result


def test_programs_of_one_launch_in_two_domains_do_not_see_each_other(grade: Grade) -> None:
    result = grade(
        """\
        with launch(Program("talker", name="stranger", environment={"ROS_DOMAIN_ID": "0"}),
                    Program("talker", name="neighbour")) as ros:
            ros.topic("/chatter", String).expect_messages(at_least=10, publisher="/neighbour")
            ros.program("stranger").expect_running()
            ros.require("/stranger" not in ros.graph.nodes(), "Its node is not seen")
        ros.score(2)
        """,
        talker__py=TALKER,
    )
    assert result.points == 2.0, result


ASKER = """
import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("asker")
client = node.create_client(Trigger, "gone")
while not client.wait_for_service(timeout_sec=1.0):
    print("waits", flush=True)
    rclpy.spin_once(node, timeout_sec=0.1)
"""
"""It waits for a service that nobody offers, again and again."""


@pytest.mark.parametrize(("evident", "code"), [("", "waits-for-service"), (", evident=True", "order")])
def test_a_check_that_leaves_a_service_out_on_purpose_gives_its_own_reason(
    grade: Grade, evident: str, code: str
) -> None:
    result = grade(
        f"""\
        with launch("asker") as ros:
            ros.node("/asker").expect()
            ros.wait(lambda: ros.log("asker").count("waits") >= 3, 120)
            ros.require(False, "The layers come in order", because="They did not.", code="order"{evident})
        ros.score(2)
        """,
        asker__py=ASKER,
    )
    assert failure(result).code == code


@pytest.mark.parametrize(("node", "code"), [("/asker", "waits-for-service"), ("/talker", "order")])
def test_what_another_program_waits_for_is_no_reason_for_what_a_node_does(grade: Grade, node: str, code: str) -> None:
    result = grade(
        f"""\
        with launch("asker", "talker") as ros:
            ros.node("/asker").expect()
            ros.node("/talker").expect()
            ros.wait(lambda: ros.log("asker").count("waits") >= 3, 120)
            ros.require(False, "The layers come in order", because="They did not.", code="order", node="{node}")
        ros.score(2)
        """,
        asker__py=ASKER,
        talker__py=TALKER,
    )
    assert failure(result).code == code


def test_students_do_not_see_what_a_program_of_a_hidden_test_printed(grade: Grade) -> None:
    result = grade(
        """\
        with launch("says", "says") as ros:
            ros.program("says").expect_exit(within=60)
            ### BEGIN HIDDEN TESTS
            ros.start(Program("says", arguments_of_its_own=["secret"]))
            ### END HIDDEN TESTS
            ros.wait(lambda: "secret" in ros.log("says"), 60)
        ### BEGIN HIDDEN TESTS
        with launch(Program("says", arguments_of_its_own=["secret"])) as ros:
            ros.program("says").expect_exit(within=60, status=3)
        ### END HIDDEN TESTS
        ros.score(2)
        """,
        says__py="import sys\nprint('the word is', *sys.argv[1:], flush=True)\n",
    )
    assert [("secret" in log.text, log.hidden) for log in result.logs] == [(False, False), (False, False)] + 2 * [
        (True, True)
    ]
    assert len(check_for(result, "student").logs) == 2 and len(check_for(result, "instructor").logs) == 4


HOLDER = """
import rclpy

rclpy.init()
node = rclpy.create_node("holder", automatically_declare_parameters_from_overrides=True)
rclpy.spin(node)
"""


def test_a_parameter_reaches_the_program_as_what_it_is(grade: Grade) -> None:
    given = {"text": "1e5", "yes": "y", "lines": 'two\n"lines" \\ 🤖', "texts": ["on", "7"], "whole": 40, "real": 40.0,
             "tiny": 1e-7, "huge": 1e22, "flag": True, "reals": [1.0, 2.5]}  # fmt: skip
    result = grade(
        f"""\
        given = {given!r}
        with launch("holder", parameters=given) as ros:
            ros.node("/holder").expect()
            held = {{name: list(v) if isinstance(given[name], list) else v
                    for name, v in ros.node("/holder").parameters(list(given)).items()}}
            ros.require_equal("What it holds", repr(held), repr(given))
        ros.score(2)
        """,
        holder__py=HOLDER,
    )
    assert result.points == 2.0, result.outcomes


LATE_FIRST = """
import time
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("worker")
activity = node.create_publisher(String, "activity", 10)
while not activity.get_subscription_count():
    time.sleep(0.01)
due = time.monotonic()
time.sleep(0.32)  # the first call is late, and the later ones keep the beat of the timer
while True:
    activity.publish(String(data="tick begin"))
    activity.publish(String(data="tick end"))
    due += 0.8
    time.sleep(max(0.0, due - time.monotonic()))
"""


def test_a_first_call_that_is_late_makes_no_other_period_right(grade: Grade) -> None:
    result = grade(
        """\
        with launch("worker", listen=[("/activity", String)]) as ros:
            ros.activity("/activity").expect_period(["tick"], 0.5, runs=3, within=8)
        ros.score(2)
        """,
        worker__py=LATE_FIRST,
    )
    assert (result.points, failure(result).code) == (0, "period")


CAMERA = """
import rclpy
from rclpy.lifecycle import LifecycleNode

rclpy.init()
rclpy.spin(LifecycleNode("camera"))
"""


def test_a_node_that_goes_on_after_the_expected_transitions_fails(grade: Grade) -> None:
    result = grade(
        """\
        up = [("unconfigured", "configuring"), ("configuring", "inactive")]
        on = [("inactive", "activating"), ("activating", "active")]
        with launch("camera", lifecycle=["/camera"]) as ros:
            ros.lifecycle("/camera").transition("configure")
            ros.lifecycle("/camera").transition("activate")
            ros.lifecycle("/camera").expect_transitions(up + on)
            ros.lifecycle("/camera").expect_transitions(up)
        ros.score(2)
        """,
        camera__py=CAMERA,
    )
    failed = failure(result)
    assert (failed.code, failed.expected) == ("transitions", "unconfigured to configuring, configuring to inactive")
    assert failed.observed.endswith("configuring to inactive, inactive to activating, activating to active")


def test_a_forgotten_return_of_a_lifecycle_callback_counts_as_success_only_where_a_check_says_so(grade: Grade) -> None:
    forgets = "class Camera(LifecycleNode):\n    def on_configure(self, state):\n        pass\n\n\nrclpy.init()"
    program = CAMERA.replace("rclpy.init()", forgets).replace('LifecycleNode("camera")', 'Camera("camera")')
    cell = """\
        with launch(Program("camera"{assume})) as ros:
            for label in ("configure", "activate"):
                ros.lifecycle("/camera").transition(label)
            ros.lifecycle("/camera").expect_state("active")
        ros.score(2)
        """
    assert grade(cell.format(assume=", assume_success=True"), camera__py=program).points == 2
    assert failure(grade(cell.format(assume=""), camera__py=program)).code == "lifecycle-return"


def test_only_nodes_that_no_running_program_has_made_are_gone() -> None:
    def program(running: bool, *names: str) -> Any:
        events = [{"e": "node", "name": name} for name in names]
        return Program("any"), SimpleNamespace(running=lambda: running, events=lambda: events)

    running = RunningLaunch()
    running.programs = [program(False, "/killed", "/started_again"), program(True, "/other", "/started_again")]
    assert running.gone_nodes() == {"/killed"}
