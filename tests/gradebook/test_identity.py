"""A student is one person, whoever else hands in, and whatever the roster calls the student next."""

from __future__ import annotations

import shutil
from pathlib import Path

import by_hand
import pytest
import toy

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import ClassRun, Intake, grade_class
from autograder.gradebook.grades import class_entries, read_grades, read_history
from autograder.gradebook.renewal import renew_pages
from autograder.grading.runner import Settings
from autograder.intake.options import Accepted


class Course:
    """A toy course whose class comes from Canvas."""

    def __init__(self, place: Path) -> None:
        self.root, self.class_ = toy.make_course(place / "course"), place / "class"
        self.class_.mkdir()
        answers = {
            "talker": "%%node talker\nprint('hello')",
            "answers": "%%file answers.yaml\nanswer: 42",
            "why": "So.",
        }
        notebook = load_lab(self.root, toy.LAB).clean_notebook(answers)["cells"]
        self._notebook = toy.hand_in(place, "x", notebook).read_bytes()

    def hand_in(self, *names: str) -> None:
        for name in names:
            (self.class_ / f"{name}_toy.ipynb").write_bytes(self._notebook)

    def roster(self, *lines: str) -> None:
        (self.root / "roster.csv").write_text("\n".join(["id,name,canvas_id", *lines, ""]))

    def grade(self, *accepted: Accepted) -> ClassRun:
        settings = Settings(Isolation.NONE, canaries=False)
        return grade_class(self.root, toy.LAB, self.class_, settings, Intake(accepted=accepted))

    def scores(self) -> dict[str, float | None]:
        return {grade.student: grade.score for grade in read_grades(self.root)}


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    return Course(tmp_path)


def test_a_student_keeps_the_name_when_another_with_the_same_one_comes(course: Course) -> None:
    course.hand_in("smithjohn_111_1")
    course.grade()
    by_hand.give(course.root, "smithjohn", "why", 3)
    shutil.rmtree(course.root / "build")  # as `make clean` does
    course.hand_in("smithjohn_222_2")
    course.grade()
    assert course.scores() == {"smithjohn": 8, "smithjohn_222": 5}


def test_a_new_id_in_the_roster_is_the_same_person_after_a_question(course: Course) -> None:
    course.roster("ann,Ann Lee,111", "bob,Bob Ray,112")
    course.hand_in("annlee_111_1", "bobray_112_2")
    course.grade()
    by_hand.give(course.root, "ann", "why", 3)
    course.roster("al07,Ann Lee,111", "bob,Bob Ray,112")
    with pytest.raises(KitError, match=r"'ann' of an earlier run has the same number .* as 'al07'") as asked:
        course.grade()
    assert "--accept renamed" in asked.value.do and course.scores() == {"ann": 8, "bob": 5}
    run = course.grade(Accepted.RENAMED)
    assert run.told == ["ann is called al07 now; the grades and the history of toy have moved."]
    assert course.scores() == {"al07": 8, "bob": 5}
    assert [entry.student for entry in class_entries(course.root)] == ["al07", "bob"]
    history = read_history(course.root, toy.LAB)
    assert sorted(history) == ["al07", "bob"] and len(history["al07"]) == 3
    page = CoursePaths(course.root).feedback_page("al07", toy.LAB).read_text()
    assert "8 of 9 points" in page and "(al07)" in page
    assert not any((folder / "ann").exists() for folder in (course.root / "build").iterdir())
    assert course.grade().told == []


def test_all_labs_move_to_the_new_name(course: Course) -> None:
    other = course.root / "solutions" / "other"
    shutil.copytree(course.root / "solutions" / toy.LAB, other)
    (other / f"{toy.LAB}.ipynb").rename(other / "other.ipynb")
    course.roster("ann,Ann Lee,111")
    course.hand_in("annlee_111_1")
    course.grade()
    (course.class_ / "annlee_111_1_toy.ipynb").rename(course.class_ / "annlee_111_1_other.ipynb")
    settings = Settings(Isolation.NONE, canaries=False)
    grade_class(course.root, "other", course.class_, settings)
    course.roster("al07,Ann Lee,111")
    run = grade_class(course.root, "other", course.class_, settings, Intake(accepted=[Accepted.RENAMED]))
    assert run.told == ["ann is called al07 now; the grades and the history of other, toy have moved."]
    assert {(one.student, one.lab): one.score for one in read_grades(course.root)} == {
        ("al07", "other"): 5,
        ("al07", toy.LAB): 5,
    }
    renew_pages(course.root)
    entries = class_entries(course.root)
    assert [(one.student, one.lab, one.stale) for one in entries] == [
        ("al07", "other", False),
        ("al07", toy.LAB, False),
    ]
    assert all(one.feedback is not None and one.known["canvas_id"] == "111" for one in entries)


def test_a_new_id_is_found_although_this_lab_came_without_numbers(course: Course) -> None:
    """The number is known from another lab, and this one is a folder for each student."""
    other = course.root / "solutions" / "other"
    shutil.copytree(course.root / "solutions" / toy.LAB, other)
    (other / f"{toy.LAB}.ipynb").rename(other / "other.ipynb")
    course.roster("ann,Ann Lee,111", "bob,Bob Ray,112")
    course.hand_in("annlee_111_1", "bobray_112_2")
    course.grade()
    by_hand.give(course.root, "ann", "why", 3)
    course.roster("al07,Ann Lee,111", "bob,Bob Ray,112")
    plain = course.class_.parent / "plain"
    for name in ("al07", "bob"):
        (plain / name).mkdir(parents=True)
        shutil.copy(course.class_ / "bobray_112_2_toy.ipynb", plain / name / "other.ipynb")
    settings = Settings(Isolation.NONE, canaries=False)
    with pytest.raises(KitError, match=r"'ann' .* has the same number on the platform as 'al07'") as asked:
        grade_class(course.root, "other", plain, settings)
    assert "with --accept renamed;" in asked.value.do
    run = grade_class(course.root, "other", plain, settings, Intake(accepted=[Accepted.RENAMED]))
    assert run.told == ["ann is called al07 now; the grades and the history of toy have moved."]
    assert {(one.student, one.lab): one.score for one in read_grades(course.root)} == {
        ("al07", "other"): 5,
        ("bob", "other"): 5,
        ("al07", toy.LAB): 8,
        ("bob", toy.LAB): 5,
    }
    assert grade_class(course.root, "other", plain, settings).told == []  # it is not asked again
    assert course.grade().told == []
    course.roster("al08,Ann Lee,111", "bob,Bob Ray,112")  # and a second time
    with pytest.raises(KitError, match=r"'al07' .* has the same number on the platform as 'al08'"):
        course.grade()


def test_one_number_of_two_students_is_told(course: Course) -> None:
    course.roster("ann,Ann Lee,111", "bob,Bob Ray,112", "ann2,Ann Lee,112")
    course.hand_in("annlee_111_1")
    run = course.grade(Accepted.SMALLER)
    said = "The roster gives the canvas_id '112' to 'bob' and 'ann2', so it identifies neither of them."
    assert any(note.startswith(said) for note in run.collected.notes)
