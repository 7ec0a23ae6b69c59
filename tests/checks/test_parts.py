"""Points by requirement: a mistake costs its own part, or its line of a table; no visible check claims too much."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from graded_cell import TALKER
from hypothesis import given
from hypothesis import strategies as st

from autograder.checks.answers import allowed, plain, same, seal
from autograder.core.results import CheckResult, Status
from autograder.course.cells import MORE_AT_GRADING, without_hidden_tests

PARTS = """\
with launch("talker") as ros:
    with ros.part("the name"):
        ros.node("/talker").expect(hint="")
    with ros.part("the words"):
        ros.topic("/chatter", String).expect_messages(where=lambda m: m.data.startswith("{word}"), within={within})
        ros.topic("/chatter", String).expect_publisher()
    with ros.part("the service"):
        ros.service("/how_many", Trigger).expect()
ros.score({{"the name": 0.5, "the words": 1, "the service": 0.5}})
"""
Grade = Callable[..., CheckResult]


def earned(result: CheckResult) -> dict[str, float]:
    return {part.title: part.points for part in result.parts}


def test_a_part_that_fails_costs_its_own_points_and_the_next_is_still_looked_at(grade: Grade) -> None:
    result = grade(PARTS.format(word="nonsense", within=1), talker__py=TALKER)
    assert earned(result) == {"the name": 0.5, "the words": 0.0, "the service": 0.5}
    assert (result.points, result.max_points, result.status) == (1.0, 2.0, Status.FAILED)
    assert [(o.part, o.status) for o in result.outcomes] == [
        ("the name", Status.PASSED),
        ("the words", Status.FAILED),
        ("the words", Status.NOT_CHECKED),
        ("the service", Status.PASSED),
    ]


def test_all_parts_give_all_points(grade: Grade) -> None:
    result = grade(PARTS.format(word="", within=30), talker__py=TALKER)
    assert (result.points, result.status) == (2.0, Status.PASSED)


def test_a_program_that_ends_takes_every_part_of_its_launch_and_none_of_another(grade: Grade) -> None:
    check = """\
        with launch("talker") as ros:
            with ros.part("first"):
                ros.node("/talker").expect()
        with launch("broken") as ros:
            with ros.part("second"):
                ros.node("/broken").expect()
            with ros.part("third"):
                ros.node("/broken").expect()
        ros.score({"first": 1, "second": 0.5, "third": 0.5})
        """
    result = grade(check, talker__py=TALKER, broken__py="raise ValueError(1)\n")
    assert earned(result) == {"first": 1.0, "second": 0.0, "third": 0.0}
    assert [(o.part, o.status) for o in result.outcomes][1:] == [
        ("", Status.FAILED),
        ("second", Status.NOT_CHECKED),
        ("third", Status.NOT_CHECKED),
    ]


FRAGILE = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Fragile(Node):
    def __init__(self):
        super().__init__("fragile")
        self.talk = self.create_publisher(String, "talk", 10)
        self.create_timer(0.05, self.tick)
        self.create_subscription(String, "hear", self.hear, 10)
        self.heard = ""

    def tick(self):
        self.talk.publish(String(data="well"))
        {in_the_timer}

    def hear(self, msg):
        self.heard = msg.data
        {at_once}

rclpy.init()
rclpy.spin(Fragile())
"""
ENDS = "if self.heard == 'bad': raise ValueError('bad')"


@pytest.mark.parametrize(
    ("program", "points"),
    [
        (FRAGILE.format(in_the_timer="", at_once=ENDS), {"talks": 1.0, "hears": 0.0, "talks on": 0.0}),
        (FRAGILE.format(in_the_timer=ENDS, at_once=""), {"talks": 0.0, "hears": 0.0, "talks on": 0.0}),
        (FRAGILE.format(in_the_timer="", at_once=""), {"talks": 1.0, "hears": 0.5, "talks on": 0.5}),
    ],
    ids=["in the callback for the message", "in a timer, at a moment of its own", "not at all"],
)
def test_what_was_found_out_before_the_check_sent_what_ended_the_program_stands(
    grade: Grade,
    program: str,
    points: dict[str, float],
) -> None:
    check = """\
        with launch("fragile") as ros:
            with ros.part("talks"):
                ros.topic("/talk", String).expect_messages(at_least=3)
                ros.publisher("/hear", String).publish(String(data="good"))
            with ros.part("hears"):
                ros.publisher("/hear", String).publish(String(data="bad"))
                heard = ros.topic("/talk", String).listen().count
                ros.topic("/talk", String).expect_messages(at_least=heard + 10)
            with ros.part("talks on"):
                ros.topic("/talk", String).expect_messages(at_least=heard + 12)
        ros.score({"talks": 1, "hears": 0.5, "talks on": 0.5})
        """
    result = grade(check, fragile__py=program)
    assert earned(result) == points
    failed = [outcome for outcome in result.outcomes if outcome.status is Status.FAILED]
    assert [outcome.code for outcome in failed] == (["callback-exception"] if result.points != 2 else [])


def test_what_fails_outside_the_parts_takes_those_of_its_launch(grade: Grade) -> None:
    check = """\
        with launch("talker") as ros:
            with ros.part("before"):
                ros.node("/talker").expect()
            ros.require(False, "It holds for all", because="It does not.")
            with ros.part("after"):
                ros.node("/talker").expect()
        ros.score({"before": 1, "after": 1})
        """
    assert earned(grade(check, talker__py=TALKER)) == {"before": 0.0, "after": 0.0}


@pytest.mark.parametrize("mistake", ['{"the name": 2}', '{"the name": 1, "the words": 0.5}', "2"])
def test_a_score_that_does_not_fit_the_parts_decides_nothing(grade: Grade, mistake: str) -> None:
    check = PARTS.format(word="", within=30).rsplit("ros.score", 1)[0] + f"ros.score({mistake})"
    result = grade(check, talker__py=TALKER)
    assert result.points is None
    if mistake != "2":
        assert f"ros.score({mistake})" in result.outcomes[-1].because


def released(check: str) -> str:
    return without_hidden_tests(check)


HIDDEN = """\
with launch("talker") as ros:
    with ros.part("the name"):
        ros.node("/talker").expect()
    with ros.part("the words"):
        ros.topic("/chatter", String).expect_publisher()
        ### BEGIN HIDDEN TESTS
        ros.topic("/chatter", String).expect_messages(at_least=2)
        ### END HIDDEN TESTS
ros.score({"the name": 1, "the words": 1})
"""


def test_a_released_check_claims_only_what_grading_will_give_as_well(grade: Grade) -> None:
    visible = grade(released(HIDDEN), talker__py=TALKER)
    assert visible.more_at_grading and visible.status is Status.PASSED
    assert (visible.sure_points, visible.possible_points) == (1.0, 2.0)
    assert [(part.title, part.more_at_grading) for part in visible.parts] == [("the name", False), ("the words", True)]
    full = grade(HIDDEN, talker__py=TALKER)
    assert (full.points, full.sure_points, full.more_at_grading) == (2.0, 2.0, False)


def test_a_check_without_parts_that_hides_tests_is_sure_of_nothing_but_a_failure(grade: Grade) -> None:
    check = HIDDEN.replace('    with ros.part("the name"):\n', "    if True:\n").replace(
        '    with ros.part("the words"):\n', "    if True:\n"
    )
    check = check.rsplit("ros.score", 1)[0] + "ros.score(2)"
    assert MORE_AT_GRADING in released(check)
    visible = grade(released(check), talker__py=TALKER)
    assert (visible.sure_points, visible.possible_points, visible.more_at_grading) == (0.0, 2.0, True)
    failed = grade(released(check).replace('"/talker"', '"/other"'), talker__py=TALKER)
    assert (failed.sure_points, failed.possible_points, failed.more_at_grading) == (0.0, 0.0, False)


TABLE = f"""\
with answers("table.yaml") as table:
    table.expect_filled({{"reliability": ["best_effort", "reliable"], "late": range(99), "heard": [True, False]}})
    table.expect_answer("reliability", "best_effort")
    table.expect_sealed({{"late": "{seal("late", 5)}", "heard": "{seal("heard", True)}"}})
table.score(2)
"""


@pytest.mark.parametrize(
    "text",
    [
        "reliability: best_effort\nlate: 5\nheard: yes",
        "reliability: Best effort\nlate: '5'\nheard: 'Yes'",
        "reliability: BEST-EFFORT \nlate: 5.0\nheard: true",
        'reliability: "`best effort`"\n" late ": " 5 "\nheard: "TRUE"',
    ],
)
def test_an_answer_counts_however_it_is_spelt(grade: Grade, text: str) -> None:
    result = grade(TABLE, table__yaml=text + "\n")
    assert result.points == 2.0, result.outcomes


@pytest.mark.parametrize(
    ("text", "lost", "code", "because"),
    [
        ("reliability: reliable\nlate: 5\nheard: yes", "reliability", "wrong-answer", "`reliable` is not the right"),
        ("reliability: best_effort\nlate: five\nheard: yes", "late", "answer-form", "a whole number from 0 to 98"),
        ("reliability: best_effort\nlate: 5\nheard: maybe", "heard", "answer-form", "yes or no"),
        ("reliability: best_effort\nlate: 5\nheard: '?'", "heard", "unanswered", "has no answer yet"),
        ("reliability: best_effort\nlate: 5\nherd: yes", "heard", "unanswered", "did you mean `heard`?"),
        ("reliability: best_effort\nlate: 5\nheard: no", "heard", "wrong-answer", "`no` is not the right answer"),
        ("reliability: best_effort\nlate: 5\nheard: 1", "heard", "answer-form", "yes or no"),
        ("reliability: best_effort\nlate: yes\nheard: yes", "late", "answer-form", "a whole number"),
    ],
)
def test_a_wrong_line_costs_its_share_and_a_wrong_form_is_not_called_a_wrong_fact(
    grade: Grade,
    text: str,
    lost: str,
    code: str,
    because: str,
) -> None:
    result = grade(TABLE, table__yaml=text + "\n")
    assert [part.title for part in result.parts if not part.points] == [lost]
    assert result.points == 1.33
    first = result.first_failure
    assert first is not None and first.code == code and because in first.because
    assert sum(o.status is Status.FAILED for o in result.outcomes) == 1


@pytest.mark.parametrize("text", ["overlap\n", "", "# only a comment\n", "{}\n", "- a\n- b\n"])
def test_what_is_no_table_gives_nothing(grade: Grade, text: str) -> None:
    result = grade(TABLE, table__yaml=text)
    assert result.points == 0.0
    assert result.first_failure is not None and result.first_failure.code == "not-yaml"


def test_a_table_that_is_missing_gives_nothing(grade: Grade) -> None:
    result = grade(TABLE)
    assert result.points == 0.0
    assert result.first_failure is not None and result.first_failure.code == "file-missing"


def test_a_list_of_words_has_a_form_too() -> None:
    rows = [["all", "none"], ["none", "all"]]
    assert allowed(["All", "'none'"], rows) and not allowed(["all", "nothing"], rows)


def test_a_name_may_lack_its_slash_but_underscores_and_slashes_count() -> None:
    assert (
        same("rear/image", "/rear/image")
        and same("'/rear/image'", "/rear/image")
        and same("/rear/image/", "/rear/image")
    )
    assert not same("/rear/image", "/rear_image") and not same("none", "/none/x")


NAMES = f"""\
from autograder.checks import NAME_OR_NONE, answers
with answers("table.yaml") as table:
    table.expect_filled({{"images": NAME_OR_NONE, "digit": NAME_OR_NONE}})
    table.expect_sealed({{"images": "{seal("images", "/rear/image")}", "digit": "{seal("digit", "none")}"}})
table.score(2)
"""


@pytest.mark.parametrize(
    ("images", "digit", "code", "because"),
    [
        ("/rear/image", "none", "", ""),
        ("rear/image/", "None", "", ""),
        ("'`/rear/image`'", "'None.'", "", ""),
        ("/front/image", "none", "wrong-answer", "is not the right answer"),
        ("the program ends", "none", "answer-form", "a full name, such as `/front/points` or none"),
        ("/rear/image", "error", "answer-form", "must be a full name, which begins with `/`, or `none`"),
        ("/rear/image", "[none]", "answer-form", "a full name"),
    ],
)
def test_a_name_or_none_is_read_as_it_is_meant(
    grade: Grade,
    images: str,
    digit: str,
    code: str,
    because: str,
) -> None:
    result = grade(NAMES, table__yaml=f"images: {images}\ndigit: {digit}\n")
    first = result.first_failure
    assert result.points == (1.0 if code else 2.0)
    assert (first.code if first else "") == code and because in (first.because if first else "")


@pytest.mark.parametrize(
    ("text", "because"),
    [
        ("- late: 5\n- heard: yes\n", "begin with dashes"),
        ("late:5\nheard:yes\n", "a single value, which begins with `late:5 heard:yes`"),
        ("# late: 5\n", "no answers yet"),
        ("late:\t5\n", "Use spaces instead"),
    ],
)
def test_a_file_that_is_no_table_is_told_what_it_is(grade: Grade, text: str, because: str) -> None:
    failed = grade(TABLE, table__yaml=text).first_failure
    assert failed and because in failed.because and "a space after the colon" in failed.hint


@given(st.recursive(st.text() | st.integers() | st.booleans() | st.floats() | st.none(), st.lists, max_leaves=5))
def test_any_answer_can_be_read_and_compared(answer: Any) -> None:
    assert plain(plain(answer)) == plain(answer) or answer != answer or isinstance(answer, (str, list, float))
    assert isinstance(same(answer, "reliable"), bool) and len(seal("q", str(answer))) == 12


HELPERS = """\
def must(ros, fact):
    ros.require(fact, "It holds", because="It does not.")

with launch("talker") as ros:
    def inner(fact):
        ros.require(fact, "It holds", because="It does not.")
    with ros.part("first"):
        inner({first})
    with ros.part("second"):
        ros.node("/talker").expect()
    must(ros, {second})
    with ros.part("third"):
        ros.node("/talker").expect()
ros.score({{"first": 0.5, "second": 0.5, "third": 1}})
"""


def test_a_helper_of_the_cell_fails_for_the_part_that_called_it(grade: Grade) -> None:
    result = grade(HELPERS.format(first=False, second=True), talker__py=TALKER)
    assert earned(result) == {"first": 0.0, "second": 0.5, "third": 1.0}


def test_a_helper_that_fails_outside_the_parts_takes_all_of_its_launch(grade: Grade) -> None:
    result = grade(HELPERS.format(first=True, second=False), talker__py=TALKER)
    assert earned(result) == {"first": 0.0, "second": 0.0, "third": 0.0}
    assert [o.part for o in result.outcomes if o.status is Status.NOT_CHECKED] == ["third"]


def test_an_expectation_of_the_labs_own_is_told_in_its_own_words_where_it_was_not_checked(grade: Grade) -> None:
    check = """\
        def expect_words(ros):
            '''It says its words, again and again.'''
            ros.topic("/chatter", String).expect_messages(at_least=2)

        with launch("broken") as ros:
            with ros.part("the name"):
                ros.node("/broken").expect()
            with ros.part("the words"):
                expect_words(ros)
        ros.score({"the name": 1, "the words": 1})
        """
    result = grade(check, broken__py="raise ValueError(1)\n")
    left = {outcome.part: outcome.title for outcome in result.outcomes if outcome.status is Status.NOT_CHECKED}
    assert left == {"the name": "node('/broken').expect()", "the words": "It says its words, again and again"}
