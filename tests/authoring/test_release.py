"""What students receive is what the sources give: `labs/` is generated, never edited."""

from __future__ import annotations

import ast
import functools
import json
from itertools import pairwise

import pytest
from places import ROOT

from autograder.course.cells import CODE_STUB, for_checks
from autograder.course.lab import load_lab
from autograder.gradebook import release

released_files = functools.cache(release.released_files)
LABS = sorted(path.parent.name for path in (ROOT / "solutions").glob("*/*.ipynb"))


@pytest.mark.parametrize("lab", LABS)
def test_labs_are_as_generated(lab: str) -> None:
    made = released_files(ROOT, lab)
    there = {path.relative_to(ROOT / "labs" / lab) for path in (ROOT / "labs" / lab).rglob("*") if path.is_file()}
    # Running a lab writes its programs to `nodes`; editors leave folders that begin with a dot.
    there = {path for path in there if path.parts[0] != "nodes" and not path.parts[0].startswith(".")}
    assert there == made.keys(), f"run: autograder release {lab}"
    for path, content in made.items():
        assert (ROOT / "labs" / lab / path).read_bytes() == content, f"{path} differs; run: autograder release {lab}"


@pytest.mark.parametrize("lab", LABS)
def test_students_receive_neither_solutions_nor_hidden_tests(lab: str) -> None:
    text = b"".join(released_files(ROOT, lab).values()).decode()
    for mark in ("BEGIN HIDDEN TESTS", "BEGIN SOLUTION", "END SOLUTION", "BEGIN MARK SCHEME"):
        assert mark not in text
    assert CODE_STUB in text
    # Besides the notebook nothing may lie in a lab's folder that its author has not meant to give out.
    assert not [path for path in released_files(ROOT, lab) if path.suffix in (".py", ".pyc", ".db")]


@pytest.mark.parametrize("lab", LABS)
def test_no_cell_of_a_file_is_empty_which_ipython_refuses_to_run(lab: str) -> None:
    cells = json.loads((ROOT / "labs" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert not [source for source in sources if source.startswith("%%") and not source.partition("\n")[2].strip()]


@pytest.mark.parametrize("lab", LABS)
def test_every_answer_that_names_a_file_still_does_when_blank(lab: str) -> None:
    for answer in load_lab(ROOT, lab).answers.values():
        assert answer.cell_type == "markdown" or answer.file is not None, answer.grade_id


@pytest.mark.parametrize("lab", LABS)
def test_no_table_of_answers_is_worth_more_than_a_tenth_of_a_labs_points(lab: str) -> None:
    cells = json.loads((ROOT / "solutions" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]
    marks = [cell["metadata"].get("nbgrader", {}) for cell in cells]
    whole = sum(mark["points"] for mark in marks if mark.get("grade"))  # what is graded by hand, too
    tables = {check.grade_id: check.points for check in load_lab(ROOT, lab).checks if "answers(" in check.source}
    assert {name: points for name, points in tables.items() if (points or 0) > whole / 10} == {}


@pytest.mark.parametrize("lab", LABS)
def test_a_check_is_folded_below_a_sentence_that_says_what_it_looks_at(lab: str) -> None:
    cells = json.loads((ROOT / "labs" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]
    for above, cell in pairwise(cells):
        marks = cell["metadata"].get("nbgrader", {})
        if for_checks(cell):
            assert marks["locked"] and cell["metadata"]["jupyter"] == {"source_hidden": True}, marks["grade_id"]
        elif cell["cell_type"] == "code" and marks.get("grade"):
            last = "".join(above["source"]).strip().splitlines()[-1]
            assert above["cell_type"] == "markdown" and not last.startswith("#"), marks["grade_id"]
            assert last not in ("**Check.**", "---"), marks["grade_id"]
            assert cell["metadata"]["jupyter"] == {"source_hidden": True}, marks["grade_id"]
        else:
            assert "jupyter" not in cell["metadata"]


@pytest.mark.parametrize("lab", LABS)
def test_a_check_and_each_function_that_it_uses_fit_on_a_screen(lab: str) -> None:
    cells = json.loads((ROOT / "solutions" / lab / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]
    long = []
    for cell in cells:
        source = "".join(cell["source"])
        if (
            cell["cell_type"] == "code"
            and cell["metadata"].get("nbgrader", {}).get("grade")
            and source.count("\n") >= 40
        ):
            long.append(cell["id"])
        for one in ast.walk(ast.parse(source)) if for_checks(cell) else ():
            if isinstance(one, ast.FunctionDef) and (one.end_lineno or 0) - one.lineno >= 40:
                long.append(one.name)
    assert long == []
