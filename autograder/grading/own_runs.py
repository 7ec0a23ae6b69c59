"""Run checks of a submission again to record what the student's programs do in them."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from pydantic import ValidationError

from autograder.core.results import CheckResult
from autograder.course.lab import Lab
from autograder.grading.builds import with_interfaces
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of
from autograder.grading.supervisor import limit
from autograder.own_run.record import Record
from autograder.sandbox.grading_sandbox import run_in_sandbox
from autograder.submission.reader import read_submission


def recorded(
    notebook: Path, student: str, lab: Lab, settings: Settings, wanted: Collection[str]
) -> tuple[list[CheckResult], list[Record]]:
    """Run some checks of a submission in the sandbox, and return their results and what each of their launches did.

    Args:
        notebook: the submitted notebook.
        student: the student who handed it in.
        lab: the lab to which it belongs.
        settings: how it is run. With the seed of an earlier result, the same random values are used.
        wanted: the grade_ids of the checks.
    """
    return run_recorded(job_of(read_submission(notebook, lab), student, lab, settings), wanted)


def run_recorded(job: Job, wanted: Collection[str]) -> tuple[list[CheckResult], list[Record]]:
    """Run some checks of a job as `recorded` does."""
    cells = [cell for cell in job.cells if cell.points is None or cell.grade_id in wanted]
    job = with_interfaces(job.model_copy(update={"cells": cells, "records": True}), 1)
    seconds = limit(len(job.checks)) + job.build_seconds
    run = run_in_sandbox(["autograder.grading.worker"], job.model_dump_json().encode("utf-8"), job.isolation, seconds)
    checks, records = [], []
    for line in run.stdout.splitlines():
        try:
            if line.startswith(b'{"recorded_by"'):
                records.append(Record.model_validate_json(line))
            else:
                checks.append(CheckResult.model_validate_json(line))
        except ValidationError:
            break  # if the worker died, its last line may be incomplete
    return checks, records
