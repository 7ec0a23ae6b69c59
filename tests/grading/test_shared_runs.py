"""Students who hand in the same recorded run are named to the instructor, and those who do not are not."""

from __future__ import annotations

import datetime
from dataclasses import replace
from pathlib import Path

import sample_class

from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.grading.shared_runs import shared_runs, told, with_the_same_run
from autograder.own_run.record import Record
from autograder.own_run.sheet import OwnRun
from autograder.pictures import Run
from autograder.report.class_page import write_class_page
from autograder.report.export.entry import Entry

RUNS = tuple(
    Run(name, begin + offset, begin + offset + 0.2, thread, f"exclusive group {thread}", "/robot", period=0.5)
    for begin in (0.0, 0.5, 1.0, 1.5)
    for thread, (name, offset) in enumerate((("camera", 0.0), ("planner", 0.07), ("motor", 0.15)), 1)
)


def table(runs: tuple[Run, ...]) -> str:
    """A table of answers, with questions that are drawn anew each time."""
    return f"# name: value\nrun: {OwnRun.of([Record(runs=runs)], 3).line()}\nquestion_1: 3\n"


def test_the_same_run_is_found_also_if_other_questions_are_asked_about_it() -> None:
    later = tuple(replace(run, begin=run.begin + 0.0001) for run in RUNS)
    handed_in = {"ann": table(RUNS), "bob": table(RUNS), "cem": table(later), "dan": "run: None\n", "eva": "run: x\n"}
    handed_in |= {"fay": "run: None\n", "gus": "", "hal": f"run: {OwnRun(asked=()).line()}\n"}
    handed_in["ida"] = handed_in["hal"]
    assert with_the_same_run({student: [text] for student, text in handed_in.items()}) == [["ann", "bob"]]


def test_of_a_run_only_the_times_are_looked_at_and_not_whether_the_kit_would_ask_so() -> None:
    """To find out what the kit would ask about a run that somebody has made up can take minutes."""
    one = OwnRun.of([Record(runs=RUNS)], 1).asked[0]
    odd = one.model_copy(update={"question": one.question.model_copy(update={"about": {"node": "/robot"}})})
    line = f"run: {OwnRun(asked=(odd,)).line()}\n"
    assert with_the_same_run({"ann": [line], "bob": [line], "cem": [table(RUNS)]}) == [["ann", "bob", "cem"]]


def test_the_class_page_names_those_who_share_a_run(tmp_path: Path) -> None:
    lab = load_lab(sample_class.ROOT, "lab2_executors")
    students = ["solution", "correct_await", "blank"]
    for student in students:
        sample_class.build_student(lab, student, tmp_path / "class")
        notebook = CoursePaths(tmp_path).submitted_notebook(student, lab.name)
        notebook.parent.mkdir(parents=True)
        notebook.write_text((tmp_path / "class" / student / f"{lab.name}.ipynb").read_text())
    shared = shared_runs(tmp_path, lab, students)
    assert shared == [["correct_await", "solution"]]
    assert told(shared[0]) == "correct_await and solution have handed in the same recorded run."
    results = [SubmissionResult(student=name, lab=lab.name, digest="", isolation=Isolation.FULL) for name in students]
    entries = [Entry(result.student, lab.name, result) for result in results]
    page = write_class_page(tmp_path / "lab2.html", entries, datetime.date(2026, 11, 26), shared).read_text()
    assert page.count("They have handed in the same recorded run.") == 1 and ">correct_await, solution<" in page
    assert "correct_await and solution" not in page
