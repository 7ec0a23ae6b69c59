"""A term on one page: totals with weights, who falls behind, and which checks most fail."""

from __future__ import annotations

import datetime
import re
from html import unescape
from pathlib import Path

from autograder.core.grades import CellGrade, Grade
from autograder.core.results import CheckResult, Isolation, Outcome, Status, SubmissionResult
from autograder.report.export.entry import Entry
from autograder.report.term_page import write_term_page


def entry(student: str, lab: str, easy: float, hard: float) -> Entry:
    """A submission with two checks of 5 points; `hard` is failed because the node is silent."""
    why = Outcome(status=Status.FAILED, title="it speaks", because="The node is silent.", code="silent")
    fine = Outcome(status=Status.PASSED, title="it speaks")
    earned = {"easy": easy, "hard": hard}
    checks = [
        CheckResult(grade_id=name, title=name, max_points=5, points=points, outcomes=[fine if points == 5 else why])
        for name, points in earned.items()
    ]
    result = SubmissionResult(student=student, lab=lab, digest="d", isolation=Isolation.FULL, checks=checks)
    cells = tuple(CellGrade(name, points, 5, is_check=True, by_hand=False) for name, points in earned.items())
    return Entry(student, lab, result, Grade(student, lab, cells, 0), known={"name": student.title()})


CLASS = [
    entry("ann", "one", 5, 5), entry("ann", "two", 5, 1),
    entry("bob", "one", 5, 5), entry("bob", "two", 5, 1),
    entry("cem", "one", 1, 0), entry("cem", "two", 1, 1),
    entry("dan", "one", 5, 5),
]  # fmt: skip


def text(path: Path, heading: str) -> str:
    """What stands below a heading, without tags."""
    page = path.read_text()
    below = page[page.index(f"<h2>{heading}</h2>") :].split("<h2>")[1]
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", below)).split())


def test_the_page_says_who_needs_attention(tmp_path: Path) -> None:
    day = datetime.date(2026, 11, 26)
    page = write_term_page(tmp_path / "t.html", "ROS 2", CLASS, ["one", "two", "three"], {"two": 3}, [], day, {})
    behind = text(page, "Who falls behind")
    assert "dan (Dan): nothing was graded for two." in behind
    assert "cem (Cem): 15 % of the points of one and two; the class's median is 65 %." in behind
    assert "ann" not in behind and "bob" not in behind
    hard = text(page, "Checks that most students fail")
    assert "two hard hard 20 % 3 The node is silent." in hard and "one hard" not in hard
    students = text(page, "All students")
    assert "ann Ann 70.0 % 0 0 10 of 10 6 of 10" in students  # (100 + 3 * 60) / 4
    assert "dan Dan 25.0 % 0 0 10 of 10 none" in students and "two, weight 3" in students
    assert "three" not in page.read_text() and text(page, "Appeals that wait for an answer").endswith("None.")


def test_the_page_has_everybody_of_the_roster(tmp_path: Path) -> None:
    roster = {name: {"id": name, "name": name.title(), "section": "A"} for name in ("ann", "bob", "cem", "eve")}
    page = write_term_page(tmp_path / "t.html", "ROS 2", CLASS, ["one", "two"], {}, [], datetime.date.today(), roster)
    behind, students = text(page, "Who falls behind"), text(page, "All students")
    assert "eve (Eve): nothing was graded in the whole term." in behind and "dan" not in behind
    assert "eve Eve A 0.0 % 0 0 none none" in students and "dan Dan not in the roster 50.0 %" in students
    assert "4 students, 2 labs" in page.read_text()
    assert "Mean of the totals <b>43.75 %</b>, median <b>47.5 %</b>. They do not count the 1 of" in page.read_text()
    one = write_term_page(tmp_path / "t.html", "ROS 2", CLASS[:1], ["one"], {}, [], datetime.date.today(), {})
    assert "1 student, 1 lab, page of" in one.read_text()
