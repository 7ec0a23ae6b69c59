"""The folder beside a notebook in which the programs and files of its cells lie, and what the kit wrote there.

Each notebook has a folder of its own below `nodes`, and a manifest in it. What stands in the manifest and is still as
it was written is the kit's to replace and to remove; everything else is the student's, and is kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autograder.core.files import write_beside
from autograder.course.cells import BadNameError, CellFile, check_name

NODES = "nodes"
MANIFEST = ".autograder.json"
_NAMELESS = "kernel-"
_TIME = "%Y-%m-%d %H:%M:%S"


@dataclass(frozen=True)
class Written:
    """A file that a cell wrote in this kernel."""

    file: CellFile
    source: str
    """The whole cell, its first line included."""
    cell_id: str
    """The notebook's id of the cell; empty if the front end did not say."""
    number: int
    """The number in the brackets beside the cell when it was run."""
    at: float
    """When, in seconds since 1970."""

    @property
    def origin(self) -> str:
        """Where it came from, in words: `cell [7], run at 14:03:12`."""
        return f"cell [{self.number}], run at {time.strftime('%H:%M:%S', time.localtime(self.at))}"


@dataclass(frozen=True)
class Ran:
    """What a manifest says of a file: which text a cell wrote, and when."""

    sha256: str
    at: float
    """In seconds since 1970."""


def read_runs(folder: Path) -> dict[str, Ran]:
    """Return what the cells of a notebook wrote into its folder last, by file name."""
    found = {}
    for name, entry in _manifest(folder).get("files", {}).items():
        with contextlib.suppress(ValueError, OverflowError):
            at = time.mktime(time.strptime(str(entry.get("time")), _TIME))
            found[name] = Ran(str(entry.get("sha256")), at)
    return found


class ProgramFolder:
    """The programs and files that the cells of this kernel wrote.

    Args:
        notebook: the notebook, or None where the front end does not say which it is.
        place: the folder beside it.
        has_cell: whether the saved notebook has a cell for a file: if not, nothing else may hold its text.
    """

    def __init__(self, notebook: Path | None, place: Path, has_cell: Callable[[str], bool] = lambda _: True) -> None:
        """Take the folder of this notebook, or one beside it if another kernel that still lives has that."""
        self.notebook = notebook
        self.written: dict[str, Written] = {}
        """By file name."""
        self.kept: list[str] = []
        """What to tell the student about files of their own that were in the way."""
        nodes = place / NODES
        for folder in nodes.glob(f"{_NAMELESS}*"):
            if _owner(_manifest(folder)) is None:
                _clear(folder)
        name = notebook.stem if notebook else f"{_NAMELESS}{os.getpid()}"
        number = 1
        self.path = nodes / name
        while _owner(_manifest(self.path)) not in (None, os.getpid()):
            number += 1
            self.path = nodes / f"{name}-{number}"
        self._forget_earlier(has_cell)

    def _forget_earlier(self, has_cell: Callable[[str], bool]) -> None:
        """Programs of an earlier kernel do not count: a cell may have been renamed or deleted since."""
        files = _manifest(self.path).get("files", {})
        for name, entry in files.items():
            path = self.path / name
            if not path.is_file():
                continue
            if _digest(path) != entry.get("sha256"):
                self.kept.append(self._move_aside(path))
            elif not has_cell(name):
                self.kept.append(self._move_aside(path, "has no cell in the saved notebook"))
            else:
                path.unlink()
        if files:
            self._note()

    def write(self, written: Written) -> list[str]:
        """Write a cell's file, whole or not at all; gives what to tell the student about a file that was in the way.

        Raises:
            OSError: it cannot be written.
        """
        name = written.file.file_name
        path = self.path / name
        before = self.written.get(name)
        told = []
        text = written.file.text.encode("utf-8", "replace")
        if path.exists() and path.read_bytes() != text and (before is None or self.changed_by_hand(name)):
            told.append(self._move_aside(path))
        nodes = self.path.parent
        if not nodes.is_dir():
            nodes.mkdir(parents=True, mode=0o700)  # answers are nobody else's, on a machine with others' homes beside
        path.parent.mkdir(parents=True, exist_ok=True)
        write_beside(path, text.decode("utf-8"))
        self.written[name] = written
        self._note()
        return told

    def changed_by_hand(self, name: str) -> bool:
        """Whether a file is no longer what its cell wrote."""
        path = self.path / name
        text = self.written[name].file.text.encode("utf-8", "replace")
        return path.is_file() and _digest(path) != hashlib.sha256(text).hexdigest()

    def foreign(self) -> list[str]:
        """Files in the folder that no cell wrote: programs can import and open them here, but not when graded."""
        return sorted(path.name for path in self.path.glob("[!.]*.*") if path.name not in self.written)

    def close(self) -> None:
        """At the kernel's end: a folder that no notebook gives a name to would never be found again."""
        if self.notebook is None and self.written:
            _clear(self.path)

    def _move_aside(self, path: Path, why: str = "was not what a cell had written") -> str:
        """Move a student's own file out of the way, and say so."""
        number = 1
        while (kept := path.with_name(f"{path.name}.mine{number if number > 1 else ''}")).exists():
            number += 1
        path.rename(kept)
        return f"{shown(path)} {why}: your file is kept as {shown(kept)}"

    def _note(self) -> None:
        files = {
            name: {
                "sha256": hashlib.sha256(one.file.text.encode("utf-8", "replace")).hexdigest(),
                "cell": one.cell_id,
                "number": one.number,
                "time": time.strftime(_TIME, time.localtime(one.at)),
            }
            for name, one in self.written.items()
        }
        notebook = str(self.notebook) if self.notebook else ""
        kernel = {"pid": os.getpid(), "start": _start_of(os.getpid())}
        write_beside(
            self.path / MANIFEST, json.dumps({"notebook": notebook, "kernel": kernel, "files": files}, indent=1) + "\n"
        )


def shown(path: Path) -> str:
    """Return a path as a student finds it, from where the notebook is."""
    with contextlib.suppress(ValueError):
        return str(path.relative_to(Path.cwd()))
    return str(path)


def notebook_of(variables: dict[str, Any], environment: dict[str, str]) -> Path | None:
    """Return the notebook that a kernel serves, as the front end tells it: VS Code or a Jupyter server; else None."""
    for told in (variables.get("__vsc_ipynb_file__"), environment.get("JPY_SESSION_NAME")):
        if isinstance(told, str) and re.search(r"[^/]\.ipynb$", told):
            path = Path(told).absolute()
            if path.is_file():
                return path
    return None


def _manifest(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    files = found.get("files") if isinstance(found, dict) else None
    if not isinstance(files, dict) or not all(isinstance(entry, dict) for entry in files.values()):
        return {}
    return {**found, "files": {name: entry for name, entry in files.items() if _is_of_a_cell(name)}}


def _is_of_a_cell(name: str) -> bool:
    """Whether a cell can have written a file of this name: a manifest may have been changed by hand."""
    try:
        check_name("file", name)
    except BadNameError:
        return "/" not in name
    return True


def _owner(manifest: dict[str, Any]) -> int | None:
    """The kernel that a manifest is of, if it still lives."""
    kernel = manifest.get("kernel")
    if not isinstance(kernel, dict) or not isinstance(kernel.get("pid"), int):
        return None
    return kernel["pid"] if kernel.get("start") == _start_of(kernel["pid"]) is not None else None


def _start_of(pid: int) -> str | None:
    """When a process began, in the kernel's ticks: with its id it names a process for good. None: there is none."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    return None


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _clear(folder: Path) -> None:
    """Remove what the kit wrote into a folder, and the folder if nothing is left in it."""
    with contextlib.suppress(OSError):
        for name, entry in _manifest(folder).get("files", {}).items():
            if (folder / name).is_file() and _digest(folder / name) == entry.get("sha256"):
                (folder / name).unlink()
        (folder / MANIFEST).unlink(missing_ok=True)
        folder.rmdir()
        folder.parent.rmdir()
