"""Every student of every sample class is graded in the sandbox and gets exactly the expected points and reasons."""

from __future__ import annotations

import functools
from pathlib import Path

import kill_matrix
import pytest
import sample_class
from sample_class import ROOT

from autograder.core.results import CheckResult, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.grading.pool import run_class
from autograder.grading.runner import Settings

LABS = kill_matrix.labs()
MEMBERS = [(lab, student) for lab in LABS for student in sample_class.students(lab)]


@functools.cache
def graded(lab_name: str, members: tuple[str, ...], into: Path) -> dict[str, SubmissionResult]:
    """Grade a lab's class once, or those of it that are asked for, several at a time, as `autograder grade` does."""
    lab = load_lab(ROOT, lab_name)
    submissions = {}
    for student in members:
        folder = sample_class.build_student(lab, student, into / "submitted")
        found = sorted(folder.glob("*.ipynb"))
        submissions[student] = found[0] if found else folder / f"{lab_name}.ipynb"
    return run_class(submissions, into, lab, Settings(force=True), lambda _: None)


@pytest.fixture(scope="session")
def class_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("class")


def differences(lab: Lab, student: str, result: SubmissionResult) -> list[str]:
    """Where a result is not what was expected, as lines to read."""
    expected = sample_class.expected(lab, student)
    found = []
    lab_parts = {check.grade_id for check in result.checks if check.parts}
    found += [f"{name}: it has no parts" for name in expected.lost.keys() - lab_parts]
    if sorted(problem.code for problem in result.problems) != expected.problems:
        found.append(f"problems {[p.code for p in result.problems]}, expected {expected.problems}")
    if sorted(check.grade_id for check in result.checks if check.flags) != expected.flagged:
        found.append(f"flags {result.flags}, expected some for {expected.flagged}")
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


@pytest.fixture(scope="session")
def asked_for(request: pytest.FixtureRequest) -> dict[str, tuple[str, ...]]:
    """Students whose test runs, by lab: `-k` may leave most of a class out."""
    chosen = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    chosen = [params for params in chosen if {"lab_name", "student"} <= params.keys()]
    return {lab: tuple(p["student"] for p in chosen if p["lab_name"] == lab) for lab in LABS}


@pytest.mark.parametrize(("lab_name", "student"), MEMBERS)
def test_a_student_gets_exactly_the_expected_points_and_reasons(
    lab_name: str, student: str, asked_for: dict[str, tuple[str, ...]], class_folder: Path
) -> None:
    result = graded(lab_name, asked_for[lab_name], class_folder / lab_name)[student]
    assert differences(load_lab(ROOT, lab_name), student, result) == []


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
