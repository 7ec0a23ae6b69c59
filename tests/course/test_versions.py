"""What students have received is remembered, so that an earlier version of a lab is not taken for an edited one."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest
import toy
from typer.testing import CliRunner

from autograder.authoring.release import release
from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.results import Status
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.course.versions import versions
from autograder.submission.reader import read_submission


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return toy.make_course(tmp_path / "course")


def correct(root: Path, old: str = "within=60", new: str = "within=50") -> None:
    """Change the lab as an author does who corrects it."""
    notebook = root / "solutions" / toy.LAB / f"{toy.LAB}.ipynb"
    assert old in notebook.read_text()
    notebook.write_text(notebook.read_text().replace(old, new))


def received(root: Path) -> list[dict[str, Any]]:
    cells: list[dict[str, Any]] = json.loads((root / "labs" / toy.LAB / f"{toy.LAB}.ipynb").read_text())["cells"]
    return cells


def edit(cells: list[dict[str, Any]]) -> None:
    """Change the first check, as a student does who looks at what it says."""
    next(cell for cell in cells if cell["id"] == "check_talker")["source"] = "pass"


def told(root: Path, cells: list[dict[str, Any]], place: Path) -> list[str]:
    submission = read_submission(toy.hand_in(place, "ann", cells), load_lab(root, toy.LAB))
    assert all(problem.status is Status.NOTE for problem in submission.problems)
    return [problem.because for problem in submission.problems]


def test_after_a_corrected_check_nobody_is_told_that_they_edited_it(root: Path, tmp_path: Path) -> None:
    release(root, toy.LAB)
    first = received(root)
    correct(root)
    assert told(root, first, tmp_path / "a") == []
    release(root, toy.LAB)
    release(root, toy.LAB)
    assert len(versions(root, toy.LAB)) == 2 and received(root) != first
    assert told(root, first, tmp_path / "b") == told(root, received(root), tmp_path / "c") == []
    edited = copy.deepcopy(first)
    edit(edited)
    said = "The cell `check_talker` was changed. Grading runs the lab's own cell, so this makes no difference."
    assert told(root, edited, tmp_path / "d") == [said]


def test_a_blank_answer_of_an_earlier_version_is_still_blank(root: Path) -> None:
    release(root, toy.LAB)
    first = load_lab(root, toy.LAB).answers["talker"].blank
    correct(root, "import time", "import math")
    lab = load_lab(root, toy.LAB)
    assert lab.answers["talker"].blank != first and lab.is_as_given_out("talker", first)
    assert not lab.is_as_given_out("talker", f"{first}print(1)")
    assert not lab.is_as_given_out("talker", toy.CELLS[4]["source"])  # the solution with its markers


def test_a_damaged_record_is_a_sentence(root: Path) -> None:
    release(root, toy.LAB)
    CoursePaths(root).versions(toy.LAB).write_text("[{]")
    with pytest.raises(KitError, match="versions of the lab that students have received, cannot be read"):
        load_lab(root, toy.LAB)


def test_check_of_a_full_solution_with_an_edited_check_passes(root: Path, tmp_path: Path) -> None:
    lab = load_lab(root, toy.LAB)
    cells = lab.clean_notebook({name: answer.solution for name, answer in lab.answers.items()})["cells"]
    next(cell for cell in cells if "within=60" in cell["source"])["source"] = "pass"
    notebook = toy.hand_in(tmp_path, "ann", cells)
    junit = tmp_path / "junit.xml"
    options = ["--isolation", "none", "--course", str(root), "--junit", str(junit), "--github"]
    done = CliRunner().invoke(app, ["check", str(notebook), *options])
    assert done.exit_code == 0, done.output
    assert "• the cell `check_talker` is not the lab's" in done.output and "::notice " in done.output
    assert "<failure" not in junit.read_text() and "::error" not in done.output
