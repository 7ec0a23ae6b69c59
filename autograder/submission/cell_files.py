"""Takes the files out of a submitted notebook that its cells name: answers, and a student's own modules."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from autograder.core.results import Outcome
from autograder.course.cells import BadNameError, CellFile, check_free, grade_id_of, parse
from autograder.course.lab import Lab
from autograder.reasons import Group, Kind
from autograder.submission.copies import by_mark, copies_of, named_file
from autograder.submission.notebook_file import problem
from autograder.submission.submission import Submission

IGNORED_CELL = Kind(
    "ignored-cell", "a cell of the student's own names a file that belongs to an answer or to the lab", Group.NOTEBOOK
)
TOO_MANY_FILES = Kind(
    "too-many-files", "more cells of the student's own name files than are taken along", Group.NOTEBOOK
)
NO_FILE_NAME = Kind("no-file-name", "the first line of the cell does not name a file", Group.NOTEBOOK)
GIVEN_FILE = Kind("given-file", "the cell names a file that belongs to the lab", Group.NOTEBOOK)
RENAMED_FILE = Kind("renamed-file", "the cell names another file than the lab asks for", Group.NOTEBOOK)
SAME_FILE = Kind("same-file", "two answers name one file", Group.NOTEBOOK)
BAD_FILE_NAME = Kind(
    "bad-file-name", "the first line of the cell gives a name that no file here can have", Group.NOTEBOOK
)

OWN_FILES = 50
"""As many files of cells that a student added are taken along; a program and its modules need a few."""


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
            because = f"The cell `{grade_id}` does not begin with `{wanted}`, so it is no file."
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
        if file.file_name != answer.file.file_name:
            because = f"The cell `{grade_id}` names {file.file_name}; the lab asks for {answer.file.file_name}."
            submission.problems.append(problem(title, RENAMED_FILE(because, f"Begin the cell with `{wanted}`.")))
        if file.file_name in owners:
            because = (
                f"The cells `{owners[file.file_name]}` and `{grade_id}` both name {file.file_name}: the later counts."
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
    """Take along what cells of the student's own hold, as in the notebook; an answer's name belongs to its own cell."""
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
            # Something has been said already of copies, and of marks that are no answer's.
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
        because = f"There are {len(own)} cells of your own that name files; the first {OWN_FILES} are taken along."
        submission.problems.append(problem("the notebook's files are few", TOO_MANY_FILES(because)))
        own = dict(list(own.items())[:OWN_FILES])
    submission.files.update(own)
    return own


class _Places:
    """Where files lie, and the folders above them."""

    def __init__(self, names: Iterable[str]) -> None:
        self._files: set[str] = set()
        self._folders: set[str] = set()
        for name in names:
            self.add(name)

    def add(self, name: str) -> None:
        self._files.add(name)
        self._folders.update(_folders(name))

    def taken(self, name: str) -> bool:
        """Whether a file would lie where another one needs a folder, or the other way round."""
        return name in self._folders or not self._files.isdisjoint(_folders(name))


def _folders(name: str) -> list[str]:
    """The folders that a file's name puts it into."""
    parts = name.split("/")
    return ["/".join(parts[:count]) for count in range(1, len(parts))]


def _ignored(file: CellFile, answer: str, lab: Lab, submission: Submission) -> Outcome:
    """What to say of a cell of the student's own with a name that belongs to an answer or to the lab."""
    first, title = f"%%{file.magic} {file.name}", f"one cell names {file.file_name}"
    hint = "Delete the other cell, or give its file another name."
    if not answer:
        because = f"Another cell also begins with `{first}`. It is ignored: {file.file_name} belongs to the lab."
        return problem(title, IGNORED_CELL(because, hint))
    blank = ", still as you received it" if submission.sources[answer] == lab.answers[answer].blank else ""
    because = (
        f"Another cell also begins with `{first}`. It is ignored: what counts is the cell for this answer, `{answer}`,"
        f" as it stands{blank}."
    )
    return problem(title, IGNORED_CELL(because, f"Move what is to be graded into the cell `{answer}`. {hint}"))
