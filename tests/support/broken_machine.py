"""A machine on which just one thing is broken: this machine, as a process sees it in a mount namespace of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence

from places import ROOT

from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Cell
from autograder.grading.job import Job
from autograder.sandbox.isolation import preflight
from autograder.sandbox.walls import bubblewrap

_GRADE = """
import sys
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_workers
print(run_in_workers(Job.model_validate_json(sys.stdin.read()), 1).model_dump_json())
"""


def command(line: Sequence[str], options: Sequence[str] = ()) -> list[str]:
    """A command on a machine that differs from this one by options of bubblewrap."""
    return [bubblewrap.bwrap(), "--dev-bind", "/", "/", "--die-with-parent", *options, "--", *line]


def started(job: Job, options: Sequence[str] = (), words: Sequence[str] = ()) -> subprocess.Popen[str]:
    """Begin to grade a job on such a machine.

    Args:
        job: what is graded; it is given on standard input, by whoever calls `result_of`.
        options: of bubblewrap, which make the difference.
        words: put before the command, such as `prlimit` and its options.
    """
    line = [*words, sys.executable, "-c", _GRADE]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command(line, options), cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True,
        stdin=pipe, stdout=pipe, stderr=pipe,
    )  # fmt: skip


def result_of(process: subprocess.Popen[str], job: Job) -> SubmissionResult:
    """Wait until a job is graded, and return what it came to."""
    out, error = process.communicate(job.model_dump_json(), timeout=900)
    assert process.returncode == 0, error
    return SubmissionResult.model_validate_json(out.splitlines()[-1])


def graded(job: Job, options: Sequence[str] = (), words: Sequence[str] = ()) -> SubmissionResult:
    """Grade a job on such a machine."""
    return result_of(started(job, options, words), job)


def job_of(files: Mapping[str, str], checks: Mapping[str, str], isolation: Isolation | None = None) -> Job:
    """A job with one point for each check.

    Args:
        files: of the submission.
        checks: source by grade_id.
        isolation: by default the best that there is here.
    """
    cells = [Cell(grade_id=name, points=1.0, source=source) for name, source in checks.items()]
    best = Isolation.FULL if preflight().full else Isolation.NONE
    return Job(
        student="ann", lab="toy", digest="0", isolation=isolation or best, seed=1, files=dict(files), cells=cells
    )


def lost(result: SubmissionResult) -> dict[str, str]:
    """The checks of a right student's that took points, with their reasons: there must be none."""
    return {
        check.grade_id: json.dumps([outcome.because for outcome in check.outcomes if outcome.because])
        for check in result.checks
        if check.points is not None and check.points < check.max_points
    }
