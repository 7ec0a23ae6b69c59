"""Folders and zips around a whole class, which packing, unpacking and downloading put there."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Sequence
from pathlib import Path

from autograder.intake.members import PACKERS, in_zip, is_notebook, is_zip
from autograder.intake.roster import FILE_NAME as ROSTER

_MOST = 3
"""So many folders may lie around a class."""


def visible(folder: Path) -> list[Path]:
    """Return what lies in a folder without what systems put there, by name."""
    return [entry for entry in sorted(folder.iterdir()) if not entry.name.startswith(PACKERS)]


def beside_all(name: str) -> str:
    """Return the sentence about a file that lies beside the students' folders."""
    return f"{name[:80]!r} is no student's folder, notebook or zip; it was left out."


def unwrapped(source: Path, lab: str, refused: list[str]) -> Path:
    """Return the folder or zip in which the students' work lies.

    Args:
        source: a folder or a zip.
        lab: whose notebooks are wanted.
        refused: gets a sentence about what lies beside the folders that are passed on the way.
    """
    for _ in range(_MOST):
        inner = _only(visible(source), lab) if source.is_dir() else None
        if inner is None:
            break
        refused += [beside_all(entry.name) for entry in visible(source) if entry.name not in (inner.name, ROSTER)]
        source = inner
    return source


def wrapper(paths: Sequence[tuple[str, ...]], lab: str) -> tuple[str, ...]:
    """Return the folders that lie around all of a zip's students."""
    above: tuple[str, ...] = ()
    inside = list(paths)
    while len(above) < _MOST:
        folders = {path[0] for path in inside if len(path) > 1}
        if len(folders) != 1 or any(_of_students(path[0]) for path in inside if len(path) == 1):
            break
        below = [path[1:] for path in inside if len(path) > 1]
        if not _is_class({path[0] for path in below}, lab) or not any(len(p) > 1 or is_zip(p[0]) for p in below):
            break
        above, inside = (*above, *folders), below
    return above


def _only(entries: Sequence[Path], lab: str) -> Path | None:
    """The one folder or zip among files that are nobody's, if it holds a class."""
    candidates = [entry for entry in entries if entry.is_dir() or entry.is_symlink() or _of_students(entry.name)]
    if len(candidates) != 1 or candidates[0].is_symlink():
        return None
    only = candidates[0]
    with contextlib.suppress(Exception):  # a damaged zip raises many kinds
        if only.is_dir():
            inside = visible(only)
            fits = _is_class({entry.name for entry in inside}, lab)
            return only if fits and any(entry.is_dir() or is_zip(entry.name) for entry in inside) else None
        if is_zip(only.name):
            with zipfile.ZipFile(only) as archive:
                paths = [member.path for member in in_zip(archive, [])]
            above = wrapper(paths, lab)
            tops = {path[len(above)] for path in paths if len(path) > len(above) and _of_students(path[-1])}
            return only if len(tops) > 1 and _is_class(tops, lab) else None
    return None


def _of_students(name: str) -> bool:
    return is_notebook(name) or is_zip(name)


def _is_class(names: set[str], lab: str) -> bool:
    """Whether what lies in a folder is more than one student's work, by the names in it."""
    return not any(is_notebook(name) or name in (lab, "labs") for name in names)
