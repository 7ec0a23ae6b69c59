"""How far a student has come with a lab: its checks, its texts, and what was predicted and what was measured."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.core.results import CellResult
from autograder.course.lab import TEXT_STUB, cell_digest, grade_id_of, nbgrader_of, source_of
from autograder.report import words
from autograder.report.words import Verdict
from autograder.submission.notebook_file import cells_of

_HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*\s*$", re.MULTILINE)
_GUESS = re.compile(r"_predicted$")
_FACT = re.compile(r"_(measured|seen)$")


@dataclass(frozen=True)
class Report:
    """What the check of a cell said last."""

    result: CellResult
    number: int
    """In the brackets beside the cell when it was run."""


@dataclass(frozen=True)
class Row:
    """A check, or a text that a person reads."""

    title: str
    verdict: Verdict | None
    """None: it has not been run in this kernel, or is a text."""
    said: str
    """What became of it, in words."""
    points: str
    done: bool


@dataclass(frozen=True)
class Guess:
    """What was predicted, and what was measured; empty where the table says nothing yet."""

    name: str
    predicted: str
    measured: str

    @property
    def said(self) -> str:
        """Whether they agree, in a word."""
        if not self.predicted or not self.measured:
            return "open"
        return "as predicted" if self.predicted == self.measured else "otherwise"


@dataclass
class LabState:
    """All that `%lab` shows."""

    title: str = ""
    rows: list[Row] = field(default_factory=list)
    guesses: list[Guess] = field(default_factory=list)
    sure: float = 0.0
    later: float = 0.0
    """Points that grading may give as well."""
    possible: float = 0.0
    """Points that the checks can give."""

    @property
    def next(self) -> str:
        """The first part that is open; empty if none is."""
        return next((row.title for row in self.rows if not row.done), "")

    @property
    def summary(self) -> str:
        """The points, and how much is done, in a sentence."""
        done = sum(row.done for row in self.rows)
        later = f", up to {self.later:g} more decided at grading" if self.later else ""
        return f"{done} of {len(self.rows)} parts done · {self.sure:g} of {self.possible:g} points{later}"


def lab_state(notebook: Path, reports: Mapping[str, Report], runs: Mapping[str, int], files: Path) -> LabState:
    """Return the state of the lab in a notebook.

    Args:
        notebook: as it was saved last.
        reports: what the checks said in this kernel, by `cell_digest`.
        runs: in which number a file was written in this kernel, by file name.
        files: the folder that the cells write to.

    Raises:
        UnreadableError: it is no notebook.
    """
    state = LabState()
    title, newest = "", 0
    for cell in cells_of(notebook):
        source, marks = source_of(cell), nbgrader_of(cell)
        if cell.get("cell_type") == "markdown" and not marks.get("solution"):
            for heading in _HEADING.findall(source):
                title = heading
                state.title = state.title or heading
        elif marks.get("solution"):
            named = re.match(r"%%(node|file)\s+(\S+)", source)
            if named:
                newest = max(newest, runs.get(f"{named[2]}.py" if named[1] == "node" else named[2], 0))
        if not marks.get("points"):
            continue
        full = float(marks["points"])
        if marks.get("solution"):
            state.rows.append(_text(title or grade_id_of(cell), source, full))
        elif marks.get("grade"):
            state.rows.append(_check(title or grade_id_of(cell), reports.get(cell_digest(source)), newest, full, state))
            newest = 0
    state.guesses = _guesses(files)
    return state


def _text(title: str, source: str, full: float) -> Row:
    written = source.strip() not in ("", TEXT_STUB)
    points = f"{full:g} point{'' if full == 1 else 's'}, given by a person"
    return Row(title, None, "written" if written else "not written yet", points, written)


def _check(title: str, report: Report | None, newest: int, full: float, state: LabState) -> Row:
    state.possible += full
    points = f"{full:g} point{'' if full == 1 else 's'}"
    if report is None:
        return Row(title, None, "not checked since the kernel started", points, False)
    verdict = words.verdict(report.result)
    if newest > report.number:
        return Row(title, None, f"{verdict}, but a cell above was run again since", points, False)
    sure = report.result.sure_points or 0.0
    state.sure += sure
    if report.result.more_at_grading:
        state.later += report.result.possible_points - sure
    done = verdict in (Verdict.PASSED, Verdict.HOLDS)
    return Row(title, verdict, str(verdict), words.points(report.result), done)


def _guesses(folder: Path) -> list[Guess]:
    found: dict[tuple[str, str], dict[str, str]] = {}
    for path in sorted(folder.glob("*.y*ml")):
        try:
            table = student_yaml.read(path, table=True)
        except student_yaml.StudentFileError:
            continue
        for key, value in (table if isinstance(table, dict) else {}).items():
            for kind, suffix in (("predicted", _GUESS), ("measured", _FACT)):
                if suffix.search(key) or suffix.search(path.stem):
                    where = (suffix.sub("", path.stem), suffix.sub("", key))
                    found.setdefault(where, {})[kind] = _shown(value)
    return [Guess(key, said.get("predicted", ""), said.get("measured", "")) for (_, key), said in found.items()]


def _shown(value: Any) -> str:
    text = "" if value is None or value == "?" else str(value)
    return " ".join(text.split())[:60]
