"""Prepares a talk of five minutes with a student about the student's own run."""

from __future__ import annotations

import random
import shlex
from pathlib import Path

from autograder.authoring.mutation.what_if import WhatIf, what_if
from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.grading.own_runs import run_recorded
from autograder.grading.runner import Settings, job_of
from autograder.own_run.keys import key
from autograder.own_run.questions import chosen
from autograder.report.viva_page import Asked, write_viva_page
from autograder.sandbox.isolation import choose
from autograder.submission.reader import read_submission

QUESTIONS = 4
_CHECKS = 3
"""The number of checks that are run again for a record. More would take longer and add little."""


def write_sheet(root: Path, lab: Lab, result: SubmissionResult) -> Path:
    """Run some checks of a graded submission again, and write a sheet with questions about what happened.

    Args:
        root: the course's folder.
        lab: the lab.
        result: what grading found; its isolation and random values are used again.

    Raises:
        KitError: the submission cannot be read, or no question about its runs was found.
    """
    paths = CoursePaths(root)
    submission = read_submission(paths.submitted_notebook(result.student, lab.name), lab)
    if not submission.readable:
        raise KitError(f"{result.student}: {submission.problems[-1].because}", "There is no run to talk about.")
    job = job_of(submission, result.student, lab, Settings(choose(result.isolation), result.seed))
    draw = random.Random(f"{result.student} {submission.digest}")
    launched = [check for check in result.checks if check.logs]
    best = [check for check in launched if check.points == check.max_points] or launched
    wanted = draw.sample(best, min(_CHECKS, len(best)))
    _, records = run_recorded(job, [check.grade_id for check in wanted]) if wanted else ([], [])
    whole = [check for check in wanted if len(check.parts) > 1 and check.points == check.max_points]
    counterfactual: WhatIf | None = None
    for check in whole[:2]:
        counterfactual = counterfactual or what_if(submission, job, lab, check, draw.random().hex())
    number = QUESTIONS - (counterfactual is not None)
    asked = [
        Asked.about_run(question, record.recorded_by, question.picture(record), key(record, question))
        for record, question in chosen(records, draw.random().hex(), number)
    ]
    if counterfactual is not None:
        asked.append(_as_asked(counterfactual))
    if not asked:
        raise KitError(
            f"{result.student}: no program of {lab.name} ran long enough to ask about it.",
            f"See what happened: autograder explain {shlex.quote(result.student)} --lab {lab.name}",
        )
    return write_viva_page(paths.viva_page(lab.name, result.student), result, asked)


def _as_asked(found: WhatIf) -> Asked:
    text = f"Line {found.line} of `{found.program}` is changed. Which part of the check would fail first?"
    return Asked(
        text, found.check, found.key, found.choices, before=found.before, after=found.after, because=found.because
    )
