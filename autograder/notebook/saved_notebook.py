"""The notebook on disk, as grading would get it, held against what a cell wrote in the kernel."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autograder.course.cell_file import BadNameError, parse
from autograder.course.lab import blank_mark_of, cell_digest, grade_id_of, nbgrader_of, source_of
from autograder.notebook.program_folder import Written
from autograder.submission.copies import DELETE_COPIES, told_of_copies
from autograder.submission.notebook_file import UnreadableError, cells_of


@dataclass(frozen=True)
class _Cell:
    source: str
    cell_id: str
    grade_id: str
    blank: str
    file_name: str
    altered: bool
    """Whether it is the lab's own, and no longer as students receive it."""


class SavedNotebook:
    """The code cells of a notebook that name files, as saved last."""

    def __init__(self, path: Path) -> None:
        """Read it; a notebook that cannot be read has no cells, and so there is nothing to say."""
        self.path = path
        self.cells: list[_Cell] = []
        self._ids: set[str] = set()
        """Of all cells."""
        self.saved_at = 0.0
        self.readable = False
        try:
            self.saved_at = path.stat().st_mtime
            raw = cells_of(path)
        except (OSError, UnreadableError):
            return
        self.readable = True
        for cell in raw:
            self._take(cell)

    def _take(self, cell: dict[str, Any]) -> None:
        self._ids.add(str(cell.get("id", "")))
        if cell.get("cell_type") != "code":
            return
        try:
            source = source_of(cell)
            file = parse(source)
        except (ValueError, BadNameError):
            return
        if file is None:
            return
        grade_id = grade_id_of(cell) if nbgrader_of(cell).get("solution") or nbgrader_of(cell).get("locked") else ""
        altered = _altered(source, cell)
        self.cells.append(
            _Cell(source, str(cell.get("id", "")), grade_id, blank_mark_of(cell), file.file_name, altered)
        )

    def has(self, file_name: str) -> bool:
        """Whether a cell names this file."""
        return any(cell.file_name == file_name for cell in self.cells)

    def _graded(self, file_name: str) -> _Cell | None:
        """The cell that grading takes this file from."""
        naming = [cell for cell in self.cells if cell.file_name == file_name]
        return next((cell for cell in reversed(naming) if cell.grade_id), naming[-1] if naming else None)

    def _copies(self, graded: _Cell) -> list[_Cell]:
        """The cells that have its grading mark and name its file."""
        mark = (graded.grade_id, graded.file_name)
        return [cell for cell in self.cells if graded.grade_id and (cell.grade_id, cell.file_name) == mark]

    def is_answer(self, written: Written) -> bool:
        """Whether a student's answer is in this file."""
        cell = self._graded(written.file.file_name)
        return cell is not None and bool(cell.blank)

    def is_blank(self, written: Written) -> bool:
        """Whether an answer is still as students receive it."""
        cell = self._graded(written.file.file_name)
        return cell is not None and bool(cell.blank) and cell.blank == cell_digest(written.source)

    def remark(self, written: Written) -> str:
        """Say why what was run is not what would be graded; empty if it is, or will be once it is saved."""
        graded = self._graded(written.file.file_name)
        first = f"%%{written.file.magic} {written.file.name}"
        if graded is None and self.readable and self.saved_at > written.at:
            return (
                f"No cell of the saved notebook begins with `{first}`, so grading has no `{written.file.name}`. That"
                " line has to be the first one of its cell."
            )
        if graded is None:
            return ""
        copies = self._copies(graded)
        copied = f"{told_of_copies(first, len(copies))} {DELETE_COPIES}" if len(copies) > 1 else ""
        if _same(graded.source, written.source):
            theirs = f"The cell `{first}` is the lab's own and has been changed. Grading takes it as you received it."
            return theirs if graded.altered else copied
        known = written.cell_id and graded.cell_id
        ran = next((cell for cell in self.cells if cell.cell_id == written.cell_id), None) if known else None
        if ran in copies and ran is not graded:
            return f"{copied} This report is about another one, cell [{written.number}]."
        if known and graded.grade_id and written.cell_id not in self._ids:
            return (
                f"This `{written.file.name}` comes from cell [{written.number}], which is not in the saved notebook, so"
                " nobody can say whether grading takes that cell. Save the notebook, and run this cell again."
            )
        if known and graded.cell_id != written.cell_id and graded.grade_id:
            return (
                f"This `{written.file.name}` comes from a cell of your own, cell [{written.number}]. Grading ignores"
                f" that cell: it takes the lab's cell that begins with `{first}`. Move your text there."
            )
        if self.saved_at > written.at:
            return (
                f"The cell `{first}` has been changed since it was run, and this report is about the earlier text. Run"
                " that cell, then this one."
            )
        return ""

    def lacks(self, written: Written) -> bool:
        """Whether what was run is not in the saved notebook, because nothing has been saved since."""
        name = written.file.file_name
        saved = any(cell.file_name == name and _same(cell.source, written.source) for cell in self.cells)
        return not saved and self.readable and self.saved_at <= written.at


def _altered(source: str, cell: dict[str, Any]) -> bool:
    """Whether a locked cell's text is another one than nbgrader's checksum in its metadata was made of."""
    marks = nbgrader_of(cell)
    if not marks.get("locked") or marks.get("solution") or marks.get("grade") or not marks.get("checksum"):
        return False
    # As nbgrader computes it for a cell that is locked and nothing else. Importing nbgrader takes a second, for which
    # nobody should wait after a check; a test holds this against every released lab.
    made = f"{source}codeFalseFalseTrue{grade_id_of(cell)}".encode()
    return hashlib.md5(made, usedforsecurity=False).hexdigest() != str(marks["checksum"])


def _same(one: str, other: str) -> bool:
    return cell_digest(one) == cell_digest(other)
