"""The two notebooks of a lab of which it is known how many points each check must give them.

They hold the course's own solution but for the changes in `canaries.yaml`, which go to them by turns: for each check
that the file names, one notebook has the right answer, and the other one a wrong answer.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from autograder.core.errors import KitError
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths


class WrongAnswer(BaseModel):
    """One mistake in the solution, and the points that the checks must give in spite of it."""

    model_config = ConfigDict(extra="forbid")

    answer: str
    """grade_id of the answer cell."""
    instead_of: str = Field(min_length=1)
    """A text that stands once in its solution."""
    write: str
    """What stands there in its place."""
    points: dict[str, float] = Field(min_length=1)
    """By grade_id, of every check that the mistake reaches: fewer than it can give."""


@dataclass(frozen=True)
class KnownAnswers:
    """A notebook of which the points are known."""

    sources: dict[str, str]
    """The source of each answer cell, by grade_id."""
    points: dict[str, float | None]
    """What each check must give, by grade_id; None: fewer points than it can give."""


def wrong_answers(root: Path, lab: Lab) -> list[WrongAnswer]:
    """Read `canaries.yaml`; without that file there are none.

    Raises:
        KitError: it cannot be used; says what to repair.
    """
    path = CoursePaths(root).canaries(lab.name)
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        found = TypeAdapter(list[WrongAnswer]).validate_python(told or [])
    except FileNotFoundError:
        return []
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise KitError(f"{path} is no YAML: {error}.", "Repair that line.") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ", ".join(str(part + 1) if isinstance(part, int) else f"`{part}`" for part in first["loc"])
        raise KitError(
            f"{path}, entry {place}: {first['msg']}.", "An entry has `answer`, `instead_of`, `write` and `points`."
        ) from error
    for number, one in enumerate(found, start=1):
        wrong = _mistake(one, lab, {name for other in found[: number - 1] for name in other.points})
        if wrong:
            raise KitError(f"{path}, entry {number}: {wrong}", "Repair that entry.")
    return found


def _mistake(one: WrongAnswer, lab: Lab, earlier: Collection[str]) -> str:
    """Say what is wrong with an entry of the file; empty if nothing is."""
    full = {check.grade_id: check.points or 0.0 for check in lab.checks}
    if one.answer not in lab.answers:
        return f"the lab has no answer `{one.answer}`; it has {', '.join(lab.answers)}."
    times = lab.answers[one.answer].solution.count(one.instead_of)
    if times != 1:
        return f"`instead_of` stands {times} times in the solution of `{one.answer}`, and has to stand there once."
    for name, points in one.points.items():
        if name not in full:
            return f"the lab has no check `{name}`; it has {', '.join(full)}."
        if name in earlier:
            return f"an earlier entry names `{name}`, too; there can be one wrong answer for each check."
        if not 0 <= points < full[name]:
            return f"`{name}` gives {full[name]:g} points at most, and a wrong answer has to get fewer, not {points:g}."
    return ""


def known_answers(root: Path, lab: Lab) -> list[KnownAnswers]:
    """Return the two notebooks of a lab whose points are known; none if the course does not have its solutions.

    Where the course names no wrong answers, they are the solution and the notebook as students receive it.

    Raises:
        KitError: the course's file of wrong answers cannot be used.
    """
    solution = {name: answer.solution for name, answer in lab.answers.items()}
    blank = {name: answer.blank for name, answer in lab.answers.items()}
    full: dict[str, float | None] = {check.grade_id: check.points for check in lab.checks}
    if solution == blank or not full:
        return []
    wrong = wrong_answers(root, lab)
    if not wrong:
        return [KnownAnswers(solution, full), KnownAnswers(blank, dict.fromkeys(full))]
    pair = []
    for entries in (wrong[0::2], wrong[1::2]):
        sources, points = dict(solution), dict(full)
        for one in entries:
            if one.instead_of not in sources[one.answer]:
                raise KitError(
                    f"{CoursePaths(root).canaries(lab.name)}: two entries change the same place in `{one.answer}`.",
                    "Change other places, or put one of them between the two: by turns they go to two notebooks.",
                )
            sources[one.answer] = sources[one.answer].replace(one.instead_of, one.write)
            points |= one.points
        pair.append(KnownAnswers(sources, points))
    return pair
