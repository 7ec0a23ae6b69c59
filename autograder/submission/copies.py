"""Copies of a lab's cell: who copies or splits a cell in Jupyter copies its grading mark along.

Which of them counts is decided here, for grading and for all that a notebook says of itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from autograder.course.cell_file import CELL_BYTES, CellFile, parse
from autograder.course.lab import source_of


def named_file(cell: dict[str, Any]) -> CellFile | None:
    """Return the file that a code cell names, if it does so in a way that the notebook's magics accept."""
    if cell.get("cell_type") != "code":
        return None
    try:
        source = source_of(cell)
        return None if len(source.encode("utf-8")) > CELL_BYTES else parse(source)
    except ValueError:  # BadNameError is one: in the notebook, too, such a cell wrote nothing
        return None


def copies_of(marked: Sequence[dict[str, Any]], file_name: str) -> list[dict[str, Any]]:
    """Of the cells with one answer's mark, those that are the answer, in the notebook's order: the last one counts.

    A copy that was given another name is a file of the student's own. Of an answer that is no file, all are.

    Args:
        marked: the cells.
        file_name: of the answer's file; empty if it is none.
    """
    naming = [cell for cell in marked if (file := named_file(cell)) is not None and file.file_name == file_name]
    return (naming if file_name else []) or list(marked)


def told_of_copies(name: str, count: int, is_file: bool = True) -> str:
    """Say that there are copies, and which of them counts.

    Args:
        name: of the cell: the first line of one that is a file.
        count: of the copies, the lab's own cell included.
        is_file: whether the answer is a file.
    """
    which = "the last one counts" if is_file else "all of them are read"
    return f"The notebook has {count} copies of the cell `{name}`: {which}."


DELETE_COPIES = "Delete the copies that are not meant: a copied cell takes its grading mark along."
"""What to do about copies."""
