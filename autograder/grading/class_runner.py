"""Runs a class: takes what is known already, and gives the rest to an executor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab
from autograder.course.settings import read_settings
from autograder.grading import executors
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of, stored, without_running
from autograder.grading.store import ResultStore
from autograder.grading.validation import validated
from autograder.submission.reader import read_submission


def run_class(
    submissions: Mapping[str, Path],
    root: Path,
    lab: Lab,
    settings: Settings,
    on_result: Callable[[SubmissionResult], None],
    on_start: Callable[[str], None] = lambda _: None,
    tried: bool = False,
) -> dict[str, SubmissionResult]:
    """Run a class, several submissions at once, and return the results by student, without their pictures.

    Each result is kept as soon as it is there, so that an interrupted run loses only what was running. A run that fails
    or hangs fails alone.

    Args:
        submissions: notebook by student.
        root: of the course; results go to its `build/results`.
        lab: that they answer.
        settings: how to run them.
        on_result: called in this thread for each result as it arrives.
        on_start: called, in any thread, with each student whose submission begins to run.
        tried: keep what is run apart from the results, for nothing of it is to count yet; a later run takes it from
            there.

    Raises:
        KitError: the course's executor cannot be used.
        KeyboardInterrupt: after every run has been stopped; finished results are kept.
    """
    executor = executors.chosen(settings.executor or read_settings(root).executor, settings.at_once)
    kept, apart = ResultStore(root), ResultStore(root, tried=True)
    store = apart if tried else kept
    results: dict[str, SubmissionResult] = {}
    jobs: dict[str, Job] = {}
    for student, path in submissions.items():
        submission = read_submission(path, lab)
        result = stored(student, submission, lab, settings, kept)
        if result is None:
            result = stored(student, submission, lab, settings, apart)
            if result is not None and not tried:
                kept.save(result)
        if result is None:
            job = job_of(submission, student, lab, settings)
            if submission.readable:
                jobs[student] = job
                continue
            result = without_running(submission, job)
            store.save(result)
        results[student] = result.without_pictures()
        on_result(result)
    with closing(executor.run(list(jobs.values()), on_start)) as ran:
        for result in ran:
            # It may come from another machine: only what belongs to the job is believed.
            believed = validated(result, jobs[result.student].checks)
            store.save(believed)
            results[believed.student] = believed.without_pictures()
            on_result(believed)
    return {student: results[student] for student in submissions}
