"""Stage A: runs submissions, many at once, and keeps a result file for each. It needs no nbgrader and no database.

The instructor's process only reads text here. What a student wrote runs in the sandbox, and comes back as a result that
is checked against the lab before anyone believes it.
"""

from __future__ import annotations

import os
import random
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import KitError
from autograder.grading.job import Job
from autograder.grading.supervisor import NO_RESULT, all_checks, run_in_worker, unknown
from autograder.results import SCHEMA_VERSION, Isolation, Outcome, SubmissionResult
from autograder.submission.lab import Lab
from autograder.submission.reader import Submission, read_submission


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

    @property
    def parallel(self) -> int:
        """How many run at once. A run mostly waits for messages, so a core carries several."""
        return self.jobs or min(20, 5 * len(os.sched_getaffinity(0)))


def result_path(root: Path, lab: str, student: str) -> Path:
    """Where the result of a submission is kept."""
    return root / "build" / "results" / lab / f"{student}.json"


def stored_result(
    path: Path, digest: str, isolation: Isolation | None = None, seed: int | None = None
) -> SubmissionResult | None:
    """Return the result at `path` if it is of these very answers and this very kit; otherwise None.

    Args:
        path: of the result's JSON.
        digest: of the submission as it is now.
        isolation: that it must have been run with; None accepts any.
        seed: that it must have been run with; None accepts any.
    """
    try:
        result = SubmissionResult.load(path)
    except (OSError, ValueError):
        return None
    same = result.digest == digest and result.schema_version == SCHEMA_VERSION
    return result if same and isolation in (None, result.isolation) and seed in (None, result.seed) else None


def run_submission(
    path: Path,
    student: str,
    lab: Lab,
    settings: Settings,
    keep_in: Path | None = None,
    stop: threading.Event | None = None,
) -> SubmissionResult:
    """Read one submission, run its checks in the sandbox, and return what came of it.

    Args:
        path: of the submitted notebook.
        student: who handed it in.
        lab: that it answers.
        settings: how to run it.
        keep_in: file to keep the result in, and to take it from if nothing changed; None keeps nothing.
        stop: when it is set, the run is ended.

    Raises:
        KitError: this machine cannot isolate programs as asked.
        Stopped: by `stop`; nothing is kept.
    """
    began = time.monotonic()
    submission = read_submission(path, lab)
    if keep_in is not None and not settings.force:
        stored = stored_result(keep_in, submission.digest, settings.isolation, settings.seed)
        if stored is not None and not _to_be_repeated(stored):
            return stored
    result = _run(submission, student, lab, settings, stop)
    result.seconds["total"] = round(time.monotonic() - began, 3)
    if keep_in is not None:
        result.save(keep_in)
    return result


def _run(
    submission: Submission, student: str, lab: Lab, settings: Settings, stop: threading.Event | None
) -> SubmissionResult:
    job = _job(submission, student, lab, settings)
    if not submission.readable:
        return all_checks(job, _refused(submission.problems), points=0.0)
    return run_in_worker(job, stop)


def _to_be_repeated(result: SubmissionResult) -> bool:
    """Whether a worker died and kept back a result. What was decided, and a check that gets stuck, stands."""
    return any(outcome.code == NO_RESULT for check in result.checks for outcome in check.outcomes)


def _job(submission: Submission, student: str, lab: Lab, settings: Settings) -> Job:
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


def _refused(problems: list[Outcome]) -> Outcome:
    """What every check says of a submission that could not be read."""
    problem = problems[-1]
    return problem.model_copy(update={"title": "there is a notebook to check"})


def run_class(
    submissions: Mapping[str, Path],
    root: Path,
    lab: Lab,
    settings: Settings,
    on_result: Callable[[SubmissionResult], None],
) -> dict[str, SubmissionResult]:
    """Run a class, several submissions at once, and return the results by student.

    Each result is kept as soon as it is there, so that an interrupted run loses only what was running. A run that fails
    or hangs fails alone.

    Args:
        submissions: notebook by student.
        root: of the course; results go to its `build/results`.
        lab: that they answer.
        settings: how to run them.
        on_result: called in this thread for each result as it arrives.

    Raises:
        KeyboardInterrupt: after every run has been stopped; finished results are kept.
    """
    results: dict[str, SubmissionResult] = {}
    waiting: dict[str, Path] = {}
    for student, path in submissions.items():
        stored = None if settings.force else _stored(path, root, lab, student, settings)
        if stored is None:
            waiting[student] = path
        else:
            results[student] = stored
            on_result(stored)
    if waiting:
        _run_pool(waiting, root, lab, settings, results, on_result)
    return {student: results[student] for student in submissions}


def _stored(path: Path, root: Path, lab: Lab, student: str, settings: Settings) -> SubmissionResult | None:
    keep_in = result_path(root, lab.name, student)
    if not keep_in.is_file():
        return None
    stored = stored_result(keep_in, read_submission(path, lab).digest, settings.isolation, settings.seed)
    return None if stored is None or _to_be_repeated(stored) else stored


def _run_pool(
    waiting: dict[str, Path],
    root: Path,
    lab: Lab,
    settings: Settings,
    results: dict[str, SubmissionResult],
    on_result: Callable[[SubmissionResult], None],
) -> None:
    # Threads will do: what takes time and may go wrong happens in the sandboxes, each a process tree of its own that
    # ends with the thread that started it, however this process ends.
    stop = threading.Event()
    pool = ThreadPoolExecutor(min(settings.parallel, len(waiting)), thread_name_prefix="submission")
    try:
        futures = {
            pool.submit(
                run_submission, path.absolute(), student, lab, settings, result_path(root, lab.name, student), stop
            ): student
            for student, path in waiting.items()
        }
        open_futures = set(futures)
        while open_futures:
            done, open_futures = wait(open_futures, return_when=FIRST_COMPLETED)
            for future in done:
                student = futures[future]
                results[student] = _result_of(future, student, waiting[student], root, lab, settings)
                on_result(results[student])
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def _result_of(
    future: Future[SubmissionResult], student: str, path: Path, root: Path, lab: Lab, settings: Settings
) -> SubmissionResult:
    try:
        return future.result()
    except KitError:
        raise
    except Exception as error:  # whatever became of that process, the class goes on
        job = _job(read_submission(path, lab), student, lab, settings)
        result = unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))
        result.save(result_path(root, lab.name, student))
        return result
