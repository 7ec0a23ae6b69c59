"""The words of a `%%file NAME.yaml` cell are read as a shell reads them, or refused with the way to repair them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from autograder.checks import command_line, current
from autograder.core.results import Isolation
from autograder.reasons import Refused


@pytest.fixture
def table(tmp_path: Path) -> Iterator[Path]:
    before = current.check.folder
    current.check.configure(tmp_path, Isolation.NONE, seed=1)
    yield tmp_path / "rules.yaml"
    current.check.configure(before, Isolation.NONE, seed=1)


@pytest.mark.parametrize(
    "text",
    [
        "-r a:=b -p c:=1", "--ros-args -r a:=b -p c:=1", '"-r  a:=b\\n-p c:=1"', ">-\n  -r a:=b\n  -p c:=1",
        "-r a:=b -p c:=1 --", "-r a:=b -- --ros-args -p c:=1", "--ros-args -r a:=b --ros-args -p c:=1 --",
    ],
)  # fmt: skip
def test_a_command_line_is_split_as_a_shell_does(table: Path, text: str) -> None:
    table.write_text(f"front: {text}\n")
    assert command_line("rules.yaml", "front").words() == ["-r", "a:=b", "-p", "c:=1"]
    assert command_line("rules.yaml", "front", then=["-r", "x:=y"]).words()[-2:] == ["-r", "x:=y"]


def test_arguments_about_logs_and_enclaves_are_ros_arguments(table: Path) -> None:
    words = "--log-level warn --disable-stdout-logs -r a:=b --enclave /x --log-config-file a.conf --enable-rosout-logs"
    table.write_text(f"front: {words}\n")
    assert command_line("rules.yaml", "front").words() == words.split()


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("other: x\n", "unanswered"),
        ('front: "?"\n', "unanswered"),
        ("front:\n", "unanswered"),
        ("front: [a, b]\n", "command-line"),
        ("front: a:=b\n", "command-line"),
        ("front: -r\n", "command-line"),
        ("front: -r a:=b c:=d\n", "command-line"),
        ("front: -r a:=b -- c:=d\n", "command-line"),
        ("front: -r -- --ros-args a:=b\n", "command-line"),
        ("front: --ros-args --\n", "unanswered"),
        ("front: --enable-stdout-logs x\n", "command-line"),
        ("front: --log-level\n", "command-line"),
        ("front: -r --disable-rosout-logs\n", "command-line"),
        ('front: "-r \'a"\n', "command-line"),
        ("front: -r a: b\n", "not-yaml"),
        ("- front\n", "unanswered"),
    ],
)
def test_words_that_are_no_ros_arguments_are_refused_with_a_reason(table: Path, text: str, code: str) -> None:
    table.write_text(text)
    with pytest.raises(Refused) as caught:
        command_line("rules.yaml", "front").words()
    assert caught.value.reason.code == code


@pytest.mark.parametrize("words", ["-r a := b", "-r a:= b", "-r a :=b"])
def test_a_space_beside_the_sign_of_a_rule_is_named(table: Path, words: str) -> None:
    table.write_text(f"front: {words}\n")
    with pytest.raises(Refused) as caught:
        command_line("rules.yaml", "front").words()
    assert "no space" in caught.value.reason.hint


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("-r a:=b c:=d", "Every rule has its own `-r`"),
        ("ros2 run demo camera -r a:=b", "Leave out `ros2 run`"),
        ("demo camera --ros-args -r a:=b c:=d", "Leave out `ros2 run`"),
    ],
)
def test_words_that_are_not_expected_are_told_what_to_write_in_their_place(table: Path, words: str, hint: str) -> None:
    table.write_text(f"front: {words}\n")
    with pytest.raises(Refused) as caught:
        command_line("rules.yaml", "front").words()
    assert hint in caught.value.reason.hint


def test_words_without_the_name_of_their_line_are_told_what_is_missing(table: Path) -> None:
    table.write_text("-r a:=b -p c:=1\n")
    with pytest.raises(Refused, match="nothing begins with `front:`") as caught:
        command_line("rules.yaml", "front").words()
    assert "in front of the words" in caught.value.reason.hint


def test_a_missing_table_is_told(table: Path) -> None:
    with pytest.raises(Refused, match=r"%%file rules\.yaml"):
        command_line("rules.yaml", "front").words()
