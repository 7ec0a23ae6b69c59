"""A parameter with another value than the one that was asked for says where its value comes from."""

from __future__ import annotations

import pytest
from graded_cell import TALKER, Grade, failure

OTHER = TALKER.replace('"talker"', '"other"')
FILE = "/talker:\n  ros__parameters:\n    word: bye\n"


@pytest.mark.parametrize(
    ("launched", "more", "because"),
    [
        ('"talker"', "", "Nothing gave it a value, so it has its default: talker.py:11 (`self.declare_parameter("),
        ('"talker", ros_arguments=["-p", "word:=ho"]', "", "It is 'ho'. `-p word:=ho` gave it"),
        ('"talker", params_file="talker.yaml"', "", "It is 'bye'. `talker.yaml` gave it this value."),
        ('"talker"', 'ros.node("/talker").set_parameter("word", "later")', "has set it since the node started"),
    ],
)
def test_the_reason_says_where_the_value_comes_from(grade: Grade, launched: str, more: str, because: str) -> None:
    check = f"""\
        with launch({launched}) as ros:
            {more or "pass"}
            ros.node("/talker").expect_parameter("word", "hi")
        ros.score(2)
        """
    found = failure(grade(check, talker__py=TALKER, talker__yaml=FILE))
    assert found.code == "parameter-value" and because in found.because, found


@pytest.mark.parametrize(
    "given",
    [
        'params_file="other.yaml"',
        'ros_arguments=["-p", "word:=ho"]',
        'ros_arguments=["-p", "word:=ho", "-p", "word:=hey"]',
        'ros_arguments=["-p", "other:word:=ho"]',
        'ros_arguments=["-p", "wrod:=ho"]',
        'ros_arguments=["-r", "word:=ho"]',
    ],
)
def test_what_another_program_was_given_does_not_explain_a_value(grade: Grade, given: str) -> None:
    check = f"""\
        with launch(Program("other", {given}), "talker") as ros:
            ros.node("/talker").expect_parameter("word", "hi")
        ros.score(2)
        """
    file = FILE.replace("talker", "other")
    found = failure(grade(check, talker__py=TALKER, other__py=OTHER, other__yaml=file))
    assert found.code == "parameter-value" and "so it has its default: talker.py:11" in found.because, found
