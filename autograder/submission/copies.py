"""Copies of a lab's cells. A cell that is copied or split in Jupyter keeps its grading mark, so several cells have it.

This module decides which of them counts, both for grading and for the notebook's own messages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from autograder.course.cells import CELL_BYTES, CellFile, grade_id_of, nbgrader_of, parse, source_of


def named_file(cell: dict[str, Any]) -> CellFile | None:
    """Return the file that a code cell names; None if it names none, or not in a way that the magics accept."""
    if cell.get("cell_type") != "code":
        return None
    try:
        source = source_of(cell)
        return None if len(source.encode("utf-8")) > CELL_BYTES else parse(source)
    except ValueError:  # such as BadNameError; such a cell writes no file in the notebook either
        return None


def by_mark(cells: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Return the cells that have a grade_id, by their grade_id."""
    found: dict[str, list[dict[str, Any]]] = {}
    for cell in cells:
        if grade_id_of(cell):
            found.setdefault(grade_id_of(cell), []).append(cell)
    return found


def copies_of(marked: Sequence[dict[str, Any]], file_name: str) -> list[dict[str, Any]]:
    """Return the cells that are copies of an answer, in the notebook's order. The last one counts.

    If the answer is a file, only code cells can be copies. A cell that names another file is not a copy but a file that
    the student added. If the answer is not a file, all cells are copies.

    Args:
        marked: the cells with the answer's grading mark.
        file_name: the name of the answer's file; empty if the answer is not a file.
    """
    if not file_name:
        return list(marked)
    naming = [cell for cell in marked if (file := named_file(cell)) is not None and file.file_name == file_name]
    return naming or [cell for cell in marked if cell.get("cell_type") == "code"]


def pieces_of(marked: Sequence[dict[str, Any]], file_name: str) -> list[dict[str, Any]]:
    """Return the code cells that were split off from an answer and name no file, so that they are left out.

    Args:
        marked: the cells with the answer's grading mark.
        file_name: the name of the answer's file; empty if the answer is not a file.
    """
    copies = copies_of(marked, file_name)
    among = {id(cell) for cell in copies}  # to compare thousands of cells with each other would take hours
    code = [cell for cell in marked if cell.get("cell_type") == "code" and id(cell) not in among]
    return [cell for cell in code if copies and not named_file(cell) and _is_written(cell)]


def _is_written(cell: dict[str, Any]) -> bool:
    try:
        return bool(source_of(cell).strip())
    except ValueError:
        return False


@dataclass(frozen=True)
class AnswerCells:
    """The cells in a notebook that belong to one of the lab's answers."""

    grade_id: str
    file_name: str
    """The name of the answer's file; empty if the answer is not a file."""
    marked: list[dict[str, Any]]
    """All cells with the answer's grading mark."""

    @property
    def copies(self) -> list[dict[str, Any]]:
        """The cells that are copies of the answer. The last one counts."""
        return copies_of(self.marked, self.file_name)

    def told(self, first: str) -> str:
        """Say which of these cells do not count; empty if all of them count.

        Args:
            first: the first line of the lab's cell; if the answer is not a file, the cell's name.
        """
        count, is_file = len(self.copies), bool(self.file_name)
        copied = f"{told_of_copies(first, count, is_file)} {DELETE_COPIES}" if count > 1 else ""
        return " ".join(filter(None, [copied, SPLIT.format(first) if pieces_of(self.marked, self.file_name) else ""]))


def answers_in(cells: Sequence[dict[str, Any]], files: Mapping[str, str]) -> list[AnswerCells]:
    """Return the answers of a notebook in their order.

    Args:
        cells: the notebook's cells.
        files: the file names of the answers by grade_id, as the notebook was released. For an answer that is not
            listed, the file name is taken from a cell.
    """
    marked = by_mark([cell for cell in cells if nbgrader_of(cell).get("solution")])
    named = {
        grade_id: next((file.file_name for cell in found if (file := named_file(cell)) is not None), "")
        for grade_id, found in marked.items()
    }
    return [AnswerCells(grade_id, name, marked.get(grade_id, [])) for grade_id, name in (named | dict(files)).items()]


def told_of_copies(name: str, count: int, is_file: bool = True) -> str:
    """Say that a cell has copies, and which of them counts.

    Args:
        name: the first line of the cell if it is a file, and otherwise its name.
        count: the number of copies, including the lab's own cell.
        is_file: whether the answer is a file.
    """
    which = "the last one counts" if is_file else "all of them are read"
    return f"The notebook has {count} copies of the cell `{name}`: {which}."


def told_of_given_copies(grade_id: str, count: int) -> str:
    """Say that a cell of the lab that is no answer has copies, and that the lab's own cell is run."""
    return f"There are {count} copies of the cell `{grade_id}`: the lab's own cell is run."


DELETE_COPIES = "Delete the copies that should not count: a copied cell keeps its grading mark."
"""The hint for a cell that has copies."""
SPLIT = (
    "The cell `{0}` has been split. Grading ignores the piece that does not begin with this line, so merge the pieces."
)
"""The sentence about a cell that was split; `{0}` is the first line of the cell."""
