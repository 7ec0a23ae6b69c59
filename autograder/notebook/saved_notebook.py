"""Compares the notebook on disk, which is what grading would get, with what cells wrote in the kernel."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autograder.course.cells import blank_mark_of, cell_digest, grade_id_of, nbgrader_of, source_of
from autograder.notebook.program_folder import Written
from autograder.submission.copies import DELETE_COPIES, AnswerCells, answers_in, named_file, told_of_given_copies
from autograder.submission.notebook_file import UnreadableError, last_saved


@dataclass(frozen=True)
class _Cell:
    raw: dict[str, Any]
    source: str
    file_name: str
    altered: bool
    """Whether the cell belongs to the lab and is no longer as students receive it."""

    @property
    def cell_id(self) -> str:
        return str(self.raw.get("id", ""))

    @property
    def blank(self) -> str:
        return blank_mark_of(self.raw)

    @property
    def given(self) -> str:
        """The grade_id of a cell with one of the lab's own files; empty for every other cell."""
        marks = nbgrader_of(self.raw)
        return grade_id_of(self.raw) if marks.get("locked") and not marks.get("solution") else ""


class SavedNotebook:
    """The code cells that name files in a notebook, as it was last saved."""

    def __init__(self, path: Path) -> None:
        """Read the notebook. If it cannot be read, it has no cells, so that there are no remarks."""
        self.path = path
        self.cells: list[_Cell] = []
        self._ids: set[str] = set()
        """The IDs of all cells."""
        self._answers: dict[str, AnswerCells] = {}
        """The cells of each answer, by the name of its file."""
        self.saved_at = 0.0
        self.readable = False
        try:
            saved = last_saved(path)
        except UnreadableError:
            return
        raw, self.saved_at = saved.cells, saved.at
        answers = answers_in(raw, saved.released_files)
        self.readable = True
        self._ids = {str(cell.get("id", "")) for cell in raw}
        self._answers = {answer.file_name: answer for answer in answers if answer.file_name}
        for cell in raw:
            file = named_file(cell)
            if file is not None:
                source = source_of(cell)
                self.cells.append(_Cell(cell, source, file.file_name, _altered(source, cell)))

    def has(self, file_name: str) -> bool:
        """Whether a cell names this file."""
        return any(cell.file_name == file_name for cell in self.cells)

    def _graded(self, file_name: str) -> _Cell | None:
        """Return the cell from which grading takes this file."""
        naming = [cell for cell in self.cells if cell.file_name == file_name]
        answer = self._answers.get(file_name)
        if answer is not None:
            return next((cell for cell in naming if any(cell.raw is counts for counts in answer.copies[-1:])), None)
        return next((cell for cell in reversed(naming) if cell.given), naming[-1] if naming else None)

    def _copied(self, graded: _Cell, first: str) -> str:
        """Say that there are copies of a cell, and which of them counts; the text is empty if there are none."""
        answer = self._answers.get(graded.file_name)
        if answer is not None:
            return answer.told(first)
        count = sum(cell.given == graded.given for cell in self.cells) if graded.given else 0
        return f"{told_of_given_copies(graded.given, count)} {DELETE_COPIES}" if count > 1 else ""

    def is_answer(self, written: Written) -> bool:
        """Whether this file contains a student's answer."""
        cell = self._graded(written.file.file_name)
        return cell is not None and bool(cell.blank)

    def is_blank(self, written: Written) -> bool:
        """Whether an answer is still as students receive it."""
        cell = self._graded(written.file.file_name)
        return cell is not None and bool(cell.blank) and cell.blank == cell_digest(written.source)

    def remark(self, written: Written) -> str:
        """Say why what was run is not what would be graded.

        The text is empty if it is, or will be after the notebook is saved.
        """
        graded = self._graded(written.file.file_name)
        answer = self._answers.get(written.file.file_name)
        first = f"%%{written.file.magic} {written.file.name}"
        if graded is None:
            return self._why_ungraded(written, answer, first) if self.readable else ""
        copied = self._copied(graded, first)
        if _same(graded.source, written.source):
            theirs = f"The cell `{first}` belongs to the lab and has been changed. Grading uses it as you received it."
            return theirs if graded.altered else copied
        known = written.cell_id and graded.cell_id
        ours = answer is not None or graded.given
        copies = [str(cell.get("id", "")) for cell in answer.copies] if answer is not None else []
        if known and written.cell_id != graded.cell_id and written.cell_id in copies:
            return f"{copied} This report is about another one, cell [{written.number}]."
        if known and copied and answer is not None and written.cell_id in {one.get("id") for one in answer.marked}:
            return copied  # it was split since: in JupyterLab, the last piece keeps the id and the first gets another
        if known and ours and written.cell_id not in self._ids and self.saved_at > written.at:
            return (
                f"`{written.file.name}` was written by a cell that is no longer in the notebook. Grading uses the lab's"
                f" cell that begins with `{first}`. Run that cell, and then this check."
            )
        if known and ours and written.cell_id not in self._ids:
            return (
                f"`{written.file.name}` was written by cell [{written.number}], which is not in the saved notebook, so"
                " the kit cannot tell whether grading uses that cell. Save the notebook, and run this cell again."
            )
        if known and graded.cell_id != written.cell_id and ours:
            return (
                f"`{written.file.name}` was written by a cell of your own, cell [{written.number}]. Grading ignores"
                f" that cell and uses the lab's cell that begins with `{first}`. Move your text there."
            )
        if self.saved_at > written.at:
            return (
                f"The cell `{first}` has been changed since it was run, and this report is about the earlier text. Run"
                " that cell, then this one."
            )
        return ""

    def _why_ungraded(self, written: Written, answer: AnswerCells | None, first: str) -> str:
        """Say why grading finds no cell for a file that was written."""
        none = f"so grading has no `{written.file.name}`."
        if answer is None:
            unnamed = f"No cell of the saved notebook begins with `{first}`, {none}"
            return f"{unnamed} That line has to be the first one of its cell." if self.saved_at > written.at else ""
        if not answer.marked:
            return (
                f"The lab's cell for this answer, `{answer.grade_id}`, was deleted, {none} It ignores a cell of your"
                " own. Undo the deletion, or copy the cell from a fresh copy of the lab's notebook."
            )
        if not answer.copies:
            return (
                f"The cell for this answer, `{answer.grade_id}`, is no longer a code cell, {none} Select the cell and"
                " make it a code cell again (key Y)."
            )
        if self.saved_at <= written.at and written.cell_id in {cell.get("id") for cell in answer.copies}:
            return ""  # the cell has its first line again, but is not saved yet
        return (
            f"The cell for this answer, `{answer.grade_id}`, no longer begins with `{first}`, {none} Grading ignores"
            f" all other cells. Begin the cell `{answer.grade_id}` with this line again, and put your text below it."
        )

    def lacks(self, written: Written) -> bool:
        """Whether what was run is missing in the saved notebook because it has not been saved since."""
        name = written.file.file_name
        saved = any(cell.file_name == name and _same(cell.source, written.source) for cell in self.cells)
        return not saved and self.readable and self.saved_at <= written.at


def _altered(source: str, cell: dict[str, Any]) -> bool:
    """Whether a locked cell's text does not match nbgrader's checksum in the cell's metadata."""
    marks = nbgrader_of(cell)
    if not marks.get("locked") or marks.get("solution") or marks.get("grade") or not marks.get("checksum"):
        return False
    # nbgrader computes it like this for a cell that is only locked. It is computed here because importing nbgrader
    # takes a second, which is too long after a check. A test compares this with every released lab.
    made = f"{source}codeFalseFalseTrue{grade_id_of(cell)}".encode()
    return hashlib.md5(made, usedforsecurity=False).hexdigest() != str(marks["checksum"])


def _same(one: str, other: str) -> bool:
    return cell_digest(one) == cell_digest(other)
