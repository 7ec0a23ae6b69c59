"""A class of thousands: what a student costs must not depend on how many others there are."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

import pytest
import toy
from sqlalchemy import event
from sqlalchemy.engine import Engine

from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.recorder import Recorder
from autograder.grading.executors import local
from autograder.grading.runner import Settings
from autograder.grading.trusted_result import validated

GROW = ("grade", "comment", "submitted_assignment", "submitted_notebook", "student", "autograder_history")
"""The tables that have rows for each student."""


def test_recording_a_student_does_not_read_the_rows_of_the_whole_class(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local, "run_in_worker", lambda job, *_: validated(toy.judge(job), job.checks))
    root = toy.make_course(tmp_path / "course")
    lab = load_lab(root, toy.LAB)
    toy.hand_in(root / "class", "ann", lab.clean_notebook({"talker": "%%node talker\nprint('hello')"})["cells"])
    grade_class(root, toy.LAB, root / "class", Settings(isolation=Isolation.NONE))
    recorder = Recorder(root, lab, force=True)
    assert recorder.lacks_only_a_page("ann") is False  # this reads the whole class, once for all students
    asked: dict[str, Any] = {}

    def note(connection: Any, cursor: Any, statement: str, parameters: Any, context: Any, many: bool) -> None:
        asked.setdefault(statement, parameters[0] if many else parameters)

    event.listen(Engine, "before_cursor_execute", note)
    try:
        recorder.record("ann")
    finally:
        event.remove(Engine, "before_cursor_execute", note)
    assert not recorder.failures
    read_whole = []
    with sqlite3.connect(CoursePaths(root).gradebook) as gradebook:
        for statement, parameters in asked.items():
            if statement.split()[0] in ("SELECT", "UPDATE", "DELETE"):
                plan = gradebook.execute(f"EXPLAIN QUERY PLAN {statement}", parameters).fetchall()
                aliases = {"x": "grade", "sa": "submitted_assignment", "sn": "submitted_notebook"}
                steps = [step.split() for *_, step in plan if step.startswith("SCAN ")]
                scanned = {aliases.get(words[1], words[1].rstrip("_0123456789")) for words in steps}
                read_whole += [(statement, scanned & set(GROW))] if scanned & set(GROW) else []
    assert len(asked) > 20
    assert not read_whole
