"""A lab as the instructor wrote it: which cells are trusted, which are answers, and what students receive.

The notebook under `solutions/` is the only source. If there is none, as in a student's copy of the course, the
notebook under `labs/` is used. It has the same cells without the solutions and the hidden tests.
"""

from __future__ import annotations

import copy
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from autograder.core.errors import KitError
from autograder.core.files import signature
from autograder.course.cells import (
    CODE_STUB,
    TEXT_STUB,
    BadNameError,
    CellFile,
    blank_mark,
    cell_digest,
    grade_id_of,
    headings,
    nbgrader_of,
    parse,
    source_of,
    without_hidden_tests,
    without_region,
)
from autograder.course.paths import CoursePaths
from autograder.course.settings import read_settings
from autograder.course.versions import digests_by_cell, versions


@cache
def kit_digest() -> str:
    """Return the SHA-256 of the kit's own source. Between two releases the checks change, but the version does not."""
    package = Path(__file__).resolve().parent.parent
    files = sorted(path for path in package.rglob("*") if path.suffix in (".py", ".html", ".xml"))
    parts = [(str(path.relative_to(package)), hashlib.sha256(path.read_bytes()).hexdigest()) for path in files]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


class Cell(BaseModel):
    """One trusted code cell of a lab, in the notebook's order."""

    model_config = ConfigDict(extra="forbid")

    grade_id: str
    title: str = ""
    """The nearest heading above it."""
    points: float | None = None
    """The points of a check; None for a set-up cell, which is run but not graded."""
    source: str
    """The source with the hidden tests and their markers."""


@dataclass(frozen=True)
class Answer:
    """A cell that students fill in."""

    grade_id: str
    cell_type: str
    blank: str
    """The source that students receive."""
    solution: str
    """The source of the model answer, without the markers."""
    file: CellFile | None
    """The file that the blank cell names; None for an answer in plain text."""
    points: float | None
    """The points that a person can give for it; None if it is not graded by hand."""


@dataclass(frozen=True, eq=False)
class Lab:
    """A lab, read from its notebook. `load_lab` returns the same object again if the file has not changed."""

    name: str
    notebook: Path
    raw: dict[str, Any]
    """The notebook's JSON."""
    cells: tuple[Cell, ...]
    """The trusted code cells in the notebook's order: set-up cells and check cells."""
    answers: dict[str, Answer]
    """The answer cells by grade_id, in the notebook's order."""
    given: dict[str, str]
    """The text of each file that a locked cell names, by file name: programs that students use but do not write."""
    released: tuple[dict[str, Any], ...]
    """The cells that students receive."""
    given_out: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """The digests that each cell had in all versions of the lab that students have received, by grade_id."""

    @property
    def points_by_hand(self) -> float:
        """The points of the answers that a person grades."""
        return sum(answer.points or 0.0 for answer in self.answers.values())

    @property
    def checks(self) -> tuple[Cell, ...]:
        """The cells that give points."""
        return tuple(cell for cell in self.cells if cell.points is not None)

    def is_as_given_out(self, grade_id: str, source: str) -> bool:
        """Return whether a cell is as in a version of the lab that students have received, the current one or not."""
        return cell_digest(source) in self._digests_given_out.get(grade_id, ())

    @cached_property
    def _digests_given_out(self) -> dict[str, set[str]]:
        """The digests that each cell has or had, by grade_id. An author's cell has the hidden lines as well."""
        digests = {grade_id: set(earlier) for grade_id, earlier in self.given_out.items()}
        with_hidden_lines = [cell for cell in self.raw["cells"] if grade_id_of(cell) not in self.answers]
        for cell in (*self.released, *with_hidden_lines):
            digests.setdefault(grade_id_of(cell), set()).add(cell_digest(source_of(cell)))
        return digests

    @property
    def max_points(self) -> float:
        """The most points that the checks can give, without those for answers that are graded by hand."""
        return sum(cell.points or 0.0 for cell in self.cells)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over what can change a result: the kit, the trusted cells, the given files, the answer cells and the
        reference packages."""
        parts = [
            kit_digest(),
            [cell.model_dump(exclude={"title"}) for cell in self.cells],
            sorted(self.given.items()),
            [[answer.grade_id, answer.blank] for answer in self.answers.values()],
            sorted(self.reference.items()),
        ]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @cached_property
    def source_digest(self) -> str:
        """SHA-256 over the lab's whole notebook, which the gradebook and the feedback depend on."""
        return hashlib.sha256(json.dumps(self.raw).encode()).hexdigest()

    @cached_property
    def reference(self) -> dict[str, str]:
        """The files of the solution's packages of interfaces, by file name. A student's copy has none of them."""
        solved = self.files_with({name: answer.solution for name, answer in self.answers.items()})
        if solved == self.files_with({name: answer.blank for name, answer in self.answers.items()}):
            return {}
        folders = {name.removesuffix("CMakeLists.txt") for name in solved if name.endswith("/CMakeLists.txt")}
        return {name: text for name, text in solved.items() if any(map(name.startswith, folders))}

    def files_with(self, sources: Mapping[str, str]) -> dict[str, str]:
        """Return the files of a submission by name: the lab's own files and those of the answers.

        Args:
            sources: the source of each answer cell, by grade_id.
        """
        files = dict(self.given)
        for grade_id, answer in self.answers.items():
            file = parse(sources[grade_id]) if answer.file is not None else None
            if file is not None:
                files[file.file_name] = file.text
        return files

    def clean_notebook(self, sources: dict[str, str]) -> dict[str, Any]:
        """Return the released notebook with a student's answers in it, and nothing else from the student."""
        cells = copy.deepcopy(list(self.released))
        for cell in cells:
            grade_id = grade_id_of(cell)
            if grade_id in self.answers and grade_id in sources:
                cell["source"] = sources[grade_id]
        return {
            "cells": cells,
            "metadata": copy.deepcopy(self.raw.get("metadata", {})),
            "nbformat": self.raw.get("nbformat", 4),
            "nbformat_minor": self.raw.get("nbformat_minor", 5),
        }


def lab_names(root: Path) -> list[str]:
    """Return the names of the course's labs in the course's order."""
    found = {
        p.stem for folder in ("solutions", "labs") for p in (root / folder).glob("*/*.ipynb") if p.parent.name == p.stem
    }
    first = [name for name in read_settings(root).labs if name in found]
    return [*first, *sorted(found - set(first))]


def load_lab(root: Path, name: str) -> Lab:
    """Read a lab of the course at `root`.

    Raises:
        KitError: there is no such lab, or its notebook cannot be used. The message says why.
    """
    candidates = [root / folder / name / f"{name}.ipynb" for folder in ("solutions", "labs")]
    notebook = next((path for path in candidates if path.is_file()), None)
    if notebook is None or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        names = ", ".join(lab_names(root)) or "none"
        raise KitError(f"This course has no lab `{name}`.", f"Labs in {root}: {names}.")
    lab = _loaded(name, notebook, signature(notebook), released_only=notebook == candidates[1])
    return _with_versions(lab, root, signature(CoursePaths(root).versions(name)))


@lru_cache(maxsize=32)
def _loaded(name: str, notebook: Path, _signature: object, released_only: bool) -> Lab:
    try:
        raw = json.loads(notebook.read_text(encoding="utf-8"))
        return _read(name, notebook, raw, released_only)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise KitError(f"{notebook} cannot be used as a lab: {error}", "Repair that cell.") from error


@lru_cache(maxsize=32)
def _with_versions(lab: Lab, root: Path, recorded: object) -> Lab:
    return lab if recorded is None else replace(lab, given_out=digests_by_cell(versions(root, lab.name)))


def _read(name: str, notebook: Path, raw: dict[str, Any], released_only: bool) -> Lab:
    cells: list[Cell] = []
    answers: dict[str, Answer] = {}
    given: dict[str, str] = {}
    released: list[dict[str, Any]] = []
    seen: set[str] = set()
    title = ""
    for raw_cell in raw["cells"]:
        cell = copy.deepcopy(raw_cell)
        source = source_of(cell)
        nbgrader = nbgrader_of(cell)
        grade_id = grade_id_of(cell)
        if grade_id in seen:
            raise ValueError(f"two cells have the grade_id `{grade_id}`")
        if grade_id:
            seen.add(grade_id)
        if cell["cell_type"] == "markdown" and not nbgrader.get("solution"):
            title = next((text for _, text in reversed(headings(source))), title)
        blank = source
        points = float(nbgrader["points"]) if nbgrader.get("grade") else None
        if nbgrader.get("solution"):
            # A released notebook holds no solutions, so its answer cells are already what students start from.
            blank = source if released_only else _without_solution(source, cell["cell_type"])
            answers[grade_id] = Answer(
                grade_id, cell["cell_type"], blank, _without_markers(source), _file(grade_id, blank), points
            )
        elif cell["cell_type"] == "code" and (nbgrader.get("locked") or nbgrader.get("grade")):
            blank = without_hidden_tests(source)
            file = _file(grade_id, source)
            if file is not None:
                given[file.file_name] = file.text
            elif not source.lstrip().startswith("%%"):
                cells.append(Cell(grade_id=grade_id, title=title, points=points, source=source))
        if grade_id in answers and answers[grade_id].file is not None:
            cell["metadata"]["autograder"] = blank_mark(blank)
        cell["source"] = blank
        if cell["cell_type"] == "code":
            cell.update(outputs=[], execution_count=None)
        released.append(cell)
    return Lab(name, notebook, raw, tuple(cells), answers, given, tuple(released))


def _file(grade_id: str, source: str) -> CellFile | None:
    try:
        return parse(source)
    except BadNameError as error:
        raise ValueError(f"cell `{grade_id}`: {error}") from error


def _without_solution(source: str, cell_type: str) -> str:
    stub = CODE_STUB if cell_type == "code" else TEXT_STUB
    if "BEGIN SOLUTION" not in source:
        return stub
    return without_region(source, "SOLUTION", stub)


def _without_markers(source: str) -> str:
    lines = source.split("\n")
    return "\n".join(line for line in lines if "BEGIN SOLUTION" not in line and "END SOLUTION" not in line)
