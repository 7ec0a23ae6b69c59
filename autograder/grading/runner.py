"""Run one submission: read it, run its checks in the sandbox, and return the result.

The instructor's process only reads text. The student's programs run in the sandbox, and the result from there is
checked against the lab before it is trusted.
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


def workers_for_one() -> int:
    """Return how many checks of a single submission run at the same time while somebody waits."""
    return max(3, min(12, round(3 * cpus())))


@dataclass(frozen=True)
class Settings:
    """How submissions are run."""

    isolation: Isolation = Isolation.FULL
    seed: int | None = None
    """Seed of the random values; None if each run gets its own seed."""
    force: bool = False
    """Whether to run a submission again even if nothing has changed."""
    jobs: int = 0
    """How many submissions run at the same time; 0 if the number of CPUs decides."""
    executor: str = ""
    """The executor, in the form of the course's setting `executor`; empty if that setting decides."""
    canaries: bool = True
    """Whether known answers run among a class (`grading.canaries`)."""
    despite_canaries: bool = False
    """Whether results count even if a known answer got other points than it must."""

    @property
    def at_once(self) -> int:
        """How many submissions run at the same time. A run mostly waits for messages, so a core can handle several."""
        return self.jobs or max(1, min(20, round(5 * cpus())))

    @property
    def further(self) -> int:
        """How many further submissions may run while the CPUs have too little to do."""
        return 0 if self.jobs else self.at_once // 2


def stored(
    student: str, submission: Submission, lab: Lab, settings: Settings, store: ResultStore
) -> SubmissionResult | None:
    """Return the stored result of a submission; None if running it again could give a new result."""
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
    """Read one submission, run its checks in the sandbox, and return the result.

    Args:
        path: the submitted notebook.
        student: the student who handed it in.
        lab: the lab to which it belongs.
        settings: how it is run.
        store: the store for the result, which is also used if nothing has changed; None if nothing is stored.
        workers: the number of workers that share the checks and run at the same time.
        follower: is told the result of each check while others still run.

    Raises:
        KitError: this machine cannot isolate programs as the settings require.
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

    A student who handed in nothing gets no points. If something was handed in but cannot be read, a person decides.
    """
    problem = submission.problems[-1].model_copy(update={"title": _A_NOTEBOOK})
    if problem.code == "no-notebook":
        return job.result([all_for_one_reason(cell, problem, points=0.0) for cell in job.checks])
    problem = problem.model_copy(update={"status": Status.UNKNOWN})
    return job.result([all_for_one_reason(cell, problem, points=None) for cell in job.checks])


def not_understood(result: SubmissionResult) -> str:
    """Return a sentence that says why the submission could not be read; empty if it could be read."""
    outcomes = [outcome for check in result.checks for outcome in check.outcomes]
    unread = (one.because for one in outcomes if one.title == _A_NOTEBOOK and one.status is Status.UNKNOWN)
    return next(unread, "")


def job_of(submission: Submission, student: str, lab: Lab, settings: Settings) -> Job:
    """Return the job that a worker needs to run a submission."""
    return Job(
        student=student,
        lab=lab.name,
        digest=submission.digest,
        isolation=settings.isolation,
        seed=random.SystemRandom().getrandbits(32) if settings.seed is None else settings.seed,
        files=submission.files,
        answers={
            answer.file.file_name: lab.is_as_given_out(answer.grade_id, submission.sources[answer.grade_id])
            for answer in lab.answers.values()
            if answer.file is not None
        },
        reference=lab.reference,
        cells=list(lab.cells),
        problems=submission.problems,
    )
