"""Runs one submission: reads it, has its checks run in the sandbox, and says what came of it.

The instructor's process only reads text here. What a student wrote runs in the sandbox, and comes back as a result that
is checked against the lab before anyone believes it.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

from autograder.core.cpu_use import cpus
from autograder.core.results import Isolation, Status, SubmissionResult
from autograder.course.lab import Lab
from autograder.grading.job import Job
from autograder.grading.store import ResultStore
from autograder.grading.supervisor import Follower, run_in_workers
from autograder.grading.trusted_result import all_for_one_reason, lacks_a_result
from autograder.submission.answers import Submission
from autograder.submission.reader import read_submission

WORKERS_FOR_ONE = 3
"""Workers that share the checks of a submission for which somebody waits: two cores carry them."""


@dataclass(frozen=True)
class Settings:
    """How submissions are run."""

    isolation: Isolation = Isolation.FULL
    seed: int | None = None
    """Seed of the values that vary; None draws one for each run."""
    force: bool = False
    """Run again even what did not change."""
    jobs: int = 0
    """How many run at once; 0 lets the machine decide."""
    executor: str = ""
    """Who runs them, as the course's setting of that name; empty: what that says."""
    canaries: bool = True
    """Run known answers among a class (`grading.canaries`)."""
    despite_canaries: bool = False
    """Believe results although a known answer got other points than it must."""

    @property
    def at_once(self) -> int:
        """How many run at once. A run mostly waits for messages, so a core carries several."""
        return self.jobs or max(1, min(20, round(5 * cpus())))


def stored(
    student: str, submission: Submission, lab: Lab, settings: Settings, store: ResultStore
) -> SubmissionResult | None:
    """Return the stored result of a submission if running it again could say nothing new."""
    if settings.force:
        return None
    result = store.fitting(lab, student, submission.digest, settings.isolation, settings.seed)
    return None if result is None or lacks_a_result(result) else result


def run_submission(
    path: Path,
    student: str,
    lab: Lab,
    settings: Settings,
    store: ResultStore | None = None,
    workers: int = 1,
    follower: Follower | None = None,
) -> SubmissionResult:
    """Read one submission, run its checks in the sandbox, and return what came of it.

    Args:
        path: of the submitted notebook.
        student: who handed it in.
        lab: that it answers.
        settings: how to run it.
        store: to keep the result in, and to take it from if nothing changed; None keeps nothing.
        workers: that share its checks and run at once.
        follower: is told what each check came to while others still run.

    Raises:
        KitError: this machine cannot isolate programs as asked.
    """
    submission = read_submission(path, lab)
    known = stored(student, submission, lab, settings, store) if store is not None else None
    if known is not None:
        return known
    job = job_of(submission, student, lab, settings)
    if follower is not None:
        follower.begun(submission.problems)
    result = run_in_workers(job, workers, follower) if submission.readable else without_running(submission, job)
    if store is not None:
        store.save(result)
    return result


_A_NOTEBOOK = "there is a notebook to check"


def without_running(submission: Submission, job: Job) -> SubmissionResult:
    """Return the result of a submission that cannot be read.

    Who handed in nothing has no points. What was handed in and not understood is no failure: a person decides.
    """
    problem = submission.problems[-1].model_copy(update={"title": _A_NOTEBOOK})
    if problem.code == "no-notebook":
        return job.result([all_for_one_reason(cell, problem, points=0.0) for cell in job.checks])
    problem = problem.model_copy(update={"status": Status.UNKNOWN})
    return job.result([all_for_one_reason(cell, problem, points=None) for cell in job.checks])


def not_understood(result: SubmissionResult) -> str:
    """Return why nobody could read what was handed in, as a sentence; empty if it could be read."""
    outcomes = [outcome for check in result.checks for outcome in check.outcomes]
    unread = (one.because for one in outcomes if one.title == _A_NOTEBOOK and one.status is Status.UNKNOWN)
    return next(unread, "")


def job_of(submission: Submission, student: str, lab: Lab, settings: Settings) -> Job:
    """Return what a worker needs to run a submission."""
    return Job(
        student=student,
        lab=lab.name,
        digest=submission.digest,
        isolation=settings.isolation,
        seed=random.SystemRandom().getrandbits(32) if settings.seed is None else settings.seed,
        files=submission.files,
        answers={
            answer.file.file_name: submission.sources[answer.grade_id] == answer.blank
            for answer in lab.answers.values()
            if answer.file is not None
        },
        cells=list(lab.cells),
        problems=submission.problems,
    )
