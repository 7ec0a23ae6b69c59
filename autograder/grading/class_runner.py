"""Run a class: take the results that are known already, and give the other submissions to an executor."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from types import MappingProxyType

from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.course.settings import read_settings
from autograder.grading import executors, trusted_result
from autograder.grading.canaries import Canaries
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of, stored, without_running
from autograder.grading.store import ResultStore
from autograder.grading.trusted_result import lacks_a_result, validated
from autograder.submission.answers import Submission
from autograder.submission.reader import read_submission


def run_class(
    submissions: Mapping[str, Path],
    root: Path,
    lab: Lab,
    settings: Settings,
    on_result: Callable[[SubmissionResult], None],
    on_start: Callable[[str], None] = lambda _: None,
    tried: bool = False,
    canaries: Canaries | None = None,
) -> dict[str, SubmissionResult]:
    """Run a class, several submissions at once, and return the results by student, in brief.

    Each result is stored as soon as it is known, so that an interrupted run loses only the submissions that were
    running. If a run fails or hangs, the others are not affected. At the end, checks whose programs were kept from the
    CPUs by other processes are run again.

    Args:
        submissions: the notebooks, by student.
        root: the course's folder. The results are stored in its `build/results`.
        lab: the lab to which the submissions belong.
        settings: how the submissions are run.
        on_result: a function that is called in this thread with each whole result as it arrives.
        on_start: a function that is called in any thread with each student whose submission starts to run.
        tried: whether the results do not count yet. They are then stored separately, and a later run uses them.
        canaries: known answers that run among the class. Until all of them have run, results are stored separately.
            Results beside a canary that flipped are doubtful; a later run uses them only if the settings say so.

    Raises:
        KitError: the course's executor cannot be used.
        KeyboardInterrupt: the run was interrupted. All runs have been stopped, and finished results are kept.
    """
    executor = executors.chosen(settings.executor or read_settings(root).executor, settings)
    stores = _Stores(root, lab, settings, tried, canaries)
    results: dict[str, SubmissionResult] = {}
    jobs: dict[str, Job] = {}
    for student, path in submissions.items():
        told = _without_running(student, path, lab, settings, stores)
        if isinstance(told, Job):
            jobs[student] = told
            continue
        results[student] = told.brief()
        on_result(told)
    mixed = canaries.among(jobs) if canaries is not None and stores.watched(jobs) else list(jobs.values())
    try:
        with closing(run_jobs(executor, mixed, *_of_students(jobs, mixed, stores, on_start))) as ran:
            for result in ran:
                if canaries is not None and result.student not in jobs:
                    canaries.take(result)
                    continue
                stores.save(result)
                results[result.student] = result.brief()
                on_result(result)
    except BaseException:
        if canaries is not None:
            stores.put_away(jobs, canaries)
        raise
    if canaries is not None:
        canaries.compare([results[student] for student in jobs])
        stores.settle(jobs, canaries)
    return {student: results[student] for student in submissions}


def _without_running(student: str, path: Path, lab: Lab, settings: Settings, stores: _Stores) -> SubmissionResult | Job:
    """Return the result of a submission if it is known or can be given without a run; otherwise the job to run."""
    submission = read_submission(path, lab)
    known = stores.known(student, submission)
    if known is not None:
        return known
    job = job_of(submission, student, lab, settings)
    if submission.readable:
        return job
    result = without_running(submission, job)
    stores.told.save(result)
    return result


def _of_students(
    jobs: Mapping[str, Job], mixed: Sequence[Job], stores: _Stores, on_start: Callable[[str], None]
) -> tuple[Callable[[str], None], dict[str, SubmissionResult], Callable[[SubmissionResult], None]]:
    """Return what `run_jobs` tells, knows and keeps of students, while canaries run among them."""

    def started(name: str) -> None:
        if name in jobs:
            on_start(name)

    def keep(result: SubmissionResult) -> None:
        if result.student in jobs:
            stores.first.save(result)

    return started, stores.first_results(mixed), keep


def run_jobs(
    executor: executors.Executor,
    jobs: Sequence[Job],
    started: Callable[[str], None] = lambda _: None,
    first: Mapping[str, SubmissionResult] = MappingProxyType({}),
    keep: Callable[[SubmissionResult], None] = lambda _: None,
) -> Generator[SubmissionResult]:
    """Run jobs, and yield the part of each result that can be trusted, because a result may come from another machine.

    Checks whose programs were kept from the CPUs by other processes are run again after all jobs have run. First,
    several run at once, because most of them were held up by chance and are decided then. The others run alone.

    Args:
        executor: runs the jobs.
        jobs: the jobs.
        started: a function that is called in any thread with the student of each job that starts to run.
        first: by student, first results with checks that must be run again, from an interrupted run.
        keep: a function that is called with each such first result, so that an interrupted run does not lose it.
    """
    by_student = {job.student: job for job in jobs}
    to_run_again = dict(first)
    with closing(executor.run([job for job in jobs if job.student not in to_run_again], started)) as ran:
        for result in ran:
            job = by_student[result.student]
            believed = validated(result, job.checks)
            if not trusted_result.has_open_checks(believed):
                yield believed
                continue
            to_run_again[job.student] = believed
            keep(believed)
    if len(to_run_again) > 1:
        still_open = {}
        again = _to_run_again(by_student, to_run_again, alone=False)
        with closing(executor.run(list(again.values()), started)) as ran:
            for result in ran:
                job = again[result.student]
                believed = trusted_result.settled(job, to_run_again[job.student], validated(result, job.checks))
                if not trusted_result.has_open_checks(believed):
                    yield believed
                else:
                    still_open[job.student] = believed
        to_run_again = still_open
    for student, job in _to_run_again(by_student, to_run_again, alone=True).items():
        with closing(executor.run([job], started)) as ran:
            for result in ran:
                yield trusted_result.settled(job, to_run_again[student], validated(result, job.checks))


def _to_run_again(jobs: Mapping[str, Job], results: Mapping[str, SubmissionResult], *, alone: bool) -> dict[str, Job]:
    """Return the jobs, by student, that run the open checks of these results again."""
    return {
        student: trusted_result.to_run_again(jobs[student], result, alone=alone) for student, result in results.items()
    }


class _Stores:
    """The stores of results that count, of results that do not count yet, and of doubtful results.

    Args:
        root: the course's folder.
        lab: the lab whose results are stored.
        settings: how the submissions are run.
        tried: whether the results of this run do not count yet.
        canaries: the known answers in this run.
    """

    def __init__(self, root: Path, lab: Lab, settings: Settings, tried: bool, canaries: Canaries | None) -> None:
        paths = CoursePaths(root)
        self._counting, self._apart = ResultStore(root), ResultStore(root, paths.tried)
        self._doubtful = ResultStore(root, paths.doubtful)
        self._lab, self._settings, self._tried = lab, settings, tried
        self._waits = tried or canaries is not None
        self._waiting: list[str] = []
        self.told = self._apart if tried else self._counting
        """The store of results that are known without a run."""
        self._run = self._apart if self._waits else self._counting
        self.first = ResultStore(root, paths.to_run_again)
        """The store of first results with checks that must be run again."""

    def known(self, student: str, submission: Submission) -> SubmissionResult | None:
        """Return the stored result of a submission; None if the submission has to be run."""
        lab, settings = self._lab, self._settings
        result = stored(student, submission, lab, settings, self._counting)
        if result is not None:
            return result
        if settings.despite_canaries and stored(student, submission, lab, settings, self._doubtful) is not None:
            self._doubtful.move(lab.name, student, self._apart)
        result = stored(student, submission, lab, settings, self._apart)
        if result is not None and self._waits:
            self._waiting.append(student)
        elif result is not None:
            self._apart.move(lab.name, student, self._counting)
        return result

    def first_results(self, jobs: Sequence[Job]) -> dict[str, SubmissionResult]:
        """Return the first results, by student, if a run was interrupted before it ran their open checks again."""
        lab, settings, found = self._lab, self._settings, {}
        for job in jobs if not settings.force else ():
            result = self.first.fitting(lab, job.student, job.digest, settings.isolation, settings.seed)
            if result is not None and not lacks_a_result(result) and trusted_result.has_open_checks(result):
                found[job.student] = result
        return found

    def save(self, result: SubmissionResult) -> None:
        """Store a result of this run."""
        self._run.save(result)
        self.first.remove(result.lab, result.student)

    def watched(self, jobs: Collection[str]) -> bool:
        """Return whether canaries are needed: submissions run now, or have run in an earlier, interrupted run."""
        return bool(jobs) or (bool(self._waiting) and not self._settings.despite_canaries)

    def settle(self, ran: Collection[str], canaries: Canaries) -> None:
        """Make the results of a run count unless a canary flipped beside them, and put away doubtful results."""
        self.put_away(ran, canaries)
        flipped = self._flipped(canaries)
        for student in (*self._waiting, *ran):
            if not self._tried and not (flipped and student in (*self._waiting, *canaries.doubtful)):
                self._apart.move(self._lab.name, student, self._counting)

    def put_away(self, ran: Collection[str], canaries: Canaries) -> None:
        """Move doubtful results to a store that later runs do not use."""
        for student in (*self._waiting, *ran) if self._flipped(canaries) else ():
            if student in canaries.doubtful:
                self._apart.move(self._lab.name, student, self._doubtful)
                self.first.remove(self._lab.name, student)

    def _flipped(self, canaries: Canaries) -> bool:
        return bool(canaries.flips) and not self._settings.despite_canaries
