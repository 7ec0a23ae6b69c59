"""Read a notebook file that somebody else wrote: with a limit on its size, through no link, and as plain data."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from autograder.core.files import read_plain, signature
from autograder.core.results import Outcome, Status
from autograder.reasons import Group, Kind, Reason

NO_NOTEBOOK = Kind("no-notebook", "there is no file with the lab's name, or it is empty", Group.NOTEBOOK)
OVERSIZED_NOTEBOOK = Kind("oversized-notebook", "the notebook is larger than the limit", Group.NOTEBOOK)
NOT_A_NOTEBOOK = Kind("not-a-notebook", "the file is JSON but no notebook, or a cell holds no text", Group.NOTEBOOK)
NOT_JSON = Kind("not-json", "the file is not JSON", Group.NOTEBOOK)

NOTEBOOK_BYTES = 8 * 1024 * 1024
"""The size of the largest notebook that is read, in bytes."""


class UnreadableError(Exception):
    """The notebook cannot be read; `problem` says why."""

    def __init__(self, problem: Outcome) -> None:
        """Store the problem."""
        super().__init__(problem.title)
        self.problem = problem


def problem(title: str, reason: Reason) -> Outcome:
    """Return an outcome that describes a problem of a submission."""
    return Outcome(status=Status.FAILED, title=title, because=reason.because, hint=reason.hint, code=reason.kind.code)


def note(title: str, reason: Reason) -> Outcome:
    """Return an outcome for something in a submission that makes no difference to its points."""
    return problem(title, reason).model_copy(update={"status": Status.NOTE})


def cells_of(path: Path) -> list[dict[str, Any]]:
    """Return a notebook's cells.

    Raises:
        UnreadableError: the file is not a notebook.
    """
    return _cells(_bytes(path))


class LastSaved(NamedTuple):
    """A notebook as it was last saved."""

    content: bytes
    """The bytes of the file."""
    cells: list[dict[str, Any]]
    released_files: dict[str, str]
    """The file names of a released notebook's answers by grade_id; empty if the notebook does not list them."""
    at: float
    """When it was saved, as seconds since the epoch."""


def last_saved(path: Path) -> LastSaved:
    """Read a notebook as it was last saved, also while JupyterLab is saving it.

    JupyterLab empties the file before it writes the new text. Until the new text is complete, a copy of the old one is
    beside the file (`atomic_writing` in jupyter_server). If there is no copy, the new text has become complete.

    Raises:
        UnreadableError: the file is not a notebook.
    """
    for file in (path, path.with_name(f".~{path.name}")):
        with suppress(UnreadableError):
            return _last_saved(file)
    return _last_saved(path)


def _last_saved(path: Path) -> LastSaved:
    state = signature(path)
    content = _bytes(path)
    cells = _cells(content)
    metadata = json.loads(content.decode("utf-8-sig")).get("metadata")
    mark = metadata.get("autograder") if isinstance(metadata, dict) else None
    answers = mark.get("answers") if isinstance(mark, dict) else None
    files = {str(key): str(name) for key, name in answers.items()} if isinstance(answers, dict) else {}
    return LastSaved(content, cells, files, state[3] / 1e9 if state else 0.0)


def _way(path: Path) -> tuple[Path, tuple[str, ...]]:
    """Split a path into a folder that is trusted and the names below it, none of which may be a link.

    A submission is `<student>/<lab>/<lab>.ipynb`. If one of the three were a link, it could lead to the solution or to
    another student's submission.
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
        raise UnreadableError(problem(title, NO_NOTEBOOK(because, f"Submit {path.name}."))) from error
    if not content.strip():
        raise UnreadableError(
            problem(title, NO_NOTEBOOK(f"No {path.name} was handed in.", f"Submit the file {path.name} itself."))
        )
    if len(content) > NOTEBOOK_BYTES:
        raise UnreadableError(
            problem(
                title,
                OVERSIZED_NOTEBOOK(
                    f"The notebook is larger than {NOTEBOOK_BYTES // 1024**2} MiB.",
                    "Clear all outputs, save, and submit again.",
                ),
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
        raise UnreadableError(problem(title, NOT_JSON(because, hint))) from error
    cells = notebook.get("cells") if isinstance(notebook, dict) else None
    if not isinstance(cells, list) or notebook.get("nbformat") != 4 or not all(isinstance(c, dict) for c in cells):
        because = "The file is JSON, but not a notebook of format 4: it has no list of cells."
        raise UnreadableError(problem(title, NOT_A_NOTEBOOK(because, hint)))
    return cells
