"""Answers in words stand side by side for whoever grades them, and a group gets the same points and comment."""

from __future__ import annotations

from pathlib import Path

import pytest
import toy
from typer.testing import CliRunner

from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.grades import CellGrade
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.grades import read_grades
from autograder.grading.runner import Settings
from autograder.report.answers_page import WrittenAnswer, groups

TEXTS = {
    "ann": "Because both callbacks are in the same mutually exclusive group, the timer has to wait.",
    "bob": "The timer has to wait because both callbacks are in the same mutually exclusive group!",
    "cem": "No idea, <script>alert(1)</script>",
}


def test_similar_answers_stand_in_one_group() -> None:
    grade = CellGrade("why", None, 4, is_check=False, by_hand=False)
    found = groups([WrittenAnswer(name, text, grade) for name, text in TEXTS.items()])
    assert [[one.student for one in group] for group in found] == [["ann", "bob"], ["cem"]]


def test_a_group_gets_the_same_points_and_comment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
    root = toy.make_course(tmp_path / "course")
    for student, text in TEXTS.items():
        answers = {"talker": "%%node talker\nprint('hello')", "answers": "%%file answers.yaml\nanswer: 42", "why": text}
        toy.hand_in(tmp_path / "class", student, load_lab(root, toy.LAB).clean_notebook(answers)["cells"])
    grade_class(root, toy.LAB, tmp_path / "class", Settings(Isolation.NONE, canaries=False))

    def said(*arguments: str) -> str:
        return " ".join(CliRunner().invoke(app, [*arguments, "--course", str(root)]).output.split())

    def run(*arguments: str) -> BaseException | None:
        return CliRunner().invoke(app, [*arguments, "--course", str(root)]).exception

    assert run("answers", toy.LAB, "why") is None
    page = CoursePaths(root).answers_page(toy.LAB, "why").read_text()
    assert "autograder mark toy why POINTS ann bob --comment" in page and "<p>Because.</p>" in page
    assert "3 of them are not graded yet" in page and "<script>" not in page
    for wrong in (("9", "ann"), ("3", "ann", "eve")):
        assert isinstance(run("mark", toy.LAB, "why", *wrong), KitError)
    assert run("mark", toy.LAB, "why", "3", "ann", "bob", "--comment", "Well said.") is None
    assert {grade.student: grade.earned for grade in read_grades(root)} == {"ann": 8, "bob": 8, "cem": 5}
    assert "In the gradebook: 8 of 9 points" in said("explain", "ann") and "1 to grade" in said("explain", "cem")
    assert "ann had" not in said("mark", toy.LAB, "why", "3", "ann", "--comment", "Well said.")
    told = said("mark", toy.LAB, "why", "1", "ann", "bob")  # a second grader, who did not see the points
    assert told.startswith("1 point for why: ann, bob.") and "ann had 3 before." in told and "bob had 3 before." in told
    assert "The feedback page was renewed." in said("mark", toy.LAB, "why", "3", "bob")
    run("mark", toy.LAB, "why", "3", "ann")
    feedback = {name: CoursePaths(root).feedback_page(name, toy.LAB).read_text() for name in TEXTS}
    assert "Well said." in feedback["ann"] and "8 of 9 points" in feedback["bob"] and "so far" in feedback["cem"]
    run("answers", toy.LAB, "why")
    assert (
        'Well said. <span class="faint">(given 2 times)' in CoursePaths(root).answers_page(toy.LAB, "why").read_text()
    )
