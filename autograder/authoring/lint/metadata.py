"""What nbgrader's marks on the cells of a lab say, and whether the markers in them are paired."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

from autograder.authoring.lint.finding import Finding
from autograder.course.cells import MARK, BadNameError, grade_id_of, nbgrader_of, parse, source_of


def metadata_findings(cells: list[dict[str, Any]]) -> Iterator[Finding]:
    """Look through the marks and markers of a lab's cells."""
    ids = Counter(cell.get("id") for cell in cells)
    grade_ids = Counter(grade_id_of(cell) for cell in cells if nbgrader_of(cell))
    for number, cell in enumerate(cells, start=1):
        name = grade_id_of(cell) or str(number)
        if cell.get("id") and ids[cell["id"]] > 1:
            yield Finding(name, f"another cell has the id `{cell['id']}`, too.")
        for sentence in (*_markers(source_of(cell)), *_outside(cell)):
            yield Finding(name, sentence)
        if nbgrader_of(cell):
            if grade_ids[grade_id_of(cell)] > 1 and grade_id_of(cell):
                yield Finding(name, "another cell has the same grade_id.")
            for sentence in (*_marks(nbgrader_of(cell), cell["cell_type"]), *_answer(cell)):
                yield Finding(name, sentence)


def _marks(marks: dict[str, Any], kind: str) -> Iterator[str]:
    if not re.fullmatch(r"[A-Za-z0-9_-]+", str(marks.get("grade_id", ""))):
        yield "its grade_id must be letters, digits, `_` and `-`."
    if marks.get("schema_version") != 3:
        yield "its nbgrader metadata needs the schema_version 3."
    if marks.get("grade"):
        points = marks.get("points")
        if isinstance(points, bool) or not isinstance(points, (int, float)) or not points > 0:
            yield f"a graded cell needs points above 0, and it has {points!r}."
        if kind == "code" and not marks.get("solution") and not marks.get("locked"):
            yield "a check must be locked, or students could change it."
        if kind == "code" and marks.get("solution"):
            yield "code that students write gets its points from a check below it, and none of its own."
    elif "points" in marks:
        yield "it has points, but is not graded."
    if marks.get("solution") and marks.get("locked"):
        yield "it is to be filled in, and locked at the same time."


def _answer(cell: dict[str, Any]) -> Iterator[str]:
    if cell["cell_type"] != "code" or not nbgrader_of(cell).get("solution"):
        return
    try:
        if parse(source_of(cell)) is None:
            yield "it is to be filled in, so its first line must be `%%node NAME` or `%%file NAME`."
    except BadNameError as error:
        yield str(error)


def _outside(cell: dict[str, Any]) -> Iterator[str]:
    """Markers that nothing cuts, because the cell is of another kind."""
    marks = nbgrader_of(cell)
    found = {match[2] for match in MARK.finditer(source_of(cell))}
    if "SOLUTION" in found and not marks.get("solution"):
        yield "a solution stands in a cell that is not to be filled in; students would receive it."
    check = marks.get("grade") and not marks.get("solution") and cell["cell_type"] == "code"
    if "HIDDEN TESTS" in found and not check:
        yield "hidden tests stand in a cell that is no check."


def _markers(source: str) -> Iterator[str]:
    is_open: dict[str, int] = {}
    for number, line in enumerate(source.split("\n"), start=1):
        for which, mark in MARK.findall(line):
            if which == "BEGIN" and mark in is_open:
                yield f"line {number}: `BEGIN {mark}` stands inside of the one of line {is_open[mark]}."
            elif which == "END" and mark not in is_open:
                yield f"line {number}: `END {mark}` has no `BEGIN {mark}` above it."
            if which == "BEGIN":
                is_open[mark] = number
            else:
                is_open.pop(mark, None)
    for mark, number in is_open.items():
        yield f"line {number}: `BEGIN {mark}` has no `END {mark}` below it."
