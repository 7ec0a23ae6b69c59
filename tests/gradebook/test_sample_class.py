"""The sample class's folders become the notebooks that they describe."""

from __future__ import annotations

from pathlib import Path

import kill_matrix
import pytest
import sample_class
import toy
import yaml

from autograder.course.lab import Lab, load_lab
from autograder.submission.answers import Submission
from autograder.submission.reader import read_submission


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return load_lab(toy.make_course(tmp_path / "course"), toy.LAB)


def build(lab: Lab, folder: Path, expected: object, notebook: object = None, **cells: str) -> Submission:
    home = folder / "describe" / "ann"
    (home / "cells").mkdir(parents=True)
    (home / "expected.yaml").write_text(yaml.safe_dump({"about": "a test"} | dict(expected)))  # type: ignore[call-overload]
    if notebook is not None:
        (home / "notebook.yaml").write_text(yaml.safe_dump(notebook))
    for name, text in cells.items():
        (home / "cells" / f"{name}.py").write_text(text)
    made = sample_class.build_student(lab, "ann", folder / "made", folder / "describe")
    return read_submission(made / f"{toy.LAB}.ipynb", lab)


def test_a_student_differs_from_the_base_in_the_cells_given(lab: Lab, tmp_path: Path) -> None:
    submission = build(lab, tmp_path, {"base": "solution"}, talker="print('mine')\n")
    assert submission.files["talker.py"] == "# %%node talker\nprint('mine')\n"
    assert submission.files["answers.yaml"] == "answer: 42\n"
    assert submission.problems == []


def test_without_a_base_the_lab_is_blank(lab: Lab, tmp_path: Path) -> None:
    submission = build(lab, tmp_path, {}, talker="%%node talker\nprint('mine')\n")
    assert submission.files["talker.py"] == "# %%node talker\nprint('mine')\n"
    assert "42" not in submission.files["answers.yaml"]


def test_the_notebook_is_changed_as_described(lab: Lab, tmp_path: Path) -> None:
    changes = {
        "sources": {"check_answers": "2"},
        "metadata": {"check_talker": {"nbgrader": {"solution": True}}},
        "tags": ["skip-execution"],
        "delete": ["answers"],
        "duplicate": ["talker"],
        "append": [{"cell_type": "code", "source": "1", "nbgrader": {"grade_id": "forged", "grade": True}}],
        "files": {"ipykernel_launcher.py": "x"},
    }
    submission = build(lab, tmp_path, {"base": "solution"}, changes)
    assert sorted(problem.code for problem in submission.problems) == [
        "changed-cell", "duplicated-cell", "forged-cell", "forged-flags", "missing-cell"
    ]  # fmt: skip
    assert (tmp_path / "made" / "ann" / "ipykernel_launcher.py").is_file()
    assert "skip-execution" in (tmp_path / "made" / "ann" / "toy.ipynb").read_text()


def test_expectations_fill_in_what_is_left_out(lab: Lab, tmp_path: Path) -> None:
    told = {"base": "solution", "checks": {"check_talker": {"points": 0, "code": "silent", "because": "it"}}}
    build(lab, tmp_path, told)
    expected = sample_class.expected(lab, "ann", tmp_path / "describe")
    assert expected.points == {"check_talker": 0, "check_answers": 2}
    assert (expected.codes, expected.because) == ({"check_talker": "silent"}, {"check_talker": "it"})


def test_a_slip_in_a_description_is_an_error(lab: Lab, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no answer cell `talkr`"):
        build(lab, tmp_path, {}, talkr="x")
    (tmp_path / "describe" / "ann" / "expected.yaml").write_text("about: x\nchecks: {check_talkr: {points: 1}}")
    with pytest.raises(ValueError, match="check_talkr"):
        sample_class.expected(lab, "ann", tmp_path / "describe")


@pytest.mark.parametrize("name", kill_matrix.labs())
def test_the_class_that_is_built_shows_every_kind_of_outcome(name: str) -> None:
    lab = load_lab(sample_class.ROOT, name)
    chosen, everybody = sample_class.examples(lab), sample_class.students(name)
    assert {"solution", "blank"} <= set(chosen) <= set(everybody)
    shown, known = (set().union(*(sample_class.outcomes(lab, one) for one in group)) for group in (chosen, everybody))
    assert shown == known
