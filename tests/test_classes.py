"""Every student of every sample class is graded in the sandbox and gets exactly the expected points and reasons.

Where a student's changed answers reach only some of the checks, the others are not run: they are the solution's, on the
solution's files, and must be expected to pass. `--complete` (`make test-all`) runs every check of everybody.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import kill_matrix
import pytest
import sample_class
from sample_class import ROOT

from autograder.authoring.mutation.reach import reached, using
from autograder.core.results import CheckResult, SubmissionResult
from autograder.course.lab import Cell, Lab, load_lab
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of, without_running
from autograder.grading.supervisor import run_in_worker
from autograder.submission.reader import read_submission

LABS = kill_matrix.labs()
MEMBERS = [(lab, student) for lab in LABS for student in sample_class.students(lab)]
ALONE = "the solution, with each check's own files alone"
SETTINGS = Settings(force=True)
LEAVE_ONLY = """
from autograder.checks.runtime import current
for name, text in {files!r}.items():
    (current.folder / name).unlink(missing_ok=True)
    if name in {kept!r}:
        (current.folder / name).write_text(text, encoding="utf-8")
"""
Grade = Callable[[threading.Event], SubmissionResult]


def grading(lab: Lab, student: str, into: Path, complete: bool) -> Grade:
    """Write what a student hands in, and return what grades it."""
    if student == ALONE:
        sample_class.build_student(lab, "solution", into / ALONE)
        job = each_check_alone(lab, into / ALONE / "solution" / f"{lab.name}.ipynb")
        return lambda stop: run_in_worker(job, stop)
    folder = sample_class.build_student(lab, student, into)
    path = next(iter(sorted(folder.glob("*.ipynb"))), folder / f"{lab.name}.ipynb")
    cells = list(lab.cells) if complete else cells_to_run(lab, student, path)
    submission = read_submission(path, lab)
    job = job_of(submission, student, lab, SETTINGS).model_copy(update={"cells": cells})
    if not submission.readable:
        return lambda _: without_running(submission, job)
    return lambda stop: run_in_worker(job, stop)


def cells_to_run(lab: Lab, student: str, path: Path) -> list[Cell]:
    """The cells that a student can reach who changed answers of the solution and nothing else; otherwise all."""
    home = sample_class.class_folder(lab.name) / student
    told = sample_class.expected(lab, student)
    if student == "solution" or not told.from_solution or told.problems or told.flagged:
        return list(lab.cells)
    if not {each.name for each in home.iterdir()} <= {"cells", "expected.yaml"}:
        return list(lab.cells)
    if student.startswith("x"):  # it is hostile and may harm checks that do not run it
        return list(lab.cells)
    cells = reached(lab, {file.stem for file in (home / "cells").iterdir()})
    return cells if any(cell.points is not None for cell in cells) else list(lab.cells)


def each_check_alone(lab: Lab, solution: Path) -> Job:
    """The solution's job, with only those answers there at each check that are said to reach it."""
    job = job_of(read_submission(solution, lab), ALONE, lab, SETTINGS)
    files = {name: answer.file.file_name for name, answer in lab.answers.items() if answer.file is not None}
    texts = {name: job.files[name] for name in files.values()}
    cells = []
    for cell in lab.cells:
        if cell.points is not None:
            kept = sorted(files[name] for name in using(lab, cell))
            cells.append(Cell(grade_id=f"before_{cell.grade_id}", source=LEAVE_ONLY.format(files=texts, kept=kept)))
        cells.append(cell)
    return job.model_copy(update={"cells": cells})


@pytest.fixture(scope="session")
def graded(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[tuple[str, str], Future[SubmissionResult]]]:
    """Everybody whose test runs (`-k` may leave most of them out), several at a time as `autograder grade` does."""
    chosen = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    wanted = [(p["lab_name"], p["student"]) for p in chosen if {"lab_name", "student"} <= p.keys()]
    into, complete = tmp_path_factory.mktemp("classes"), request.config.getoption("complete")
    stop = threading.Event()
    with ThreadPoolExecutor(SETTINGS.at_once) as pool:
        try:
            jobs = {
                (name, student): grading(load_lab(ROOT, name), student, into / name, complete)
                for name, student in wanted
            }
            yield {who: pool.submit(grade, stop) for who, grade in jobs.items()}
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def differences(lab: Lab, student: str, result: SubmissionResult) -> list[str]:
    """Where a result is not what was expected, as lines to read."""
    expected = sample_class.expected(lab, student)
    found = []
    without_parts = {check.grade_id for check in result.checks if not check.parts}
    found += [f"{name}: it has no parts" for name in expected.lost.keys() & without_parts]
    if sorted(problem.code for problem in result.problems) != expected.problems:
        found.append(f"problems {[p.code for p in result.problems]}, expected {expected.problems}")
    if sorted(check.grade_id for check in result.checks if check.flags) != expected.flagged:
        found.append(f"flags {result.flags}, expected some for {expected.flagged}")
    run = {check.grade_id for check in result.checks}
    for check in lab.checks:
        if check.grade_id not in run and expected.points[check.grade_id] != check.points:
            found.append(f"{check.grade_id}: no changed answer reaches it, and still it is expected to lose points")
    for check in result.checks:
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


def lost_parts(check: CheckResult) -> list[str]:
    """Titles of the parts that did not give all their points, sorted."""
    return sorted(part.title for part in check.parts if part.points < part.max_points)


@pytest.mark.parametrize(("lab_name", "student"), MEMBERS)
def test_a_student_gets_exactly_the_expected_points_and_reasons(
    lab_name: str, student: str, graded: dict[tuple[str, str], Future[SubmissionResult]]
) -> None:
    result = graded[lab_name, student].result()
    assert differences(load_lab(ROOT, lab_name), student, result) == []


@pytest.mark.parametrize(("lab_name", "student"), [(lab, ALONE) for lab in LABS])
def test_no_other_answer_reaches_a_check(
    lab_name: str, student: str, graded: dict[tuple[str, str], Future[SubmissionResult]]
) -> None:
    lost = [check for check in graded[lab_name, student].result().checks if check.points != check.max_points]
    assert lost == []


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
    assert kill_matrix.PAGE.read_text(encoding="utf-8") == kill_matrix.page(), "run `python tests/kill_matrix.py`"
