"""A student's progress in a lab: its checks, its texts, and what was predicted and measured."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.core.results import CellResult
from autograder.course.cells import TEXT_STUB, cell_digest, grade_id_of, headings, nbgrader_of, source_of
from autograder.reasons import Refused
from autograder.report import words
from autograder.report.words import Verdict
from autograder.submission.copies import answers_in, named_file
from autograder.submission.notebook_file import last_saved

_PART = 2
"""The level of the headings of a lab's parts."""
_GUESS = re.compile(r"(^|_)predicted$")
_FACT = re.compile(r"(^|_)(measured|seen)$")


@dataclass(frozen=True)
class Report:
    """The last result of the check of a cell."""

    result: CellResult | None
    """The result; None if the check was interrupted."""
    number: int
    """The number in the brackets beside the cell when it was run."""


@dataclass(frozen=True)
class Row:
    """A check, or a text that a person grades."""

    title: str
    verdict: Verdict | None
    """The verdict of a check; None for a text, and for a check without a current verdict from this kernel."""
    said: str
    """The state of the check or text, in words."""
    points: str
    done: bool
    sure: float = 0.0
    later: float = 0.0
    """The additional points that grading may give."""
    possible: float = 0.0
    """The points that the check can give; 0 for a text, whose points a person gives."""


@dataclass(frozen=True)
class Part:
    """The tasks below one of the lab's larger headings."""

    title: str
    rows: list[Row] = field(default_factory=list)

    @property
    def heading(self) -> str:
        """The title, or an empty text if the only row has the same title."""
        return "" if [row.title for row in self.rows] == [self.title] else self.title

    @property
    def points(self) -> str:
        """The points of the checks in words; empty if there are no checks."""
        return _points(self.rows) if any(row.possible for row in self.rows) else ""


@dataclass(frozen=True)
class Guess:
    """A prediction and a measurement; each is empty if the student has not written it yet."""

    name: str
    predicted: str
    measured: str

    @property
    def said(self) -> str:
        """Whether the two agree, in words."""
        if not self.predicted or not self.measured:
            return "open"
        return "as predicted" if self.predicted == self.measured else "otherwise"


@dataclass
class LabState:
    """Everything that `%lab` shows."""

    title: str = ""
    parts: list[Part] = field(default_factory=list)
    guesses: list[Guess] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """Sentences about what was run, or is in the notebook, but would not be graded."""

    @property
    def rows(self) -> list[Row]:
        """The rows of all parts."""
        return [row for part in self.parts for row in part.rows]

    @property
    def next(self) -> str:
        """The first open task; empty if there is none."""
        for part in self.parts:
            for row in part.rows:
                if not row.done:
                    return f"{row.title} (in “{part.heading}”)" if part.heading not in ("", row.title) else row.title
        return ""

    @property
    def summary(self) -> str:
        """The number of tasks that are done, and the points, in words."""
        done = sum(row.done for row in self.rows)
        return f"{done} of {len(self.rows)} tasks done · {_points(self.rows)}"


def _points(rows: Sequence[Row]) -> str:
    sure, later, possible = (sum(getattr(row, name) for row in rows) for name in ("sure", "later", "possible"))
    more = f", and up to {later:g} more, decided when the lab is graded" if later else ""
    return f"{sure:g} of {possible:g} point{'' if possible == 1 else 's'}{more}"


def lab_state(notebook: Path, reports: Mapping[str, Report], runs: Mapping[str, int], files: Path) -> LabState:
    """Return the state of the lab in a notebook.

    Args:
        notebook: the path of the notebook, which is read as it was last saved.
        reports: the last reports of the checks in this kernel, by `cell_digest`.
        runs: the number of the run that wrote each file in this kernel, by file name.
        files: the folder to which the cells write.

    Raises:
        UnreadableError: the file is not a notebook.
    """
    state = LabState()
    saved = last_saved(notebook)
    cells = saved.cells
    texts, state.notes = _texts(cells, saved.released_files)
    title, part, newest = "", "", 0
    seen: set[str] = set()
    for cell in cells:
        source, marks = source_of(cell), nbgrader_of(cell)
        if cell.get("cell_type") == "markdown" and not marks.get("solution"):
            for level, heading in headings(source):
                title = words.plain_title(heading)
                part = title if level <= _PART else part
                state.title = state.title or title
        elif marks.get("solution"):
            file = named_file(cell)
            newest = max(newest, runs.get(file.file_name, 0) if file else 0)
        if not marks.get("points") or grade_id_of(cell) in seen:
            continue
        seen.add(grade_id_of(cell))
        if not state.parts or state.parts[-1].title != part:
            state.parts.append(Part(part))
        rows, full = state.parts[-1].rows, float(marks["points"])
        if marks.get("solution"):
            rows.append(_text(title or grade_id_of(cell), texts[grade_id_of(cell)], full))
        elif marks.get("grade"):
            rows.append(_check(title or grade_id_of(cell), reports.get(cell_digest(source)), newest, full))
            newest = 0
    state.guesses = _guesses(files)
    return state


def _texts(cells: Sequence[dict[str, Any]], files: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Return the texts of the answers by their grade_id, and notes about answers that have several copies."""
    texts, notes = {}, []
    for answer in answers_in(cells, files):
        file = next((file for cell in answer.copies if (file := named_file(cell)) is not None), None)
        told = answer.told(f"%%{file.magic} {file.name}" if file is not None else answer.grade_id)
        if told:
            notes.append(told)
        sources = list(dict.fromkeys(map(source_of, answer.copies)))
        texts[answer.grade_id] = "\n\n".join([text for text in sources if _is_written(text)] or sources[:1])
    return texts, notes


def _is_written(text: str) -> bool:
    return text.strip() not in ("", TEXT_STUB)


def _text(title: str, source: str, full: float) -> Row:
    written = _is_written(source)
    points = f"{full:g} point{'' if full == 1 else 's'}, given by a person"
    return Row(title, None, "written" if written else "not written yet", points, written)


def _check(title: str, report: Report | None, newest: int, full: float) -> Row:
    points = f"{full:g} point{'' if full == 1 else 's'}"
    if report is None:
        return Row(title, None, "not run in this kernel", points, False, possible=full)
    if report.result is None:
        return Row(title, None, "interrupted, no verdict", points, False, possible=full)
    verdict = words.verdict(report.result)
    if newest > report.number:
        return Row(title, None, f"{verdict}, but a cell above was run again since", points, False, possible=full)
    sure = report.result.sure_points or 0.0
    later = report.result.possible_points - sure if report.result.more_at_grading else 0.0
    done = verdict in (Verdict.PASSED, Verdict.HOLDS)
    return Row(title, verdict, str(verdict), words.points(report.result), done, sure, later, full)


def _guesses(folder: Path) -> list[Guess]:
    found: dict[tuple[str, str], dict[str, str]] = {}
    for path in sorted(folder.glob("*.y*ml")):
        try:
            table = student_yaml.read(path, table=True)
        except Refused:
            continue
        for question, value in (table if isinstance(table, dict) else {}).items():
            key = str(question)  # in YAML, a key can also be a number or a truth value
            for kind, suffix in (("predicted", _GUESS), ("measured", _FACT)):
                if suffix.search(key) or suffix.search(path.stem):
                    where = (suffix.sub("", path.stem), suffix.sub("", key))
                    found.setdefault(where, {})[kind] = _shown(value)
    return [Guess(key, said.get("predicted", ""), said.get("measured", "")) for (_, key), said in found.items()]


def _shown(value: Any) -> str:
    """Return a value as the student wrote it, or an empty text if a part of it is still open."""
    values = value if isinstance(value, list) else [value]
    if any(one in (None, "?") for one in values):
        return ""
    text = ", ".join({True: "yes", False: "no"}[one] if isinstance(one, bool) else str(one) for one in values)
    return " ".join(text.split())[:60]
