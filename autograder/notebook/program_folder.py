"""The folder beside a notebook with the programs and files of its cells, and a record of what the kit wrote there.

Each notebook has its own folder below `nodes`, with a manifest in it. The kit may replace and remove a file only if the
manifest lists it and it has not been changed since it was written. All other files are the student's, and are kept.
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
    """The whole cell, including its first line."""
    cell_id: str
    """The ID of the cell in the notebook; empty if the front end did not send it."""
    number: int
    """The number in the brackets beside the cell when it was run."""
    at: float
    """When it was written, in seconds since 1970."""

    @property
    def origin(self) -> str:
        """The origin of the file in words: `cell [7], run at 14:03:12`."""
        return f"cell [{self.number}], run at {time.strftime('%H:%M:%S', time.localtime(self.at))}"


@dataclass(frozen=True)
class Ran:
    """The entry of a file in a manifest: which text a cell wrote, and when."""

    sha256: str
    at: float
    """When the cell wrote it, in seconds since 1970."""


def read_runs(folder: Path) -> dict[str, Ran]:
    """Return what the cells of a notebook last wrote into its folder, by file name."""
    found = {}
    for name, entry in _manifest(folder).get("files", {}).items():
        with contextlib.suppress(ValueError, OverflowError):
            at = time.mktime(time.strptime(str(entry.get("time")), _TIME))
            found[name] = Ran(str(entry.get("sha256")), at)
    return found


class ProgramFolder:
    """The programs and files that the cells of this kernel wrote.

    Args:
        notebook: the notebook, or None if the front end does not say which one it is.
        place: the folder of the notebook.
        has_cell: says whether the saved notebook has a cell for a file. Without a cell, the file may be the only copy
            of its text.
    """

    def __init__(self, notebook: Path | None, place: Path, has_cell: Callable[[str], bool] = lambda _: True) -> None:
        """Use the folder of this notebook, or one beside it if another running kernel uses that folder."""
        self.notebook = notebook
        self.written: dict[str, Written] = {}
        """The files that cells wrote in this kernel, by file name."""
        self.kept: list[str] = []
        """Sentences for the student about their own files that were in the way."""
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
        """Remove the programs of an earlier kernel, because their cells may have been renamed or deleted since then."""
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
        """Write a cell's file, completely or not at all, and return sentences about a file that was in the way.

        Raises:
            OSError: the file cannot be written.
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
            nodes.mkdir(parents=True, mode=0o700)  # on a shared machine, other users must not read the answers
        path.parent.mkdir(parents=True, exist_ok=True)
        write_beside(path, text.decode("utf-8"))
        self.written[name] = written
        self._note()
        return told

    def changed_by_hand(self, name: str) -> bool:
        """Whether a file differs from what its cell wrote."""
        path = self.path / name
        text = self.written[name].file.text.encode("utf-8", "replace")
        return path.is_file() and _digest(path) != hashlib.sha256(text).hexdigest()

    def foreign(self) -> list[str]:
        """Return the files in the folder that no cell wrote.

        Programs can import and open them here, but not when they are graded.
        """
        return sorted(path.name for path in self.path.glob("[!.]*.*") if path.name not in self.written)

    def close(self) -> None:
        """Clear the folder at the kernel's end if it has no notebook's name, because it would never be found again."""
        if self.notebook is None and self.written:
            _clear(self.path)

    def _move_aside(self, path: Path, why: str = "was not what a cell had written") -> str:
        """Move a student's own file out of the way, and return a sentence that says so."""
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
    """Return a path as shown to a student, relative to the working directory, which is that of the notebook."""
    with contextlib.suppress(ValueError):
        return str(path.relative_to(Path.cwd()))
    return str(path)


RENAMED = "If you renamed the notebook, shut down its kernel and open it again."
"""What to do if a notebook is no longer where it was when its kernel started."""


def notebook_of(variables: dict[str, Any], environment: dict[str, str]) -> Path | None:
    """Return the notebook of a kernel, if the front end (VS Code or a Jupyter server) names it; otherwise None."""
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
    """Whether a cell can have written a file with this name. It is checked because a manifest can be edited by hand."""
    try:
        check_name("file", name)
    except BadNameError:
        return "/" not in name
    return True


def _owner(manifest: dict[str, Any]) -> int | None:
    """Return the process ID of the kernel that wrote a manifest, if it is still running."""
    kernel = manifest.get("kernel")
    if not isinstance(kernel, dict) or not isinstance(kernel.get("pid"), int):
        return None
    return kernel["pid"] if kernel.get("start") == _start_of(kernel["pid"]) is not None else None


def _start_of(pid: int) -> str | None:
    """Return when a process began, in ticks of the system, or None if there is no such process.

    The begin and the process ID together identify a process uniquely.
    """
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    return None


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _clear(folder: Path) -> None:
    """Remove the files that the kit wrote into a folder, and the folder if it is empty then."""
    with contextlib.suppress(OSError):
        for name, entry in _manifest(folder).get("files", {}).items():
            if (folder / name).is_file() and _digest(folder / name) == entry.get("sha256"):
                (folder / name).unlink()
        (folder / MANIFEST).unlink(missing_ok=True)
        folder.rmdir()
        folder.parent.rmdir()
