"""Every student of every sample class is graded in the sandbox and gets exactly the expected points and reasons.

A check is not run for a student whose files that reach it are all the solution's, or all as students receive them: what
it makes of these is found out with the solution and with the blank notebook. Nor is one run that a student's mistake
reaches without costing points. `--complete` (`make test-all`) runs every check of everybody.
"""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import kill_matrix
import pytest
import sample_class
from places import ROOT

from autograder.authoring.mutation.mutants import using
from autograder.core.results import CheckResult, SubmissionResult
from autograder.course.lab import Cell, Lab, load_lab
from autograder.grading import trusted_result
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of, without_running
from autograder.grading.supervisor import run_in_worker
from autograder.grading.trusted_result import TOO_BUSY
from autograder.submission.answers import Submission
from autograder.submission.reader import read_submission

LABS = kill_matrix.labs()
MEMBERS = [(lab, student) for lab in LABS for student in sample_class.students(lab)]
ALONE = "the solution, with each check's own files alone"
SHARED = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")) > 1
"""Whether other processes of this run grade other labs at the same time; `pytest_collection_modifyitems` lets about two
of them do so."""
SETTINGS = Settings(force=True, jobs=(2 if SHARED else 4) * len(os.sched_getaffinity(0)))
LEAVE_ONLY = """
from autograder.checks import current
for name, text in {files!r}.items():
    (current.check.folder / name).unlink(missing_ok=True)
    if name in {kept!r}:
        (current.check.folder / name).write_text(text, encoding="utf-8")
"""
TRIES_ALONE = 5
Grade = Callable[[threading.Event], SubmissionResult]
_one_alone = threading.Lock()
_read: dict[tuple[str, str], Submission] = {}


def grading(lab: Lab, student: str, complete: bool) -> Grade:
    """Return what grades a student."""
    submission = handed_in(lab, "solution" if student == ALONE else student)
    job = job_of(submission, student, lab, SETTINGS)
    if not submission.readable:
        return lambda _: without_running(submission, job)
    # Who passes with each check's own files alone passes with all of them.
    if student == ALONE or (student == "solution" and not complete):
        job = each_check_alone(lab, job)
    elif not complete:
        job = job.model_copy(update={"cells": cells_to_run(lab, student, job.files)})
    return lambda stop: decided(job, stop)


def decided(job: Job, stop: threading.Event) -> SubmissionResult:
    """What a job comes to, with checks run again whose programs others kept from the CPUs."""
    first = run_in_worker(job, stop)
    if not trusted_result.has_open_checks(first):
        return first
    again = trusted_result.to_run_again(job, first, alone=True)
    for _ in range(TRIES_ALONE):  # other tests run beside it all the same
        with _one_alone:
            second = run_in_worker(again, stop)
        if not any(map(trusted_result.is_open, second.checks)):
            break
    return trusted_result.settled(again, first, second)


def handed_in(lab: Lab, student: str) -> Submission:
    """What a student hands in, read."""
    if (lab.name, student) not in _read:
        with tempfile.TemporaryDirectory() as into:
            folder = sample_class.build_student(lab, student, Path(into))
            path = next(iter(sorted(folder.glob("*.ipynb"))), folder / f"{lab.name}.ipynb")
            _read[lab.name, student] = read_submission(path, lab)
    return _read[lab.name, student]


def cells_to_run(lab: Lab, student: str, files: dict[str, str]) -> list[Cell]:
    """The set-up, and the checks that can say something of this student which no other student's run says."""
    known = twins(lab, files)
    if student in ("solution", "blank") or known is None:
        return list(lab.cells)
    told = sample_class.expected(lab, student)
    names = [check.grade_id for check in lab.checks]
    wanted = [name for name in names if name not in known]
    if student.startswith("x"):  # it is hostile and may harm the check after those that run it
        last = names.index(wanted[-1]) if wanted else -1
        wanted.append(names[(last + 1) % len(names)])
    elif lost := {check.grade_id for check in lab.checks if told.points[check.grade_id] != check.points}:
        wanted = [name for name in wanted if name in lost or name in told.flagged]
    wanted = wanted or names[:1]
    return [cell for cell in lab.cells if cell.points is None or cell.grade_id in wanted]


def twins(lab: Lab, files: dict[str, str]) -> dict[str, str] | None:
    """Checks that find just what they find with the solution, or with the blank notebook; each with which of the two.

    None: there are files that the lab knows nothing of, and which checks these reach, nobody can say.
    """
    if not files.keys() <= handed_in(lab, "solution").files.keys():
        return None
    found = {}
    for check in lab.checks:
        names = {file.file_name for name in using(lab, check) if (file := lab.answers[name].file) is not None}
        for twin in ("blank", "solution"):
            if all(files.get(name) == handed_in(lab, twin).files[name] for name in names):
                found[check.grade_id] = twin
    return found


def each_check_alone(lab: Lab, job: Job) -> Job:
    """The solution's job, with only those answers there at each check that are said to reach it."""
    files = {name: answer.file.file_name for name, answer in lab.answers.items() if answer.file is not None}
    texts = {name: job.files[name] for name in files.values()}
    cells = []
    for cell in lab.cells:
        if cell.points is not None:
            kept = sorted(files[name] for name in using(lab, cell))
            cells.append(Cell(grade_id=f"before_{cell.grade_id}", source=LEAVE_ONLY.format(files=texts, kept=kept)))
        cells.append(cell)
    return job.model_copy(update={"cells": cells})


class Classes:
    """Everybody whose test runs (`-k` may leave most of them out), several at a time as `autograder grade` does.

    Where other processes grade other labs, a lab begins when its first test asks.

    Args:
        pool: runs what is begun.
        wanted: labs and students.
        complete: whether every check of everybody runs.
        stop: ends all runs.
    """

    def __init__(
        self, pool: ThreadPoolExecutor, wanted: list[tuple[str, str]], complete: bool, stop: threading.Event
    ) -> None:
        self._pool, self._wanted, self._complete, self._stop = pool, wanted, complete, stop
        self._futures: dict[tuple[str, str], Future[SubmissionResult]] = {}

    def result(self, lab: str, student: str) -> SubmissionResult:
        """Wait for what a student gets."""
        if (lab, student) not in self._futures:
            self._begin([one for one in self._wanted if one[0] == lab or not SHARED])
        return self._futures[lab, student].result()

    def _begin(self, members: list[tuple[str, str]]) -> None:
        grades = {(name, student): grading(load_lab(ROOT, name), student, self._complete) for name, student in members}
        for (name, student), grade in grades.items():
            same = None if self._complete or student != ALONE else self._futures.get((name, "solution"))
            self._futures[name, student] = same or self._pool.submit(grade, self._stop)


@pytest.fixture(scope="session")
def graded(request: pytest.FixtureRequest) -> Iterator[Classes]:
    """The classes of all labs."""
    chosen = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    wanted = [(p["lab_name"], p["student"]) for p in chosen if {"lab_name", "student"} <= p.keys()]
    stop = threading.Event()
    with ThreadPoolExecutor(SETTINGS.at_once) as pool:
        try:
            yield Classes(pool, wanted, request.config.getoption("complete"), stop)
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def differences(lab: Lab, student: str, result: SubmissionResult) -> list[str]:
    """Where a result is not what was expected, as lines to read."""
    expected = sample_class.expected(lab, student)
    found = []
    without_parts = {check.grade_id for check in result.checks if not (check.parts or was_too_busy(check))}
    found += [f"{name}: it has no parts" for name in expected.lost.keys() & without_parts]
    if sorted(problem.code for problem in result.problems) != expected.problems:
        found.append(f"problems {[p.code for p in result.problems]}, expected {expected.problems}")
    if sorted(check.grade_id for check in result.checks if check.flags) != expected.flagged:
        found.append(f"flags {result.flags}, expected some for {expected.flagged}")
    run = {check.grade_id for check in result.checks}
    known = twins(lab, handed_in(lab, student).files) or {}
    for name in expected.points.keys() - run:
        if expected.points[name] != sample_class.expected(lab, known.get(name, "solution")).points[name]:
            found.append(f"{name}: no changed answer reaches it, and still it is expected to lose points")
    for check in result.checks:
        if was_too_busy(check):
            continue
        name, first = check.grade_id, check.first_failure
        told = f"{first.code}: {first.title}: {first.because}" if first else "passed"
        if check.points != expected.points[name]:
            found.append(f"{name}: {check.points} points, expected {expected.points[name]} ({told})")
        elif name in expected.lost and lost_parts(check) != expected.lost[name]:
            found.append(f"{name}: lost {lost_parts(check)}, expected {expected.lost[name]} ({told})")
        elif first and first.code != expected.codes.get(name, first.code):
            found.append(f"{name}: expected the reason {expected.codes[name]} ({told})")
        elif first and expected.because.get(name, "") not in first.because:
            found.append(f"{name}: expected a reason with {expected.because[name]!r} ({told})")
    return found


def was_too_busy(check: CheckResult) -> bool:
    """Whether this machine had too little time for a check, which then says nothing."""
    return any(outcome.code == TOO_BUSY.code for outcome in check.outcomes)


def skip_if_too_busy(result: SubmissionResult) -> None:
    """Say which checks of a result say nothing."""
    if busy := [check.grade_id for check in result.checks if was_too_busy(check)]:
        pytest.skip(f"this machine was too busy for {', '.join(busy)}; all others are as expected")


def lost_parts(check: CheckResult) -> list[str]:
    """Titles of the parts that did not give all their points, sorted."""
    return sorted(part.title for part in check.parts if part.points < part.max_points)


@pytest.mark.parametrize(("lab_name", "student"), MEMBERS)
def test_a_student_gets_exactly_the_expected_points_and_reasons(lab_name: str, student: str, graded: Classes) -> None:
    result = graded.result(lab_name, student)
    assert differences(load_lab(ROOT, lab_name), student, result) == []
    skip_if_too_busy(result)


@pytest.mark.parametrize(("lab_name", "student"), [(lab, ALONE) for lab in LABS])
def test_no_other_answer_reaches_a_check(lab_name: str, student: str, graded: Classes) -> None:
    result = graded.result(lab_name, student)
    assert [one for one in result.checks if one.points != one.max_points and not was_too_busy(one)] == []
    skip_if_too_busy(result)


@pytest.mark.parametrize("lab_name", LABS)
def test_every_check_is_failed_by_some_mistake(lab_name: str) -> None:
    assert kill_matrix.unbeaten(load_lab(ROOT, lab_name)) == []


@pytest.mark.parametrize("lab_name", LABS)
def test_every_mistake_names_the_reason_it_expects(lab_name: str) -> None:
    lab = load_lab(ROOT, lab_name)
    # A half-done notebook fails for many reasons, and which limit ends a hostile program first is a matter of luck.
    silent = [
        student.student
        for student in kill_matrix.one_mistake(lab)
        if not student.codes and student.student != "partial" and not student.student.startswith("x")
    ]
    assert silent == []


def test_the_table_of_mistakes_is_up_to_date() -> None:
    assert kill_matrix.PAGE.read_text(encoding="utf-8") == kill_matrix.page(), (
        "run `python tests/support/kill_matrix.py`"
    )
