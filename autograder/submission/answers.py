"""Takes the answers out of a submitted notebook: the source of the lab's own cells, found by grade_id."""

from __future__ import annotations

from typing import Any

from autograder.course.cells import CELL_BYTES, grade_id_of, nbgrader_of, source_of
from autograder.course.lab import Lab
from autograder.reasons import Group, Kind
from autograder.submission.copies import (
    DELETE_COPIES,
    SPLIT,
    by_mark,
    copies_of,
    pieces_of,
    told_of_copies,
    told_of_given_copies,
)
from autograder.submission.notebook_file import NOT_A_NOTEBOOK, UnreadableError, problem
from autograder.submission.submission import Submission

WRONG_NOTEBOOK = Kind(
    "wrong-notebook", "it is another notebook, or hardly a cell of the lab is left in it", Group.NOTEBOOK
)
FORGED_CELL = Kind("forged-cell", "a cell has a grading mark that the lab does not know", Group.NOTEBOOK)
SPLIT_CELL = Kind(
    "split-cell", "an answer's cell was split; the piece without its first line is left out", Group.NOTEBOOK
)
DUPLICATED_CELL = Kind("duplicated-cell", "a cell with a grading mark is there more than once", Group.NOTEBOOK)
FORGED_FLAGS = Kind("forged-flags", "a cell's grading marks are not the lab's", Group.NOTEBOOK)
MISSING_CELL = Kind("missing-cell", "an answer's cell was deleted, or is no code cell any more", Group.NOTEBOOK)
OVERSIZED_CELL = Kind("oversized-cell", "a cell is larger than is read", Group.NOTEBOOK)
CHANGED_CELL = Kind("changed-cell", "a check cell was edited; the lab's own is run", Group.NOTEBOOK)


def take_answers(cells: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    """Put the sources of a notebook's answer cells into a submission.

    Raises:
        UnreadableError: no cell of it belongs to the lab.
    """
    released = {grade_id_of(cell): cell for cell in lab.released if grade_id_of(cell)}
    found = by_mark(cells)
    ours = lab.answers.keys() | {cell.grade_id for cell in lab.checks}
    # Labs may have names of cells in common. Of another lab's notebook most are unknown here, and most answers of
    # this one are missing.
    known, answers = len(found.keys() & ours), len(found.keys() & lab.answers.keys())
    if not known or (2 * known < len(found.keys() - (released.keys() - ours)) and 2 * answers < len(lab.answers)):
        raise UnreadableError(
            problem(
                f"the notebook is {lab.name}",
                WRONG_NOTEBOOK(
                    f"Hardly a cell of it belongs to {lab.name}: it is another notebook, or the graded cells were"
                    " deleted.",
                    f"Start from labs/{lab.name}/{lab.name}.ipynb and submit that notebook.",
                ),
            )
        )
    forged = sorted(found.keys() - released.keys())
    if forged:
        listed = ", ".join(f"`{grade_id[:40]}`" for grade_id in forged[:5]) + (", …" if len(forged) > 5 else "")
        submission.problems.append(
            problem(
                "every graded cell belongs to the lab",
                FORGED_CELL(
                    f"The lab has no graded cell {listed}: ignored.",
                    "Use ordinary cells for your own notes and experiments.",
                ),
            )
        )
    for grade_id, original in released.items():
        _take_cell(grade_id, original, found.get(grade_id, []), lab, submission)


def _take_cell(
    grade_id: str, original: dict[str, Any], marked: list[dict[str, Any]], lab: Lab, submission: Submission
) -> None:
    answer = lab.answers.get(grade_id)
    file = answer.file if answer is not None else None
    name = f"%%{file.magic} {file.name}" if file is not None else grade_id
    copies = marked
    if answer is not None:
        copies = copies_of(marked, file.file_name if file is not None else "")
    if file is not None and pieces_of(marked, file.file_name):
        title = f"the cell `{grade_id}` is in one piece"
        submission.problems.append(problem(title, SPLIT_CELL(SPLIT.format(name))))
    if len(copies) > 1:
        because = told_of_given_copies(grade_id, len(copies))
        if answer is not None:
            because = told_of_copies(name, len(copies), is_file=file is not None)
        submission.problems.append(problem(f"there is one cell `{grade_id}`", DUPLICATED_CELL(because, DELETE_COPIES)))
    flags = ("grade", "solution", "locked")
    meant = {flag: bool(nbgrader_of(original).get(flag, False)) for flag in flags}
    if any({flag: bool(nbgrader_of(cell).get(flag, False)) for flag in flags} != meant for cell in copies):
        submission.problems.append(
            problem(
                f"the cell `{grade_id}` is marked as in the lab",
                FORGED_FLAGS(
                    f"The grading marks of the cell `{grade_id}` were changed; the lab's own marks count.",
                ),
            )
        )
    if answer is None:
        _compare(grade_id, copies, lab, submission)
        return
    if not copies:
        because = f"The answer cell `{grade_id}` was deleted: there is no answer to grade."
        hint = f"Copy the cell from a fresh labs/{lab.name}/{lab.name}.ipynb."
        if marked:
            because = f"The answer cell `{grade_id}` is no code cell any more: there is no answer to grade."
            hint = "Select the cell and make it a code cell again (key Y)."
        submission.problems.append(problem(f"the answer cell `{grade_id}` is there", MISSING_CELL(because, hint)))
        return
    try:
        # A text may have been split or begun anew: whoever reads it decides.
        texts = [source_of(cell) for cell in (copies if answer.file is None else copies[-1:])]
        written = [text for text in texts if text.strip() != answer.blank.strip()] or texts[:1]
        source = "\n\n".join(dict.fromkeys(written))
    except ValueError:
        submission.problems.append(
            problem(f"the cell `{grade_id}` holds text", NOT_A_NOTEBOOK(f"The cell `{grade_id}` holds no text."))
        )
        return
    if len(source.encode("utf-8")) > CELL_BYTES:
        submission.problems.append(
            problem(
                f"the cell `{grade_id}` is at most {CELL_BYTES // 1024} KiB",
                OVERSIZED_CELL(
                    f"The cell `{grade_id}` is larger than {CELL_BYTES // 1024} KiB; it is not graded.",
                ),
            )
        )
        return
    submission.sources[grade_id] = source


def _compare(grade_id: str, copies: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    """Report an edited check cell; a deleted one does no harm, because the lab's own cell is run anyway.

    Not edited is also the cell of the lab's source, hidden lines included: who writes a lab checks that notebook.
    """

    def text(cell: dict[str, Any]) -> list[str]:
        try:
            return [line.rstrip() for line in source_of(cell).rstrip().split("\n")]
        except ValueError:
            return []

    originals = [text(cell) for cell in (*lab.released, *lab.raw["cells"]) if grade_id_of(cell) == grade_id]
    if any(text(cell) not in originals for cell in copies):
        submission.problems.append(
            problem(
                f"the cell `{grade_id}` is as in the lab",
                CHANGED_CELL(
                    f"The cell `{grade_id}` was edited; the lab's own cell is run instead.",
                ),
            )
        )
