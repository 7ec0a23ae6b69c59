"""The line that carries a run and its questions into a notebook, and lines that nobody's kit has written."""

from __future__ import annotations

import base64
import copy
import json
import random
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import pytest
import replay
import sample_class

from autograder.course.lab import load_lab
from autograder.own_run.keys import key
from autograder.own_run.record import Record
from autograder.own_run.sheet import Asked, OwnRun
from autograder.pictures import Endpoint, Run

LABS = (
    "lab1_nodes",
    "lab2_executors",
    "lab3_remapping",
    "lab4_lifecycle",
    "lab5_qos",
    "lab6_actions",
    "lab7_interfaces",
    "lab8_bringup",
)
"""Those with a part about one's own run."""
RUNS = tuple(
    Run(name, begin + offset, begin + offset + 0.2, thread, f"exclusive group {thread}", "/robot", period=0.5)
    for begin in (0.0, 0.5, 1.0, 1.5)
    for thread, (name, offset) in enumerate((("camera", 0.0), ("planner", 0.07), ("motor", 0.15)), 1)
)
RECORD = Record(recorded_by="check", runs=RUNS)


def packed(text: str) -> str:
    """A text as a line has it."""
    return base64.urlsafe_b64encode(zlib.compress(text.encode())).decode()


def test_a_line_carries_the_questions_and_their_answers() -> None:
    own = OwnRun.of([RECORD], 3)
    read = OwnRun.read(own.line())
    assert read == own
    assert list(read.named()) == ["question_1", "question_2", "question_3"]
    for one in read.named().values():
        assert key(one.record, one.question) == key(RECORD, one.question)
        assert one.question.text in repr(own)
    assert f"run: {own.line()}" in repr(own)
    shown = own._repr_html_()
    assert shown.count("<img ") == 3 and own.line() in shown
    assert "<code>" in shown and "`" not in shown


def test_each_run_of_the_cell_asks_other_questions() -> None:
    assert len({OwnRun.of([RECORD], 3).line() for _ in range(10)}) > 1


def test_a_line_that_the_kit_did_not_write_is_refused() -> None:
    own = OwnRun.of([RECORD], 3)
    one = own.asked[0]
    easy = one.question.model_copy(update={"about": {"node": "/robot", "callback": "camera", "begin": 0.123}})
    another = OwnRun(asked=(Asked(record=one.record, question=easy),))
    bomb = packed(" " * 50_000_000)
    for line in ("", "None", "é", own.line()[:-30], own.line()[40:], packed("[]"), another.line(), bomb):
        with pytest.raises(ValueError):
            OwnRun.read(line)


def test_a_program_that_did_nothing_gets_fewer_questions() -> None:
    assert OwnRun.of([Record()], 4).asked == ()


ODD = (0, -1, 1e308, 2**63, 59.999, 1e-320, "", "x" * 3000, "\x1b[31m\u202e", None, [], {}, True, "nan")
"""What a student who writes a line by hand may put in place of anything in it."""


def places(data: Any, above: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Every place in JSON data, as the keys that lead there."""
    for key_ in data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ():
        yield (*above, key_)
        yield from places(data[key_], (*above, key_))


def changed(data: Any, dice: random.Random) -> Any:
    """The data with something left out, doubled, mixed, scaled, or replaced by something odd."""
    *above, last = dice.choice(list(places(data)))
    holder = data
    for step in above:
        holder = holder[step]
    value, how = holder[last], dice.randrange(5)
    if how == 0:
        del holder[last]
    elif how == 1 and isinstance(holder, list):
        holder.insert(0, copy.deepcopy(value))
    elif how == 2 and isinstance(value, list):
        dice.shuffle(value)
    elif how == 3 and isinstance(value, (int, float)):
        holder[last] = value * dice.choice((0, -1, 1.5, 0.01, 100))
    else:
        holder[last] = dice.choice(ODD)
    return data


def test_a_line_that_was_changed_by_hand_is_refused_or_can_be_marked() -> None:
    used = 0
    for seed in range(150):
        dice = random.Random(seed)
        data = json.loads(OwnRun.of([RECORD], 3).model_dump_json())
        for _ in range(dice.choice((1, 1, 2, 4))):
            data = changed(data, dice)
        try:
            own = OwnRun.read(packed(json.dumps(data)))
        except ValueError:
            continue
        used += 1
        assert repr(own) and own._repr_html_()
        for one in own.named().values():
            key(one.record, one.question)
    assert used > 5


def test_an_end_without_policies_is_refused() -> None:
    ends = [asdict(Endpoint("/a", "/t", publishes, {})) for publishes in (True, False)]
    about = {"topic": "/t", "publisher": 1}
    question = {"kind": "matching", "about": about, "text": "", "view": "qos", "subject": "/t"}
    with pytest.raises(ValueError, match="policies"):
        OwnRun.read(packed(json.dumps({"asked": [{"record": {"ends": ends}, "question": question}]})))


@pytest.mark.parametrize("lab_name", LABS)
def test_the_line_of_each_solution_is_a_run_and_its_answers_are_right(lab_name: str) -> None:
    table = load_lab(sample_class.ROOT, lab_name).answers["own_run"].solution
    answers = dict(line.split(": ", 1) for line in table.splitlines() if ": " in line and not line.startswith("#"))
    asked = OwnRun.read(answers["run"]).named()
    assert len(asked) == 4
    for name, one in asked.items():
        right = key(one.record, one.question)
        assert answers[name] == right == replay.answer(one.record, one.question), one.question.text
        assert one.question.picture(one.record).svg.startswith("<svg")
