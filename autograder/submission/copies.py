"""Copies of a lab's cell: who copies or splits a cell in Jupyter copies its grading mark along.

Which of them counts is decided here, for grading and for all that a notebook says of itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from autograder.course.cells import CELL_BYTES, CellFile, grade_id_of, nbgrader_of, parse, source_of


def named_file(cell: dict[str, Any]) -> CellFile | None:
    """Return the file that a code cell names, if it does so in a way that the notebook's magics accept."""
    if cell.get("cell_type") != "code":
        return None
    try:
        source = source_of(cell)
        return None if len(source.encode("utf-8")) > CELL_BYTES else parse(source)
    except ValueError:  # BadNameError is one: in the notebook, too, such a cell wrote nothing
        return None


def by_mark(cells: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Return the cells that have a grade_id, by it."""
    found: dict[str, list[dict[str, Any]]] = {}
    for cell in cells:
        if grade_id_of(cell):
            found.setdefault(grade_id_of(cell), []).append(cell)
    return found


def copies_of(marked: Sequence[dict[str, Any]], file_name: str) -> list[dict[str, Any]]:
    """Of the cells with one answer's mark, those that are the answer, in the notebook's order: the last one counts.

    A copy that was given another name is a file of the student's own, and only a code cell is a file. Of an answer that
    is no file, all are.

    Args:
        marked: the cells.
        file_name: of the answer's file; empty if it is none.
    """
    if not file_name:
        return list(marked)
    naming = [cell for cell in marked if (file := named_file(cell)) is not None and file.file_name == file_name]
    return naming or [cell for cell in marked if cell.get("cell_type") == "code"]


def pieces_of(marked: Sequence[dict[str, Any]], file_name: str) -> list[dict[str, Any]]:
    """Of the cells with one answer's mark, those that are left out: pieces that were split off, which name no file."""
    copies = copies_of(marked, file_name)
    return [cell for cell in marked if copies and cell not in copies and not named_file(cell) and _is_written(cell)]


def _is_written(cell: dict[str, Any]) -> bool:
    try:
        return bool(source_of(cell).strip())
    except ValueError:
        return False


@dataclass(frozen=True)
class AnswerCells:
    """What a notebook has of one of the lab's answers."""

    grade_id: str
    file_name: str
    """Of its file; empty if it is none."""
    marked: list[dict[str, Any]]
    """All cells with its mark."""

    @property
    def copies(self) -> list[dict[str, Any]]:
        """Those that are the answer; the last one counts."""
        return copies_of(self.marked, self.file_name)

    def told(self, first: str) -> str:
        """Say what of these cells does not count; empty if all do.

        Args:
            first: the first line of the lab's cell, or the name of one that is no file.
        """
        count, is_file = len(self.copies), bool(self.file_name)
        copied = f"{told_of_copies(first, count, is_file)} {DELETE_COPIES}" if count > 1 else ""
        return " ".join(filter(None, [copied, SPLIT.format(first) if pieces_of(self.marked, self.file_name) else ""]))


def answers_in(cells: Sequence[dict[str, Any]], files: Mapping[str, str]) -> list[AnswerCells]:
    """Return the answers of a notebook in their order.

    Args:
        cells: of the notebook.
        files: of each answer that is one, by grade_id, as the notebook was released; of others a cell says it.
    """
    marked = by_mark([cell for cell in cells if nbgrader_of(cell).get("solution")])
    named = {
        grade_id: next((file.file_name for cell in found if (file := named_file(cell)) is not None), "")
        for grade_id, found in marked.items()
    }
    return [AnswerCells(grade_id, name, marked.get(grade_id, [])) for grade_id, name in (named | dict(files)).items()]


def told_of_copies(name: str, count: int, is_file: bool = True) -> str:
    """Say that there are copies, and which of them counts.

    Args:
        name: of the cell: the first line of one that is a file.
        count: of the copies, the lab's own cell included.
        is_file: whether the answer is a file.
    """
    which = "the last one counts" if is_file else "all of them are read"
    return f"The notebook has {count} copies of the cell `{name}`: {which}."


def told_of_given_copies(grade_id: str, count: int) -> str:
    """Say that there are copies of a cell that belongs to the lab, and which of them counts."""
    return f"There are {count} copies of the cell `{grade_id}`: the lab's own cell is run."


DELETE_COPIES = "Delete the copies that should not count: a copied cell keeps its grading mark."
"""What to do about copies."""
SPLIT = (
    "The cell `{0}` has been split. Grading ignores the piece that does not begin with this line, so merge the pieces."
)
"""What is said of a cell that was split, with its first line."""
