"""Reads what a student handed in, as text: nothing of it is executed, imported or unpickled here.

The source of the answer cells counts, found by grade_id, and what a student's own `%%node` and `%%file` cells hold: the
modules and files that the answers use. Whatever is wrong with the notebook becomes a named outcome, so that one broken
submission never stops a class.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.errors import KitError
from autograder.files import read_plain
from autograder.results import Outcome, Status
from autograder.submission.lab import Answer, Lab, grade_id_of, lab_names, load_lab, nbgrader_of, source_of
from autograder.submission.magics import CELL_BYTES, BadNameError, CellFile, check_free, parse

NOTEBOOK_BYTES = 8 * 1024 * 1024
"""The largest notebook that is read, in bytes."""
OWN_FILES = 50
"""As many files of cells that a student added are taken along; a program and its modules need a few."""


@dataclass
class Submission:
    """What a student handed in for a lab."""

    sources: dict[str, str] = field(default_factory=dict)
    """The source of every answer cell by grade_id; what students receive where there was no usable answer."""
    files: dict[str, str] = field(default_factory=dict)
    """File name to text: the programs and files that cells name, the lab's own and the student's own included."""
    problems: list[Outcome] = field(default_factory=list)
    digest: str = ""
    """SHA-256 over the answers, the lab and the kit: it changes when any of them does."""
    readable: bool = True
    """False: there is no notebook of this lab to grade, and `problems` says why."""
    notebook: dict[str, Any] = field(default_factory=dict)
    """The released notebook with the answers' sources in it."""


class UnreadableError(Exception):
    """There is no notebook to read; `problem` says why."""

    def __init__(self, problem: Outcome) -> None:
        """Keep what to say of it."""
        super().__init__(problem.title)
        self.problem = problem


def read_submission(path: Path, lab: Lab) -> Submission:
    """Read a submitted notebook; every defect of it ends up in `problems`, none is raised."""
    submission = Submission(sources={answer.grade_id: answer.blank for answer in lab.answers.values()})
    cells: list[dict[str, Any]] = []
    try:
        cells = _cells(_bytes(path))
        _take_answers(cells, lab, submission)
    except UnreadableError as error:
        submission.problems.append(error.problem)
        submission.readable = False
    _take_files(lab, submission)
    own = _take_own_files(cells, lab, submission) if submission.readable else {}
    problems = [[problem.code, problem.because] for problem in submission.problems]
    parts = [lab.digest, problems, list(submission.sources.items()), sorted(own.items())]
    submission.digest = hashlib.sha256(json.dumps(parts).encode()).hexdigest()
    submission.notebook = lab.clean_notebook(submission.sources)
    return submission


def _problem(code: str, title: str, because: str, hint: str = "") -> Outcome:
    return Outcome(status=Status.FAILED, title=title, because=because, hint=hint, code=code)


def _way(path: Path) -> tuple[Path, tuple[str, ...]]:
    """The folder that a path is trusted up to, and the names below it, none of which may be a link.

    A submission is `<student>/<lab>/<lab>.ipynb`. A link in place of any of the three could lead to the solution, or to
    what another student handed in.
    """
    first = max(len(path.parts) - 3, path.parts.index(path.anchor) + 1 if path.anchor else 0)
    while ".." in path.parts[first:]:
        first += 1
    return Path(*path.parts[:first]), path.parts[first:]


def _bytes(path: Path) -> bytes:
    title = "the notebook can be read"
    try:
        content = read_plain(*_way(path), NOTEBOOK_BYTES + 1)
    except OSError as error:
        because = f"There is no file {path.name} to read ({error.strerror or error})."
        raise UnreadableError(_problem("no-notebook", title, because, f"Submit {path.name}.")) from error
    if not content.strip():
        raise UnreadableError(
            _problem("no-notebook", title, f"No {path.name} was handed in.", f"Submit the file {path.name} itself.")
        )
    if len(content) > NOTEBOOK_BYTES:
        raise UnreadableError(
            _problem(
                "oversized-notebook",
                title,
                f"The notebook is larger than {NOTEBOOK_BYTES // 1024**2} MiB.",
                "Clear all outputs, save, and submit again.",
            )
        )
    return content


def _cells(content: bytes) -> list[dict[str, Any]]:
    title = "the file is a Jupyter notebook"
    hint = "Open it in JupyterLab, save it there, and submit that file."
    try:
        notebook = json.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        because = "The file is not a notebook: it is not valid JSON."
        raise UnreadableError(_problem("not-json", title, because, hint)) from error
    cells = notebook.get("cells") if isinstance(notebook, dict) else None
    if not isinstance(cells, list) or notebook.get("nbformat") != 4 or not all(isinstance(c, dict) for c in cells):
        because = "The file is JSON, but not a notebook of format 4: it has no list of cells."
        raise UnreadableError(_problem("not-a-notebook", title, because, hint))
    return cells


def _take_answers(cells: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    released = {grade_id_of(cell): cell for cell in lab.released if grade_id_of(cell)}
    found: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for cell in cells:
        if grade_id_of(cell):
            found[grade_id_of(cell)].append(cell)
    if not found.keys() & released.keys():
        raise UnreadableError(
            _problem(
                "wrong-notebook",
                f"the notebook is {lab.name}",
                f"No cell of it belongs to {lab.name}: it is another notebook, or every graded cell was deleted.",
                f"Start from labs/{lab.name}/{lab.name}.ipynb and submit that notebook.",
            )
        )
    forged = sorted(found.keys() - released.keys())
    if forged:
        names = ", ".join(f"`{grade_id[:40]}`" for grade_id in forged[:5]) + (", …" if len(forged) > 5 else "")
        submission.problems.append(
            _problem(
                "forged-cell",
                "every graded cell belongs to the lab",
                f"The lab has no graded cell {names}: ignored.",
                "Use ordinary cells for your own notes and experiments.",
            )
        )
    for grade_id, original in released.items():
        _take_cell(grade_id, original, found.get(grade_id, []), lab, submission)


def _take_cell(
    grade_id: str, original: dict[str, Any], copies: list[dict[str, Any]], lab: Lab, submission: Submission
) -> None:
    answer = lab.answers.get(grade_id)
    if answer is not None:
        # A copy that was given another name is a file of the student's own.
        copies = [cell for cell in copies if _names(cell, answer)] or copies
    if len(copies) > 1:
        which = "the last one counts" if answer else "none of them is run; the lab's own cell is"
        submission.problems.append(
            _problem(
                "duplicated-cell",
                f"there is one cell `{grade_id}`",
                f"There are {len(copies)} copies of the cell `{grade_id}`: {which}.",
                "Delete the copies: a copied cell takes its grading mark along.",
            )
        )
    flags = ("grade", "solution", "locked")
    meant = {flag: bool(nbgrader_of(original).get(flag, False)) for flag in flags}
    if any({flag: bool(nbgrader_of(cell).get(flag, False)) for flag in flags} != meant for cell in copies):
        submission.problems.append(
            _problem(
                "forged-flags",
                f"the cell `{grade_id}` is marked as in the lab",
                f"The grading marks of the cell `{grade_id}` were changed; the lab's own marks count.",
            )
        )
    if answer is None:
        _compare(grade_id, copies, lab, submission)
        return
    if not copies:
        submission.problems.append(
            _problem(
                "missing-cell",
                f"the answer cell `{grade_id}` is there",
                f"The answer cell `{grade_id}` was deleted: there is no answer to grade.",
                f"Copy the cell from a fresh labs/{lab.name}/{lab.name}.ipynb.",
            )
        )
        return
    try:
        source = source_of(copies[-1])
    except ValueError:
        submission.problems.append(
            _problem("not-a-notebook", f"the cell `{grade_id}` holds text", f"The cell `{grade_id}` holds no text.")
        )
        return
    if len(source.encode("utf-8")) > CELL_BYTES:
        submission.problems.append(
            _problem(
                "oversized-cell",
                f"the cell `{grade_id}` is at most {CELL_BYTES // 1024} KiB",
                f"The cell `{grade_id}` is larger than {CELL_BYTES // 1024} KiB; it is not graded.",
            )
        )
        return
    submission.sources[grade_id] = source


def _compare(grade_id: str, copies: list[dict[str, Any]], lab: Lab, submission: Submission) -> None:
    """Report an edited check cell; a deleted one does no harm, for the lab's own cell is run anyway.

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
            _problem(
                "changed-cell",
                f"the cell `{grade_id}` is as in the lab",
                f"The cell `{grade_id}` was edited; the lab's own cell is run instead.",
            )
        )


def _take_files(lab: Lab, submission: Submission) -> None:
    owners: dict[str, str] = {}
    for grade_id, answer in lab.answers.items():
        if answer.file is None:
            continue
        title = f"the cell `{grade_id}` names its file"
        wanted = f"%%{answer.file.magic} {answer.file.name}"
        try:
            file = parse(submission.sources[grade_id])
        except BadNameError as error:
            submission.problems.append(_problem("bad-file-name", title, str(error), f"Begin the cell with `{wanted}`."))
            continue
        if file is None:
            because = f"The cell `{grade_id}` does not begin with `{wanted}`, so it is no file."
            submission.problems.append(_problem("no-file-name", title, because, f"Begin the cell with `{wanted}`."))
            continue
        if file.file_name in lab.given:
            because = f"`{file.file_name}` belongs to the lab and cannot be replaced."
            submission.problems.append(_problem("given-file", title, because, f"Begin the cell with `{wanted}`."))
            continue
        try:
            if file.file_name != answer.file.file_name:
                check_free(file)
        except BadNameError as error:
            submission.problems.append(_problem("bad-file-name", title, str(error), f"Begin the cell with `{wanted}`."))
            continue
        if file.file_name != answer.file.file_name:
            because = f"The cell `{grade_id}` names {file.file_name}; the lab asks for {answer.file.file_name}."
            submission.problems.append(_problem("renamed-file", title, because, f"Begin the cell with `{wanted}`."))
        if file.file_name in owners:
            because = (
                f"The cells `{owners[file.file_name]}` and `{grade_id}` both name {file.file_name}: the later counts."
            )
            submission.problems.append(_problem("same-file", title, because, f"Begin the cell with `{wanted}`."))
        owners[file.file_name] = grade_id
        submission.files[file.file_name] = file.text
    submission.files.update(lab.given)


def _named(cell: dict[str, Any]) -> CellFile | None:
    """Return the file that a code cell names, if it does so in a way that the notebook's magics accept."""
    if cell.get("cell_type") != "code":
        return None
    try:
        source = source_of(cell)
        return None if len(source.encode("utf-8")) > CELL_BYTES else parse(source)
    except ValueError:  # BadNameError is one: in the notebook, too, such a cell wrote nothing
        return None


def _names(cell: dict[str, Any], answer: Answer) -> bool:
    """Whether a copy of an answer cell still names the answer's file."""
    file = _named(cell)
    return answer.file is None or (file is not None and file.file_name == answer.file.file_name)


def _take_own_files(cells: list[dict[str, Any]], lab: Lab, submission: Submission) -> dict[str, str]:
    """Take along what cells of the student's own hold, as in the notebook; an answer's name belongs to its own cell."""
    answers = {answer.file.file_name: answer.grade_id for answer in lab.answers.values() if answer.file is not None}
    taken = dict(submission.files)
    own: dict[str, str] = {}
    for cell in cells:
        file = _named(cell)
        if file is None or taken.get(file.file_name) == file.text:
            continue
        if file.file_name in taken or file.file_name in answers:
            # Cells with a grading mark have been looked at: as copies, as forged ones, as answers.
            if not grade_id_of(cell):
                submission.problems.append(_ignored(file, answers.get(file.file_name, ""), lab, submission))
            continue
        try:
            check_free(file)
        except BadNameError as error:
            submission.problems.append(
                _problem(
                    "bad-file-name", f"`%%{file.magic} {file.name}` can be a file", f"{error} The cell is ignored."
                )
            )
            continue
        own[file.file_name] = file.text
    if len(own) > OWN_FILES:
        because = f"There are {len(own)} cells of your own that name files; the first {OWN_FILES} are taken along."
        submission.problems.append(_problem("too-many-files", "the notebook's files are few", because))
        own = dict(list(own.items())[:OWN_FILES])
    submission.files.update(own)
    return own


def _ignored(file: CellFile, answer: str, lab: Lab, submission: Submission) -> Outcome:
    """What to say of a cell of the student's own with a name that belongs to an answer or to the lab."""
    first, title = f"%%{file.magic} {file.name}", f"one cell names {file.file_name}"
    hint = "Delete the other cell, or give its file another name."
    if not answer:
        because = f"Another cell also begins with `{first}`. It is ignored: {file.file_name} belongs to the lab."
        return _problem("ignored-cell", title, because, hint)
    blank = ", still as you received it" if submission.sources[answer] == lab.answers[answer].blank else ""
    because = (
        f"Another cell also begins with `{first}`. It is ignored: what counts is the cell for this answer, `{answer}`,"
        f" as it stands{blank}."
    )
    return _problem("ignored-cell", title, because, f"Move what is to be graded into the cell `{answer}`. {hint}")


def cells_of(path: Path) -> list[dict[str, Any]]:
    """Return a notebook's cells.

    Raises:
        UnreadableError: it is no notebook.
    """
    return _cells(_bytes(path))


def grade_ids_in(path: Path) -> set[str]:
    """Return the grade_ids in a notebook; none if it cannot be read."""
    try:
        return {grade_id_of(cell) for cell in _cells(_bytes(path))} - {""}
    except UnreadableError:
        return set()


def lab_of(notebook: Path, name: str | None, root: Path) -> Lab:
    """Return the lab that a notebook answers: by name, by the file's name, or by the grade_ids in it.

    Raises:
        KitError: it answers none of the course's labs.
    """
    names = lab_names(root)
    if name is not None or notebook.stem in names:
        return load_lab(root, name or notebook.stem)
    ids = grade_ids_in(notebook)
    labs = [load_lab(root, known) for known in names]
    best = max(labs, key=lambda lab: len(ids & lab.answers.keys()), default=None)
    if best is None or not ids & best.answers.keys():
        raise KitError(
            f"{notebook.name} is no notebook of a lab of this course.",
            f"Name the lab: --lab NAME, or another course: --course FOLDER. Labs in {root}: {', '.join(names)}.",
        )
    return best
