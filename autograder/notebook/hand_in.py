"""Finds what is unsaved, not run, outdated, ignored or empty in a notebook that a student hands in."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.course.cells import BadNameError, CellFile, blank_mark, cell_digest, grade_id_of, parse
from autograder.course.lab import Answer, Lab
from autograder.notebook.program_folder import NODES, Ran, read_runs
from autograder.submission.copies import copies_of
from autograder.submission.notebook_file import UnreadableError, cells_of
from autograder.submission.reader import read_submission


@dataclass
class HandIn:
    """Sentences about a notebook. None of them prevents the notebook from being handed in."""

    unsaved: list[str] = field(default_factory=list)
    outdated: list[str] = field(default_factory=list)
    unrun: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    empty: list[str] = field(default_factory=list)

    @property
    def warnings(self) -> list[str]:
        """All sentences, the most important ones first."""
        return [*self.unsaved, *self.ignored, *self.outdated, *self.unrun, *self.empty]


def look_over(notebook: Path, lab: Lab, packed: Path) -> HandIn:
    """Return what the student should be told about a notebook.

    Args:
        notebook: the path of the notebook. The folder of the files that its cells have written is beside it.
        lab: the lab of the notebook.
        packed: the copy of the notebook that is handed in.
    """
    found = HandIn()
    submission = read_submission(packed, lab)
    for problem in submission.problems:
        found.ignored.append(" ".join(text for text in (problem.because, problem.hint) if text))
    try:
        saved = cells_of(packed)
    except UnreadableError:
        return found
    saved_at = notebook.stat().st_mtime
    untouched: list[str] = []
    unrun: list[str] = []
    runs = read_runs(notebook.parent / NODES / notebook.stem)
    cells = {grade_id_of(cell): cell for cell in saved}
    for answer in lab.answers.values():
        marked = [cell for cell in saved if grade_id_of(cell) == answer.grade_id]
        # A cell that has become Markdown is no copy; that the answer is missing is among the problems.
        if copies := copies_of(marked, answer.file.file_name if answer.file else ""):
            cells[answer.grade_id] = copies[-1]
            source = submission.sources[answer.grade_id]
            _look_at_answer(answer, cells[answer.grade_id], source, runs, saved_at, found, untouched, unrun)
    if untouched:
        found.empty.append(_of_all(untouched, "is still as you received it.", "are still as you received them."))
    if unrun:
        found.unrun.append(_of_all(unrun, "has not been run.", "have not been run."))
    found.outdated += _older_checks(lab, cells)
    return found


def _look_at_answer(
    answer: Answer,
    cell: dict[str, Any],
    source: str,
    runs: dict[str, Ran],
    saved_at: float,
    found: HandIn,
    untouched: list[str],
    unrun: list[str],
) -> None:
    name = f"`%%{answer.file.magic} {answer.file.name}`" if answer.file else f"`{answer.grade_id}`"
    if cell_digest(source) in (blank_mark(answer.blank)["blank"], cell_digest("")):
        untouched.append(name)
    elif answer.file is None:
        return
    elif (ran := runs.get(answer.file.file_name)) is None:
        if cell.get("execution_count") is None:
            unrun.append(name)
    elif ran.sha256 != _digest(source, answer.file):
        clock = time.strftime("%H:%M:%S", time.localtime(ran.at))
        if ran.at > saved_at:
            found.unsaved.append(
                f"The cell {name} was run at {clock} with a text that is not in the saved notebook. Save the notebook,"
                " and submit it again."
            )
        else:
            found.outdated.append(
                f"The cell {name} has been changed since it was run at {clock}, so the results that you saw belong to"
                " the earlier text. The saved text is handed in."
            )


def _of_all(names: list[str], of_one: str, of_several: str) -> str:
    return f"The cell {names[0]} {of_one}" if len(names) == 1 else f"The cells {', '.join(names)} {of_several}"


def _digest(source: str, file: CellFile) -> str:
    try:
        now = parse(source)
    except BadNameError:
        now = None
    text = (now or file).text
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


def _older_checks(lab: Lab, cells: dict[str, dict[str, Any]]) -> list[str]:
    """Return a sentence that names the checks that were run before a cell between them and the check above.

    The list is empty if there are no such checks.
    """
    older = []
    newest = 0
    checks = {check.grade_id: check.title for check in lab.checks}
    for released in lab.released:
        grade_id = grade_id_of(released)
        cell = cells.get(grade_id)
        count = cell.get("execution_count") if cell is not None else None
        if grade_id in lab.answers and isinstance(count, int):
            newest = max(newest, count)
        elif grade_id in checks:
            if isinstance(count, int) and count < newest:
                older.append(f"“{checks[grade_id]}”")
            newest = 0
    if not older:
        return []
    named = ", ".join(dict.fromkeys(older))
    return [
        f"A cell above the check of {named} was run again after the check, so the report in the notebook is about an"
        " earlier text."
    ]
