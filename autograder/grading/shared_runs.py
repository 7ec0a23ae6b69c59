"""Finds students of a class who have handed in the same recorded run. A person has to talk to them; no points change.

The line in which a student hands in a recorded run does not say whose run it is. But no two runs have the same times.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.own_run.record import Record
from autograder.own_run.sheet import OwnRun
from autograder.submission.reader import read_submission

_LINE = re.compile(r"^run:[ \t]*(\S+)[ \t]*$", re.MULTILINE)
_FEWEST = 5
"""The number of times that a record must have to be compared; fewer times can be equal by chance."""
_NAMED = 10
"""The number of students who are named in a sentence."""


def shared_runs(root: Path, lab: Lab, students: Collection[str]) -> list[list[str]]:
    """Return groups of students of a class who have handed in a part of the same recorded run.

    Args:
        root: the course's folder, which holds the submitted notebooks.
        lab: the lab that they belong to.
        students: the students of the class.
    """
    if not any("expect_own_run(" in check.source for check in lab.checks):
        return []
    paths = {student: CoursePaths(root).submitted_notebook(student, lab.name) for student in students}
    sources = {student: read_submission(path, lab).sources for student, path in paths.items() if path.is_file()}
    return with_the_same_run({student: answers.values() for student, answers in sources.items()})


def told(group: Sequence[str]) -> str:
    """Return a sentence about students who share a run."""
    most = _NAMED if len(group) > _NAMED else len(group) - 1
    last = f"{len(group) - most} more" if len(group) > _NAMED else group[-1]
    return f"{', '.join(group[:most])} and {last} have handed in the same recorded run."


def with_the_same_run(answers: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """Return groups of students who have handed in a part of the same recorded run.

    Args:
        answers: the text of each student's answers.
    """
    whose: dict[tuple[float, ...], list[str]] = defaultdict(list)
    for student in sorted(answers):
        for times in {times for text in answers[student] for times in _times(text)}:
            whose[times].append(student)
    groups = sorted({tuple(students) for students in whose.values() if len(students) > 1}, key=lambda one: -len(one))
    # Students who share several parts of a run are named once.
    return [list(one) for at, one in enumerate(groups) if not any(set(one) < set(other) for other in groups[:at])]


def _times(text: str) -> set[tuple[float, ...]]:
    """Return the times of each record that an answer carries."""
    found = _LINE.search(text)
    try:
        asked = OwnRun.unpacked(found[1]).asked if found else ()
    except ValueError:  # a check has told the student that this is no line of the kit
        return set()
    times = {_of(one.record) for one in asked}
    return {one for one in times if len(one) >= _FEWEST}


def _of(record: Record) -> tuple[float, ...]:
    sent = (time for rows in record.traffic.values() for row in rows for time in row.times)
    return tuple(sorted([*(run.begin for run in record.runs), *sent, *(change.time for change in record.changes)]))
