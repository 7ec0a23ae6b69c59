"""Runs a class: several submissions at once, each alone in its sandbox."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab
from autograder.grading.runner import Settings, job_of, run_submission, stored
from autograder.grading.store import ResultStore
from autograder.grading.supervisor import unknown
from autograder.submission.reader import read_submission


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
    store = ResultStore(root)
    results: dict[str, SubmissionResult] = {}
    waiting: dict[str, Path] = {}
    for student, path in submissions.items():
        known = stored(student, read_submission(path, lab), lab, settings, store)
        if known is None:
            waiting[student] = path
        else:
            results[student] = known
            on_result(known)
    if waiting:
        _run_pool(waiting, lab, settings, store, results, on_result)
    return {student: results[student] for student in submissions}


def _run_pool(
    waiting: dict[str, Path],
    lab: Lab,
    settings: Settings,
    store: ResultStore,
    results: dict[str, SubmissionResult],
    on_result: Callable[[SubmissionResult], None],
) -> None:
    # Threads will do: what takes time and may go wrong happens in the sandboxes, each a process tree of its own that
    # ends with the thread that started it, however this process ends.
    stop = threading.Event()
    pool = ThreadPoolExecutor(min(settings.parallel, len(waiting)), thread_name_prefix="submission")
    try:
        futures = {
            pool.submit(run_submission, path.absolute(), student, lab, settings, store, stop): student
            for student, path in waiting.items()
        }
        open_futures = set(futures)
        while open_futures:
            done, open_futures = wait(open_futures, return_when=FIRST_COMPLETED)
            for future in done:
                student = futures[future]
                results[student] = _result_of(future, student, waiting[student], lab, settings, store)
                on_result(results[student])
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def _result_of(
    future: Future[SubmissionResult], student: str, path: Path, lab: Lab, settings: Settings, store: ResultStore
) -> SubmissionResult:
    try:
        return future.result()
    except KitError:
        raise
    except Exception as error:  # whatever became of that run, the class goes on
        job = job_of(read_submission(path, lab), student, lab, settings)
        result = unknown(job, f"The grading process failed: {type(error).__name__}.", str(error))
        store.save(result)
        return result
