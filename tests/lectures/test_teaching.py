"""What instructors teach with agrees with the course: exam questions, the term plan, and what students do not get."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import pytest
from places import ROOT

PAGES = ROOT / "lectures" / "instructors"
EXAM = (PAGES / "exam_questions.md").read_text(encoding="utf-8")
QUESTIONS = re.findall(r"^### (\S+ .*?)(?=^##|\Z)", EXAM, re.MULTILINE | re.DOTALL)
PLAN = (PAGES / "term_plan.md").read_text(encoding="utf-8")


def kind_of(question: str) -> str:
    found = re.search(r"^\*(\w+)[.,]", question, re.MULTILINE)
    return found[1] if found else "none"


def points_of(lab: Path) -> dict[str, float]:
    """The points of a lab's cells, by their names."""
    cells = json.loads(lab.read_text(encoding="utf-8"))["cells"]
    graded = [cell["metadata"]["nbgrader"] for cell in cells if "nbgrader" in cell["metadata"]]
    return {cell["grade_id"]: cell["points"] for cell in graded if cell.get("points")}


def test_there_are_sixty_questions_of_all_lectures_and_kinds() -> None:
    assert len(QUESTIONS) == 60
    lectures = Counter(question.split(".")[0] for question in QUESTIONS)
    assert lectures["O"] == 5 and min(lectures[str(number)] for number in range(1, 9)) >= 5
    table = dict(re.findall(r"^\| (\w+) \| .* \| (\d+) \|$", EXAM, re.MULTILINE))
    assert {kind: str(number) for kind, number in Counter(map(kind_of, QUESTIONS)).items()} == table


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda text: text.split()[0])
def test_a_question_has_a_folded_answer_that_says_what_it_tests_and_how_long_it_takes(question: str) -> None:
    assert question.count("<details><summary>") == question.count("</details>") == 1
    answer = question.partition("<details>")[2]
    assert re.search(r"\*\*Tests:\*\* .*\d+\sminutes\.\n</details>", answer, re.DOTALL)
    assert "{measured}" not in question.partition("<details>")[0], "the key stands before the answer"


def test_most_questions_about_a_program_are_measured() -> None:
    assert sum("{measured}" in question for question in QUESTIONS) >= 30


def test_the_points_of_the_term_plan_are_those_of_the_labs() -> None:
    labs = sorted((ROOT / "solutions").glob("*/*.ipynb"))
    whole = re.findall(r"^\| (\d) \| \[.*?\| (?:\d+|none) \| .*? \| (\d+) \| after", PLAN, re.MULTILINE)
    assert [(int(number), int(points)) for number, points in whole] == [
        (number, sum(points_of(lab).values())) for number, lab in enumerate(labs, start=1)
    ]
    for number, cells, kept, all_points in re.findall(
        r"^\| (\d) \| (`check.*?) \| (\d+) of (\d+) \|$", PLAN, re.MULTILINE
    ):
        points = points_of(labs[int(number) - 1])
        dropped = re.findall(r"`(\w+)`", cells)
        assert sum(points.values()) == int(all_points)
        assert sum(points.values()) - sum(points[name] for name in dropped) == int(kept)


def test_the_slides_of_the_term_plan_are_those_of_the_talks() -> None:
    for number, slides in re.findall(r"^\| (\d) \| \[.*?\) \| (\d+) \|", PLAN, re.MULTILINE):
        talk = next((ROOT / "lectures" / "slides").glob(f"0{number}_*.md")).read_text(encoding="utf-8")
        assert len(re.findall(r"^## ", talk, re.MULTILINE)) == int(slides), f"lecture {number}"


def test_the_points_of_the_rubric_are_those_of_the_projects_explanation() -> None:
    project = (PAGES / "final_project.md").read_text(encoding="utf-8")
    points = points_of(ROOT / "solutions" / "lab9_delivery" / "lab9_delivery.ipynb")
    assert sum(map(int, re.findall(r"^\| [A-Z][\w -]+ \| (\d+) \|", project, re.MULTILINE))) == points["explain_design"]


def test_each_lecture_has_a_part_on_the_teaching_page() -> None:
    text = (PAGES / "teach.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (?=Lecture \d)", text, flags=re.MULTILINE)[1:]
    assert [part[:9] for part in parts] == [f"Lecture {number}" for number in range(1, 9)]
    for part in parts:
        for word in (
            "**Begin with:**",
            "**What they believe.**",
            "**Where they stumble**",
            "**Demo:",
            "%%node",
            "{measured}",
        ):
            assert word in part or (word == "%%node" and part.startswith("Lecture 8")), f"{part[:9]} lacks {word}"
