"""What happened to a student's points is kept: when, with which versions, what changed, why, and who did it."""

from __future__ import annotations

import datetime
from pathlib import Path

import by_hand
import pytest
import toy
from typer.testing import CliRunner

from autograder.cli.main import app
from autograder.core.history import Change, Decided, Decision, Entry, Graded, Points, state_after, told
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.grades import class_entries, read_grades, read_history
from autograder.grading.runner import Settings
from autograder.report.class_page import write_class_page


class Course:
    """A toy course with a class of one, ann."""

    def __init__(self, place: Path) -> None:
        self.root, self.class_ = toy.make_course(place / "course"), place / "class"

    def grade(self, talker: str) -> None:
        answers = {"talker": f"%%node talker\n{talker}", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
        toy.hand_in(self.class_, "ann", load_lab(self.root, toy.LAB).clean_notebook(answers)["cells"])
        grade_class(self.root, toy.LAB, self.class_, Settings(Isolation.NONE, canaries=False))

    def changes(self) -> list[list[Change]]:
        return [list(event.changes) for event in told(read_history(self.root, toy.LAB)["ann"])]


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    return Course(tmp_path)


def test_a_term_of_one_student_is_told(course: Course, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOGNAME", "teacher")
    course.grade("print('no')")
    by_hand.give(course.root, "ann", "why", 3, user="mia")
    by_hand.give(course.root, "ann", "check_talker", 2, user="mia")
    by_hand.give(course.root, "ann", "check_talker", 2, user="tom")  # nothing changes
    course.grade("print('hello')")
    by_hand.give(course.root, "ann", "check_talker", None, user="tom")
    notebook = course.root / "solutions" / toy.LAB / "toy.ipynb"
    notebook.write_text(
        notebook.read_text().replace("table.score(2)", "table.score(3)").replace('"points": 2', '"points": 3')
    )
    course.grade("print('hello')")
    course.grade("print('hello')")  # nothing is done

    assert course.changes() == [
        [],
        [Change("why", "? of 4", "3 of 4", "graded by hand")],
        [Change("check_talker", "0 of 3", "2 of 3", "overruled by hand")],
        [
            Change(
                "check_talker", "2 of 3", "2 of 3", "resubmission, the check gives 3 now, but the points by hand stay"
            )
        ],
        [Change("check_talker", "2 of 3", "3 of 3", "points by hand taken back")],
        [Change("check_answers", "2 of 2", "3 of 3", "it gives up to 3 points now, before 2; changed check")],
    ]
    events = told(read_history(course.root, toy.LAB)["ann"])
    assert [event.score for event in events] == ["2 of 9", "5 of 9", "7 of 9", "7 of 9", "8 of 9", "9 of 10"]
    assert [event.by for event in events] == ["teacher", "mia", "mia", "teacher", "tom", "teacher"]
    assert [event.what.split(" with ")[0] for event in events] == [
        "Graded", "Points by hand", "Points by hand", "Graded again", "Points by hand", "Graded again"
    ]  # fmt: skip
    assert events[0].what.split(" with ")[1] == events[3].what.split(" with ")[1] != events[5].what.split(" with ")[1]
    assert [grade.score for grade in read_grades(course.root)] == [9]

    shown = CliRunner().invoke(app, ["explain", "ann", "--course", str(course.root)], env={"COLUMNS": "160"})
    assert "check_talker: 0 of 3 → 2 of 3, overruled by hand" in shown.output and "mia" in shown.output
    page = write_class_page(course.root / "class.html", class_entries(course.root), datetime.date.today()).read_text()
    assert "history, 6 entries" in page and "points by hand taken back" in page


def test_the_feedback_page_shows_it_on_request(course: Course) -> None:
    page = CoursePaths(course.root).feedback_page("ann", toy.LAB)
    course.grade("print('no')")
    assert "How your points came about" not in page.read_text()
    (course.root / "course.toml").write_text("history_for_students = true\n")
    course.grade("print('hello')")
    assert "How your points came about" in page.read_text()
    assert "<code>check_talker</code>: 0 of 3 → 3 of 3, resubmission" in page.read_text()


NOW = datetime.datetime(2026, 11, 20, tzinfo=datetime.UTC)


def graded(**more: str) -> Graded:
    same = dict.fromkeys(("kit", "kit_digest", "lab_digest", "answers", "handed_in", "recorded"), "x")
    return Graded.model_validate({**same, "checks": {"a": "x"}, **more})


def test_a_penalty_and_a_changed_kit_and_an_appeal_are_told() -> None:
    first = Points(auto=2, by_hand=None, extra=None, most=5, is_check=True)
    entries = [
        Entry(at=NOW, by="mia", points={"a": first}, graded=graded()),
        Entry(at=NOW, by="mia", points={"a": first.model_copy(update={"auto": 4})}, graded=graded(kit_digest="y")),
        Entry(at=NOW, by="mia", penalty=1.5),
        Entry(at=NOW, by="mia", decided=Decided(cell="a", asked="Why?", decision=Decision.REFUSED, reason="So.")),
    ]
    events = told(entries)
    assert events[1].changes == (Change("a", "2 of 5", "4 of 5", "changed kit"),)
    assert events[2].what == "Handed in late"
    assert events[2].changes == (Change("", "0", "-1.5", "penalty for being late"),)
    assert (events[3].what, events[3].score) == ("Appeal about a refused: So.", "2.5 of 5")
    assert [event.changes[0].why for event in told(entries, "a") if event.changes] == [
        "graded for the first time", "changed kit"
    ]  # fmt: skip
    assert state_after(entries).graded == entries[1].graded
