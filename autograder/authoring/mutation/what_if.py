"""Asks what would happen to a check if one line of a student's program said something else.

The answer is found by running the changed program several times, and the question is only asked if all runs agree.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass

from autograder.authoring.mutation.mutants import using
from autograder.authoring.mutation.rules import Source, changes
from autograder.core.results import CheckResult, Status
from autograder.course.cells import parse
from autograder.course.lab import Cell, Lab
from autograder.grading.job import Job
from autograder.grading.own_runs import run_recorded
from autograder.submission.answers import Submission

_RULES = (
    "timer period", "callback group", "another group", "without callback_group", "executor", "without num_threads",
    "number", "returned state", "no super", "no lock", "qos policy", "qos profile", "spins once", "order",
)  # fmt: skip
"""The rules whose changes are worth a talk: they are about ROS, and one can reason about their effect."""
_TIMES = 3
"""How often a changed program runs. All runs must agree."""
_TRIES = 3
"""How many changes are tried until one is found about whose effect all runs agree."""
PASSES = "no part fails"
WHOLE = "the launch as a whole"


@dataclass(frozen=True)
class WhatIf:
    """A question about a change of one line, with its answer."""

    program: str
    line: int
    before: str
    after: str
    check: str
    """The title of the check."""
    choices: tuple[str, ...]
    key: str
    because: str
    """What the failed part said in one of the runs."""


@dataclass(frozen=True)
class _Change:
    answer: str
    line: int
    before: str
    after: str
    source: str


def what_if(submission: Submission, job: Job, lab: Lab, passed: CheckResult, seed: str) -> WhatIf | None:
    """Return a question about a change to a submission; None if none was found about which all runs agree.

    Args:
        submission: what the student handed in.
        job: the job that runs it.
        lab: the lab to which it belongs.
        passed: a check of more than one part that the submission has passed.
        seed: decides which changes are tried.
    """
    cell = next(cell for cell in lab.cells if cell.grade_id == passed.grade_id)
    possible = list(_changes(submission, lab, cell))
    draw = random.Random(seed)
    for change in draw.sample(possible, min(_TRIES, len(possible))):
        file = parse(change.source)
        assert file is not None  # the change is in the body, below the line that names the file
        files = job.files | {file.file_name: file.text}
        failures = []
        for number in range(_TIMES):
            again = job.model_copy(update={"files": files, "seed": job.seed + number})
            failures.append(_first_failure(run_recorded(again, [cell.grade_id])[0]))
            if failures[-1] is None or failures[-1][0] != failures[0][0]:  # type: ignore[index]
                break
        else:
            key, because = failures[0] or ("", "")
            return WhatIf(
                program=file.file_name,
                line=change.line,
                before=change.before,
                after=change.after,
                check=passed.title or passed.grade_id,
                choices=(*(part.title for part in passed.parts), WHOLE, PASSES),
                key=key,
                because=because,
            )
    return None


def _first_failure(checks: list[CheckResult]) -> tuple[str, str] | None:
    """Return the part of a check that failed first and why; None if this cannot be said of this run."""
    if not checks or checks[0].status is Status.UNKNOWN or checks[0].starved:
        return None
    failure = checks[0].first_failure
    return (PASSES, "") if failure is None else (failure.part or WHOLE, failure.because)


def _changes(submission: Submission, lab: Lab, cell: Cell) -> Iterator[_Change]:
    """Yield the changes to the lines that the student wrote in the programs that a check uses."""
    for name in sorted(using(lab, cell)):
        answer, source = lab.answers[name], submission.sources.get(name, "")
        if answer.file is None or not answer.file.file_name.endswith(".py"):
            continue
        magic, _, body = source.partition("\n")
        given = {line.strip() for line in answer.blank.split("\n")}
        lines = body.split("\n")
        own = {number for number, line in enumerate(lines, 1) if line.strip() and line.strip() not in given}
        try:
            found = [change for change in changes(body, own) if change.rule in _RULES]
        except (SyntaxError, ValueError, RecursionError, MemoryError):  # such as a sum of a thousand terms
            continue
        for change in found:
            text = Source(body).with_change(change)
            new = text.split("\n")
            differ = [number for number, (a, b) in enumerate(zip(lines, new, strict=False)) if a != b]
            if len(lines) == len(new) and len(differ) == 1:
                at = differ[0]
                yield _Change(name, at + 1, lines[at].strip(), new[at].strip(), f"{magic}\n{text}")
