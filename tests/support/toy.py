"""A course with one small lab, for the tests of everything around the checks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from autograder.core.results import CheckResult, Outcome, Status, SubmissionResult
from autograder.gradebook.own_courses import trust
from autograder.grading.job import Job

LAB = "toy"


def cell(kind: str, source: str, number: int, **nbgrader: Any) -> dict[str, Any]:
    """Return a notebook cell, with nbgrader's marks if a grade_id is among the arguments."""
    made: dict[str, Any] = {"cell_type": kind, "id": f"c{number:03d}", "metadata": {}, "source": source}
    if kind == "code":
        made.update(outputs=[], execution_count=None)
    if nbgrader:
        marks = {"grade": False, "locked": False, "solution": False, "task": False, "schema_version": 3}
        made["metadata"] = {"nbgrader": marks | nbgrader}
    return made


CELLS = [
    cell("markdown", "# A toy lab\nwith `a < b` in it", 1),
    cell(
        "code", "%load_ext autograder\nfrom autograder.checks import answers, launch", 2, grade_id="setup", locked=True
    ),
    cell("code", "%%node helper\nprint('given')", 3, grade_id="helper", locked=True),
    cell("markdown", "## The talker\nWrite it.", 4),
    cell(
        "code",
        "%%node talker\nimport time\n\n### BEGIN SOLUTION\nprint('hello')\n### END SOLUTION\n",
        5,
        grade_id="talker",
        solution=True,
    ),
    cell(
        "code",
        """with launch("talker") as ros:
    ros.program("talker").expect_exit(within=60)
    ### BEGIN HIDDEN TESTS
    secret = 0
    ros.program("talker").expect_exit(status=secret, hint="Mind the status.")
    ### END HIDDEN TESTS
ros.score(3)""",
        6,
        grade_id="check_talker",
        grade=True,
        locked=True,
        points=3,
    ),
    cell("markdown", "## The table", 7),
    cell(
        "code",
        "%%file answers.yaml\n### BEGIN SOLUTION\nanswer: 42\n### END SOLUTION",
        8,
        grade_id="answers",
        solution=True,
    ),
    cell(
        "code",
        'with answers("answers.yaml") as table:\n    table.expect_answer("answer", 42)\ntable.score(2)',
        9,
        grade_id="check_answers",
        grade=True,
        locked=True,
        points=2,
    ),
    cell("markdown", "Because.", 10, grade_id="why", grade=True, solution=True, points=4),
]


def notebook(cells: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a notebook of these cells."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python", "version": "3.99"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def make_course(root: Path) -> Path:
    """Write the course's folders and return its root."""
    folder = root / "solutions" / LAB
    folder.mkdir(parents=True)
    (folder / f"{LAB}.ipynb").write_text(json.dumps(notebook(CELLS)), encoding="utf-8")
    (root / "labs").mkdir()
    trust(root)
    return root


def hand_in(folder: Path, student: str, cells: list[dict[str, Any]] | str) -> Path:
    """Write a student's notebook, or raw text in its place, and return its path."""
    path = folder / student / f"{LAB}.ipynb"
    path.parent.mkdir(parents=True, exist_ok=True)
    text = cells if isinstance(cells, str) else json.dumps(notebook(cells))
    path.write_text(text, encoding="utf-8")
    return path


def judge(job: Job) -> SubmissionResult:
    """Stand in for the worker: a check passes if its file holds the solution; `die` in it means no result."""
    checks = []
    for trusted in job.checks:
        name, right = ("talker.py", "hello") if trusted.grade_id == "check_talker" else ("answers.yaml", "42")
        text = job.files.get(name, "")
        passed = right in text
        status = Status.UNKNOWN if "die" in text else Status.PASSED if passed else Status.FAILED
        outcomes = [
            Outcome(
                status=status,
                title="the program says hello",
                expected="hello",
                observed=text[-200:],
                because="" if passed else "It says something else: <script>alert(1)</script>",
                code="" if passed else "silent",
            ),
            Outcome(
                status=status, title="secret title", expected="secret value", because="secret reason", hint="Read on.",
                hidden=True, code="secret-code",
            ),
        ]  # fmt: skip
        points = {Status.UNKNOWN: None, Status.PASSED: trusted.points, Status.FAILED: 0.0}[status]
        checks.append(
            CheckResult(
                grade_id=trusted.grade_id, title=trusted.title, max_points=trusted.points or 0, points=points,
                outcomes=outcomes,
            )
        )  # fmt: skip
    return SubmissionResult(
        student=job.student, lab=job.lab, digest=job.digest, isolation=job.isolation, seed=job.seed,
        problems=job.problems, checks=checks,
    )  # fmt: skip
