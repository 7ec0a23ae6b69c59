"""No check breaks over what a program sends: it fails with a reason, or, at the least, a person is told to look.

`odd_cases.py` holds answers that were written to break a check; `odd_data.py` makes every program of a lab send odd
data of many kinds, which takes long and is what `--complete` adds.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import kill_matrix
import odd_data
import pytest
from graded_cell import Grade
from odd_cases import CASES, Case
from places import ROOT
from std_msgs.msg import Int64, String

from autograder.checks import outcomes
from autograder.checks.launch import Launch
from autograder.core.results import CheckResult, Status
from autograder.course.lab import Cell, load_lab
from autograder.grading import worker
from autograder.graph.observer import Observer
from autograder.graph.recording import Received
from autograder.sandbox.isolation import preflight

AT_ONCE = 6
"""Most of the time of a check is spent waiting."""


@pytest.fixture(scope="module")
def graded(request: pytest.FixtureRequest) -> Iterator[dict[str, Future[CheckResult]]]:
    """What becomes of each case."""
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        asked = {item.callspec.params.get("name") for item in request.session.items if hasattr(item, "callspec")}
        yield {name: pool.submit(result_of, case) for name, case in CASES.items() if name in asked}


def result_of(case: Case) -> CheckResult:
    """Grade the lab's solution with the case's changes on its one check."""
    lab = load_lab(ROOT, case.lab)
    solutions = {grade_id: answer.solution for grade_id, answer in lab.answers.items()}
    for old, new in case.changes:
        assert old in solutions[case.answer], old
        solutions[case.answer] = solutions[case.answer].replace(old, new)
    (check,) = odd_data.checked(lab, lab.files_with(solutions), [case.check])
    return check


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.complete) if case.held else name for name, case in CASES.items()]
)
def test_what_was_sent_fails_its_part_with_a_reason(graded: dict[str, Future[CheckResult]], name: str) -> None:
    case, check = CASES[name], graded[name].result()
    assert not odd_data.broken(check), check
    assert check.points is not None and check.points < check.max_points, check
    failure = check.first_failure
    assert failure is not None and case.because in f"{failure.because} {failure.observed}", failure
    if case.part:
        assert case.part in [part.title for part in check.parts if not part.points], check.parts


BREAKS = """
from rclpy.time import Time
from std_msgs.msg import Header
with launch("clock") as ros:
    with ros.part("it is there"):
        ros.node("/clock").expect()
    with ros.part("the stamp"):
        heard = ros.topic("/stamps", Header).expect_messages()
        Time.from_msg(heard[-1].stamp)
        {more}
    with ros.part("it stays"):
        ros.node("/clock").expect()
ros.score({{"it is there": 0.5, "the stamp": 1, "it stays": 0.5}})
"""
CLOCK = """
import rclpy
from std_msgs.msg import Header

rclpy.init()
node = rclpy.create_node("clock")
publisher = node.create_publisher(Header, "stamps", 10)


def tick():
    header = Header()
    header.stamp.sec = SECONDS
    publisher.publish(header)


node.create_timer(0.05, tick)
rclpy.spin(node)
"""


def test_a_check_that_breaks_over_what_no_check_can_use_costs_the_part_and_raises_a_flag(grade: Grade) -> None:
    result = grade(BREAKS.format(more=""), clock__py=CLOCK.replace("SECONDS", "-1"))
    assert {part.title: part.points for part in result.parts} == {"it is there": 0.5, "the stamp": 0, "it stays": 0.5}
    failure = result.first_failure
    assert failure is not None and (failure.code, failure.part) == ("unusable-data", "the stamp")
    assert "A message on `/stamps` holds `stamp.sec` = -1" in failure.because
    assert len(result.flags) == 1 and "ValueError" in result.flags[0]


@pytest.mark.parametrize(
    ("more", "error"), [("[][0]", "IndexError"), ("raise TimeoutError", "TimeoutError"), ("nothing", "NameError")]
)
def test_a_check_that_breaks_over_nothing_that_can_be_named_is_undecided_and_raises_a_flag(
    grade: Grade,
    more: str,
    error: str,
) -> None:
    result = grade(BREAKS.format(more=more), clock__py=CLOCK.replace("SECONDS", "1"))
    assert result.points is None and result.status is Status.UNKNOWN
    assert len(result.flags) == 1 and error in result.flags[0], result.flags


SENDS = """
import rclpy
from MODULE.msg import TYPE

rclpy.init()
node = rclpy.create_node("sender")
publisher = node.create_publisher(TYPE, "sent", 10)
message = TYPE()
MAKE
node.create_timer(0.05, lambda: publisher.publish(message))
rclpy.spin(node)
"""
HEARS = """
from MODULE.msg import TYPE
from std_msgs.msg import Float64
with launch("sender") as ros:
    ros.topic("/own", Float64).listen()
    ros.topic("/sent", TYPE).expect_messages()
    {more}
ros.score(2)
"""


def sent(grade: Grade, kind: str, make: str, more: str) -> CheckResult:
    """What becomes of a check that hears a message, and then breaks."""
    module, _, name = kind.partition("/")
    check, program = (text.replace("MODULE", module).replace("TYPE", name) for text in (HEARS, SENDS))
    return grade(check.format(more=more), sender__py=program.replace("MAKE", make))


@pytest.mark.parametrize(
    ("kind", "make"),
    [
        ("sensor_msgs/Image", "message.data = bytes(640 * 480 * 3)"),
        ("sensor_msgs/LaserScan", "message.ranges = [1.0, float('inf'), float('nan')]"),
        ("sensor_msgs/Range", "message.range = float('-inf')"),
        ("builtin_interfaces/Duration", "message.sec = -1"),
    ],
)
def test_what_is_allowed_in_a_message_is_no_reason_for_a_check_that_breaks(grade: Grade, kind: str, make: str) -> None:
    result = sent(grade, kind, make, "[][0]")
    assert result.points is None and len(result.flags) == 1, result


def test_what_the_check_itself_sends_is_no_reason_for_its_breaking(grade: Grade) -> None:
    subscribes = "node.create_subscription(Float64, 'own', print, 10)"
    more = "ros.publisher('/own', Float64).publish(Float64(data=float('nan')));"
    more += " ros.topic('/own', Float64).expect_messages(); [][0]"
    result = sent(grade, "std_msgs/Float64", subscribes, more)
    assert result.points is None and len(result.flags) == 1, result


@pytest.mark.parametrize("breaks", ["raise MemoryError", "while True: pass"])
def test_a_check_that_takes_too_much_over_long_texts_costs_the_part(
    grade: Grade,
    monkeypatch: pytest.MonkeyPatch,
    breaks: str,
) -> None:
    monkeypatch.setattr(worker, "CELL_CPU_SECONDS", 3.0)
    result = sent(grade, "std_msgs/String", "message.data = 'x' * 1_000_000", breaks)
    failure = result.first_failure
    assert result.points == 0 and failure is not None and failure.code == "unusable-data", result
    assert "a text of 1,000,000 characters; that is far longer than any answer" in failure.because
    assert len(result.flags) == 1


def test_a_check_that_breaks_after_its_launch_raises_a_flag_and_one_that_breaks_before_does_not(grade: Grade) -> None:
    after = grade(
        BREAKS.format(more="").replace("ros.score", "[][0]\nros.score"), clock__py=CLOCK.replace("SECONDS", "1")
    )
    assert after.points is None and len(after.flags) == 1
    before = grade("[][0]\nlaunch('clock').score(2)", clock__py=CLOCK)
    assert before.points is None and not before.flags


def test_a_check_may_take_no_more_of_the_graders_own_cpu_than_its_budget() -> None:
    endless = Cell(grade_id="busy", points=1.0, source="while True: pass")
    error, value = worker._run_cell(endless, 0, {}, 600.0, cpu=0.3)
    assert "CPU" in error and value is None
    assert worker._run_cell(Cell(grade_id="next", points=1.0, source="1 + 1"), 1, {}, 60.0) == ("", 2)


class Counted(float):
    """A stamp that counts how often one is compared."""

    compared = 0

    def __lt__(self, other: float) -> bool:
        Counted.compared += 1
        return float.__lt__(self, other)

    def __gt__(self, other: float) -> bool:
        Counted.compared += 1
        return float.__gt__(self, other)


def test_each_message_is_looked_at_once_and_a_long_text_is_cut_before_it_is_kept(grade: Grade) -> None:
    more = """looked_at = []
    ros.topic("/sent", TYPE).expect_messages(at_least=40, where=lambda m: looked_at.append(m) or True)
    ros.require(len(looked_at) <= ros.topic("/sent", TYPE).listen().count, "Each message is looked at once")
    ros.require(False, "It is long", because="x" * 1_000_000)"""
    result = sent(grade, "std_msgs/String", "", more.replace("TYPE", "String"))
    assert [outcome.title for outcome in result.outcomes if outcome.status is Status.FAILED] == ["It is long"]
    assert len(result.outcomes[-1].because) < 2 * outcomes.TEXT_KEPT


def test_messages_during_runs_are_looked_up_and_not_counted_one_by_one() -> None:
    observer = Observer(91)
    try:
        ros = Launch([], [], [], [])
        ros._running.observer = observer
        ticks, runs = observer.record("/ticks", Int64), observer.record("/activity", String)
        for number in range(4000):
            stamp, word = Counted(0.001 * number), ("begin", "end")[number % 2]
            ticks._messages.append(Received(Int64(), stamp, stamp, number + 1))
            runs._messages.append(Received(String(data=f"slow {word}"), stamp, stamp + 0.0005, number + 1))
        found = ros.activity("/activity").messages_during("slow", ros.topic("/ticks", Int64))
    finally:
        observer.close()
    assert found == [1] * 2000
    assert Counted.compared < 500_000  # each run with each message: eight millions


ODD_ANSWERS = (
    ".nan", "-.inf", "0x" + "f" * 50, "1e400", "[a, [b, {c: d}]]", "{1: 2, .nan: 4, null: 5}", "x" * 3000, "~",
    '"\\x1b[31m\\u202e\\0"', '"\\ud800"', "1:1:1:1", "////", "\"'`.\"", "٣², ½ ①", "[true, 1, 1.0]",
    "[" * 10 + "]" * 10,
)  # fmt: skip
"""What YAML lets a student write behind the colon of a question."""


@pytest.mark.parametrize(
    "lab",
    [pytest.param(lab, marks=pytest.mark.complete) if lab != "lab2_executors" else lab for lab in kill_matrix.labs()],
)
def test_no_check_of_a_table_breaks_over_odd_answers(lab: str) -> None:
    """All tables of a lab at once; each question has another answer."""
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    course_lab = load_lab(ROOT, lab)
    files = course_lab.files_with({name: answer.solution for name, answer in course_lab.answers.items()})
    tables = {cell.grade_id: re.findall(r'answers\("([^"]+)"\)', cell.source) for cell in course_lab.checks}
    checks = [grade_id for grade_id, named in tables.items() if named]
    odd = itertools.cycle(ODD_ANSWERS)
    for name in sorted({name for named in tables.values() for name in named}):
        files[name] = re.sub(r"(?m)^(\w+):.*$", lambda line: f"{line[1]}: {next(odd)}", files[name])
    found = odd_data.checked(course_lab, files, checks) if checks else []
    assert not {check.grade_id: why for check in found if (why := odd_data.broken(check))}
    assert all(check.status is not Status.UNKNOWN and not check.flags for check in found)


@pytest.mark.complete
@pytest.mark.parametrize("kind", odd_data.KINDS)
@pytest.mark.parametrize("lab", kill_matrix.labs())
def test_no_check_of_a_lab_breaks_over_odd_data(lab: str, kind: str) -> None:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    checks = odd_data.graded(load_lab(ROOT, lab), kind)
    assert checks and not {check.grade_id: why for check in checks if (why := odd_data.broken(check))}
    assert all(check.status is not Status.UNKNOWN for check in checks)
