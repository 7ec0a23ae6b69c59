"""Extract the answers of a submitted notebook, and the files that its cells name, as text.

An answer is the source of one of the lab's answer cells, which is found by its grade_id. A file comes from an answer,
or from a cell that the student added, for example for a module.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from autograder.core.results import Outcome
from autograder.course.cells import (
    CELL_BYTES,
    BadNameError,
    CellFile,
    check_free,
    grade_id_of,
    nbgrader_of,
    parse,
    source_of,
)
from autograder.course.lab import Lab
from autograder.reasons import Group, Kind
from autograder.submission.copies import (
    DELETE_COPIES,
    SPLIT,
    by_mark,
    copies_of,
    named_file,
    pieces_of,
    told_of_copies,
    told_of_given_copies,
)
from autograder.submission.notebook_file import NOT_A_NOTEBOOK, UnreadableError, note, problem

WRONG_NOTEBOOK = Kind(
    "wrong-notebook", "the file is another notebook, or almost none of the lab's cells are left in it", Group.NOTEBOOK
)
FORGED_CELL = Kind("forged-cell", "a cell has a grading mark that the lab does not know", Group.NOTEBOOK)
SPLIT_CELL = Kind(
    "split-cell", "an answer's cell was split; a piece without the cell's first line is left out", Group.NOTEBOOK
)
DUPLICATED_CELL = Kind("duplicated-cell", "the notebook has a cell with a grading mark more than once", Group.NOTEBOOK)
FORGED_FLAGS = Kind("forged-flags", "a cell's grading marks differ from those in the lab", Group.NOTEBOOK)
MISSING_CELL = Kind("missing-cell", "an answer's cell was deleted, or is no longer a code cell", Group.NOTEBOOK)
OVERSIZED_CELL = Kind("oversized-cell", "a cell is larger than the limit", Group.NOTEBOOK)
CHANGED_CELL = Kind("changed-cell", "a check cell was edited; the lab's own cell is run", Group.NOTEBOOK)
IGNORED_CELL = Kind(
    "ignored-cell", "a cell that the student added names a file that belongs to an answer or the lab", Group.NOTEBOOK
)
TOO_MANY_FILES = Kind(
    "too-many-files", "the student added more cells that name files than the limit allows", Group.NOTEBOOK
)
NO_FILE_NAME = Kind("no-file-name", "the first line of the cell does not name a file", Group.NOTEBOOK)
GIVEN_FILE = Kind("given-file", "the cell names a file that belongs to the lab", Group.NOTEBOOK)
RENAMED_FILE = Kind("renamed-file", "the cell names a different file from the one the lab asks for", Group.NOTEBOOK)
SAME_FILE = Kind("same-file", "two answers name the same file", Group.NOTEBOOK)
BAD_FILE_NAME = Kind(
    "bad-file-name", "the first line of the cell gives a name that is not allowed for a file", Group.NOTEBOOK
)


@dataclass
class Submission:
    """What a student handed in for a lab."""

    sources: dict[str, str] = field(default_factory=dict)
    """The source of every answer cell by grade_id; the source that students receive if there is no usable answer."""
    files: dict[str, str] = field(default_factory=dict)
    """The text of every program and file that a cell names, by file name, including the lab's files."""
    problems: list[Outcome] = field(default_factory=list)
    merged: dict[str, str] = field(default_factory=dict)
    """Answers whose cell was merged into another answer's cell, with that one, both by grade_id."""
    digest: str = ""
    """SHA-256 over the answers, the student's other files, the problems, the lab and the kit."""
    readable: bool = True
    """Whether there is a notebook of this lab to grade; if not, `problems` says why."""


def take_answers(cells: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    """Put the sources of a notebook's answer cells into a submission.

    Raises:
        UnreadableError: almost none of the notebook's cells belong to the lab.
    """
    released = {grade_id_of(cell): cell for cell in lab.released if grade_id_of(cell)}
    found = by_mark(cells)
    ours = lab.answers.keys() | {cell.grade_id for cell in lab.checks}
    # Two labs may use the same grade_ids. In another lab's notebook, most grade_ids are unknown here, and most answers
    # of this lab are missing.
    known, answers = len(found.keys() & ours), len(found.keys() & lab.answers.keys())
    if not known or (2 * known < len(found.keys() - (released.keys() - ours)) and 2 * answers < len(lab.answers)):
        raise UnreadableError(
            problem(
                f"the notebook is {lab.name}",
                WRONG_NOTEBOOK(
                    f"Almost none of its cells belong to {lab.name}: this is a different notebook, or the graded cells"
                    " were deleted.",
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
                    f"The lab has no graded cell {listed}, so {'it is' if len(forged) == 1 else 'they are'} ignored.",
                    "Use ordinary cells for your own notes and experiments.",
                ),
            )
        )
    submission.merged = _merged(found, lab)
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
        said, because = note, told_of_given_copies(grade_id, len(copies))
        if answer is not None:
            said, because = problem, told_of_copies(name, len(copies), is_file=file is not None)
        submission.problems.append(said(f"there is one cell `{grade_id}`", DUPLICATED_CELL(because, DELETE_COPIES)))
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
        submission.problems.append(_missing(grade_id, bool(marked), lab, submission))
        return
    try:
        # A text answer may have been split or started again. The person who reads it decides.
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


def _missing(grade_id: str, is_other_cell: bool, lab: Lab, submission: Submission) -> Outcome:
    """Return a problem: no cell counts as this answer."""
    because = f"The answer cell `{grade_id}` was deleted, so there is no answer to grade."
    hint = f"Copy the cell from a fresh labs/{lab.name}/{lab.name}.ipynb."
    if is_other_cell:
        because = f"The answer cell `{grade_id}` is no longer a code cell, so there is no answer to grade."
        hint = "Select the cell and make it a code cell again (key Y)."
    elif grade_id in submission.merged:
        into = submission.merged[grade_id]
        because = (
            f"The answer cell `{grade_id}` was merged into the cell `{into}`. A cell writes one file, which its"
            " first line names."
        )
        hint = (
            f"Copy both cells from a fresh labs/{lab.name}/{lab.name}.ipynb, and move each text, which begins with"
            " such a line, into the cell of its own."
        )
    return problem(f"the answer cell `{grade_id}` is there", MISSING_CELL(because, hint))


def _merged(found: dict[str, list[dict[str, Any]]], lab: Lab) -> dict[str, str]:
    """Return the answers without a cell whose first line stands in another answer's cell, with that one."""
    merged = {}
    lines = {}
    for grade_id in found.keys() & lab.answers.keys():
        try:
            lines[grade_id] = {line.rstrip() for cell in found[grade_id] for line in source_of(cell).splitlines()}
        except ValueError:  # it is told of the cell itself
            continue
    for grade_id, answer in lab.answers.items():
        if answer.file is not None and grade_id not in found:
            first = f"%%{answer.file.magic} {answer.file.name}"
            into = next((other for other in lab.answers if first in lines.get(other, ())), None)
            if into is not None:
                merged[grade_id] = into
    return merged


def _compare(grade_id: str, copies: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    """Note an edited check cell. A deleted one does not matter, because the lab's own cell is run anyway.

    A cell of an earlier version of the lab is not edited, and neither is one with the hidden lines of the lab's source,
    because authors check that notebook.
    """

    def as_given_out(cell: dict[str, Any]) -> bool:
        try:
            return lab.is_as_given_out(grade_id, source_of(cell))
        except ValueError:
            return False

    if not all(as_given_out(cell) for cell in copies):
        because = f"The cell `{grade_id}` was changed. Grading runs the lab's own cell, so this makes no difference."
        submission.problems.append(note(f"the cell `{grade_id}` is not the lab's", CHANGED_CELL(because)))


OWN_FILES = 50
"""The number of files that cells added by a student may write. A program and its modules need only a few."""


def take_files(lab: Lab, submission: Submission) -> None:
    """Put the files that the answers name, and the lab's own, into a submission."""
    owners: dict[str, str] = {}
    places = _Places([*submission.files, *lab.given])
    for grade_id, answer in lab.answers.items():
        if answer.file is None:
            continue
        title = f"the cell `{grade_id}` names its file"
        wanted = f"%%{answer.file.magic} {answer.file.name}"
        try:
            file = parse(submission.sources[grade_id])
        except BadNameError as error:
            submission.problems.append(problem(title, BAD_FILE_NAME(str(error), f"Begin the cell with `{wanted}`.")))
            continue
        if file is None:
            because = f"The cell `{grade_id}` does not begin with `{wanted}`, so it does not write a file."
            submission.problems.append(problem(title, NO_FILE_NAME(because, f"Begin the cell with `{wanted}`.")))
            continue
        if file.file_name in lab.given:
            because = f"`{file.file_name}` belongs to the lab and cannot be replaced."
            submission.problems.append(problem(title, GIVEN_FILE(because, f"Begin the cell with `{wanted}`.")))
            continue
        try:
            if file.file_name != answer.file.file_name:
                check_free(file)
        except BadNameError as error:
            submission.problems.append(problem(title, BAD_FILE_NAME(str(error), f"Begin the cell with `{wanted}`.")))
            continue
        was_merged = grade_id in submission.merged.values()  # and one sentence about it is enough
        if file.file_name != answer.file.file_name and not was_merged:
            because = f"The cell `{grade_id}` names {file.file_name}; the lab asks for {answer.file.file_name}."
            submission.problems.append(problem(title, RENAMED_FILE(because, f"Begin the cell with `{wanted}`.")))
        if file.file_name in owners and not was_merged:
            because = (
                f"The cells `{owners[file.file_name]}` and `{grade_id}` both write {file.file_name}; only the later"
                " cell counts."
            )
            submission.problems.append(problem(title, SAME_FILE(because, f"Begin the cell with `{wanted}`.")))
        if places.taken(file.file_name):
            because = f"`{file.file_name}` is a file of one cell and a folder of another."
            submission.problems.append(problem(title, BAD_FILE_NAME(because, f"Begin the cell with `{wanted}`.")))
            continue
        places.add(file.file_name)
        owners[file.file_name] = grade_id
        submission.files[file.file_name] = file.text
    submission.files.update(lab.given)


def take_own_files(cells: list[dict[str, Any]], lab: Lab, submission: Submission) -> dict[str, str]:
    """Put the files of cells that the student added into a submission, and return these files.

    A file that belongs to an answer or the lab cannot be replaced in this way.
    """
    answers = {answer.file.file_name: answer.grade_id for answer in lab.answers.values() if answer.file is not None}
    taken = dict(submission.files)
    places = _Places(taken)
    marked = by_mark(cells)
    counted = [
        cell
        for answer in lab.answers.values()
        for cell in copies_of(marked.get(answer.grade_id, []), answer.file.file_name if answer.file is not None else "")
    ]
    looked_at = {id(cell) for cell in counted}
    own: dict[str, str] = {}
    for cell in cells:
        file = named_file(cell)
        if file is None or taken.get(file.file_name) == file.text:
            continue
        if file.file_name in taken or file.file_name in answers:
            # Copies of answer cells and cells with other grading marks have been reported already.
            if id(cell) not in looked_at and (not grade_id_of(cell) or grade_id_of(cell) in lab.answers):
                submission.problems.append(_ignored(file, answers.get(file.file_name, ""), lab, submission))
            continue
        try:
            check_free(file)
        except BadNameError as error:
            submission.problems.append(
                problem(f"`%%{file.magic} {file.name}` can be a file", BAD_FILE_NAME(f"{error} The cell is ignored."))
            )
            continue
        if places.taken(file.file_name):
            because = f"`{file.file_name}` is a file of one cell and a folder of another. The cell is ignored."
            submission.problems.append(problem(f"`%%{file.magic} {file.name}` can be a file", BAD_FILE_NAME(because)))
            continue
        places.add(file.file_name)
        own[file.file_name] = file.text
    if len(own) > OWN_FILES:
        because = f"{len(own)} cells of your own write files; only the first {OWN_FILES} of them are used."
        submission.problems.append(problem("the notebook's files are few", TOO_MANY_FILES(because)))
        own = dict(list(own.items())[:OWN_FILES])
    submission.files.update(own)
    return own


class _Places:
    """The paths of the files, and of the folders above them."""

    def __init__(self, names: Iterable[str]) -> None:
        self._files: set[str] = set()
        self._folders: set[str] = set()
        for name in names:
            self.add(name)

    def add(self, name: str) -> None:
        self._files.add(name)
        self._folders.update(_folders(name))

    def taken(self, name: str) -> bool:
        """Return whether the path is the path of a folder, or needs a folder where there is a file."""
        return name in self._folders or not self._files.isdisjoint(_folders(name))


def _folders(name: str) -> list[str]:
    """Return the paths of the folders above a file."""
    parts = name.split("/")
    return ["/".join(parts[:count]) for count in range(1, len(parts))]


def _ignored(file: CellFile, answer: str, lab: Lab, submission: Submission) -> Outcome:
    """Return a problem: a cell that the student added names a file that belongs to an answer or to the lab."""
    first, title = f"%%{file.magic} {file.name}", f"one cell names {file.file_name}"
    hint = "Delete the other cell, or give its file another name."
    if not answer:
        because = f"Another cell also begins with `{first}`. It is ignored: {file.file_name} belongs to the lab."
        return problem(title, IGNORED_CELL(because, hint))
    blank = ", and it is still as you received it" if submission.sources[answer] == lab.answers[answer].blank else ""
    because = (
        f"Another cell also begins with `{first}`. It is ignored, because only the cell `{answer}` counts for this"
        f" answer{blank}."
    )
    return problem(title, IGNORED_CELL(because, f"Move what should be graded into the cell `{answer}`. {hint}"))
