"""What one cell of a lab says: its source, its grade_id, the file it names, and what students do not see of it.

The first line of an answer cell may say which file the rest of the cell is: `%%node talker`, `%%file camera.yaml`. What
students do not receive stands between `BEGIN …` and `END …`, as in nbgrader.
"""

from __future__ import annotations

import hashlib
import re
import sys
import sysconfig
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder
from typing import Any

from autograder.core.results import encodable

CODE_STUB = "# YOUR CODE HERE"
"""What students find in place of a solution: a comment in Python and in YAML."""
TEXT_STUB = "YOUR ANSWER HERE"

_HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*\s*$", re.MULTILINE)
_FENCED = re.compile(r"^(```|~~~).*?^\1[`~]*$", re.MULTILINE | re.DOTALL)
"""Code, in which such a line is a comment."""

MORE_AT_GRADING = "# More is checked here when the lab is graded."
"""The line that stands in a released check cell where hidden tests were taken out."""

MARK = re.compile(r"\b(BEGIN|END) (SOLUTION|HIDDEN TESTS|MARK SCHEME)\b")
"""Each of the marks: which end of a region, and of which."""

_HIDDEN = "HIDDEN TESTS"

CELL_BYTES = 64 * 1024
"""The largest answer cell that is read, in bytes of UTF-8."""

NAME_LENGTH = 100
"""Characters of a file's name; file systems allow 255 bytes."""

_NODE_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}(\.[A-Za-z0-9_-]{1,32})*\.(yaml|yml|json|csv)")
_PACKAGE_FILE = re.compile(r"src(/[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}){2,5}")
"""A file of a ROS package, in the place that it has in a colcon workspace."""

FOR_CHECKS = "for-checks"
"""The tag of a cell that students run and need not read: it is folded in the released notebook, as checks are."""


def nbgrader_of(cell: dict[str, Any]) -> dict[str, Any]:
    """Return a cell's nbgrader metadata; empty if it has none, or something else in its place."""
    metadata = cell.get("metadata")
    nbgrader = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    return nbgrader if isinstance(nbgrader, dict) else {}


def grade_id_of(cell: dict[str, Any]) -> str:
    """Return a cell's grade_id; empty if it has none."""
    grade_id = nbgrader_of(cell).get("grade_id")
    return encodable(grade_id) if isinstance(grade_id, str) else ""


def cell_digest(source: str) -> str:
    """Return what tells one text of a cell from another; blanks at the ends of lines and of the cell do not count."""
    lines = [line.rstrip() for line in source.replace("\r\n", "\n").strip().split("\n")]
    return hashlib.sha256("\n".join(lines).encode("utf-8", "replace")).hexdigest()[:16]


def blank_mark(source: str) -> dict[str, str]:
    """Return metadata for an answer cell, below `autograder`, by which a notebook knows that it is still untouched."""
    return {"blank": cell_digest(source)}


def blank_mark_of(cell: dict[str, Any]) -> str:
    """Return the digest in a cell's `blank_mark`; empty if it has none."""
    metadata = cell.get("metadata")
    mark = metadata.get("autograder") if isinstance(metadata, dict) else None
    return str(mark.get("blank", "")) if isinstance(mark, dict) else ""


def source_of(cell: dict[str, Any]) -> str:
    """Return a cell's source as one string that can be encoded; notebooks hold it as a string or as lines.

    Raises:
        ValueError: it is neither.
    """
    source = cell.get("source", "")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    if not isinstance(source, str):
        raise ValueError("a cell's source is neither text nor lines of text")
    return encodable(source).replace("\r\n", "\n").replace("\r", "\n")


def for_checks(cell: dict[str, Any]) -> bool:
    """Whether a cell holds what only checks use, such as a lab's own expectations: it has the tag `for-checks`."""
    metadata = cell.get("metadata")
    tags = metadata.get("tags") if isinstance(metadata, dict) else None
    return isinstance(tags, list) and FOR_CHECKS in tags


def headings(markdown: str) -> list[tuple[int, str]]:
    """Return the headings in a cell's text, each with its level, from 1."""
    return [(len(marks), text) for marks, text in _HEADING.findall(_FENCED.sub("", markdown))]


class BadNameError(ValueError):
    """The name in the cell's first line cannot be the name of a file; the message says why, for a student."""


@dataclass(frozen=True)
class CellFile:
    """A cell that names a file."""

    magic: str
    """`node` or `file`."""
    name: str
    """The name as it stands in the cell."""
    text: str
    """The file's text. A program begins with the cell's first line as a comment, so that its lines have the numbers
    that JupyterLab shows; of another file, which may have no comments, that line is left out."""

    @property
    def file_name(self) -> str:
        """The file's name in the folder of the submission's programs."""
        return f"{self.name}.py" if self.magic == "node" else self.name


def check_name(magic: str, name: str) -> None:
    """Refuse every name that is not plainly a program or a data file in the same folder.

    Raises:
        BadNameError: with the reason.
    """
    if not name:
        example = "talker" if magic == "node" else "camera.yaml"
        raise BadNameError(f"%%{magic} needs a name, such as `%%{magic} {example}`.")
    if magic == "node" and not _NODE_NAME.fullmatch(name):
        raise BadNameError(
            f"`{name[:80]}` cannot name a program: use small letters, digits and underscores, begin with a letter,"
            " and leave out `.py`."
        )
    if len(name) > NAME_LENGTH:
        raise BadNameError(f"The name `{name[:40]}…` is too long: at most {NAME_LENGTH} characters.")
    if magic == "file" and not _FILE_NAME.fullmatch(name) and not _PACKAGE_FILE.fullmatch(name):
        raise BadNameError(
            f"`{name[:80]}` cannot name a file: use letters, digits, `-`, `_` and dots, no folder,"
            " and end in .yaml, .yml, .json or .csv. A file of a package begins with the package's folder,"
            " such as `src/car_sensors/package.xml`."
        )


@cache
def names_installed_module(name: str) -> bool:
    """Whether a program of this name would stand before a module of Python's or of an installed package."""
    folders = {sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")}
    spec = PathFinder.find_spec(name, sorted(folders))
    return name in sys.stdlib_module_names or (spec is not None and spec.origin is not None)


def check_free(file: CellFile) -> None:
    """Refuse a program that would hide a module which it, or another program, may want to import.

    Raises:
        BadNameError: with the reason.
    """
    if file.magic == "node" and names_installed_module(file.name):
        raise BadNameError(
            f"`{file.name}` is the name of an installed module: a program of this name would hide it from every"
            f" `import {file.name}`. Choose another name."
        )


def parse(source: str) -> CellFile | None:
    """Read a cell's first line; None if the cell names no file.

    Raises:
        BadNameError: it wants to name a file, but not with a name that is allowed.
    """
    lines = source.replace("\r\n", "\n").split("\n")
    above = next((number for number, line in enumerate(lines) if line.strip()), len(lines))
    if above < len(lines):  # IPython takes off what the first line is indented by
        indent = lines[above].removesuffix(lines[above].lstrip(" \t"))
        lines = [line.removeprefix(indent) for line in lines]
    match = re.fullmatch(r"%%(node|file)(\s.*)?", lines[above]) if above < len(lines) else None
    if match is None:
        return None
    magic, name = match.group(1), (match.group(2) or "").strip()
    check_name(magic, name)
    first = [f"# %%{magic} {name}"] if magic == "node" or name.endswith(".py") else []
    text = "\n".join([""] * above + first + lines[above + 1 :])
    return CellFile(magic, name, text if text.endswith("\n") or not text else text + "\n")


def without_region(source: str, mark: str, stub: str | None = None) -> str:
    """Drop the lines between `BEGIN mark` and `END mark`, or put a stub in their place, as nbgrader does."""
    lines: list[str] = []
    inside = False
    for line in source.split("\n"):
        if f"BEGIN {mark}" in line:
            inside = True
            if stub is not None:
                lines.append(re.match(r"\s*", line).group() + stub)  # type: ignore[union-attr]
        elif f"END {mark}" in line:
            inside = False
        elif not inside:
            lines.append(line)
    return "\n".join(lines)


def without_hidden_tests(source: str) -> str:
    """Return a check cell as students receive it: a line says where more is checked at grading."""
    return without_region(source, _HIDDEN, MORE_AT_GRADING)


def hidden_lines(lines: Sequence[str]) -> set[int]:
    """Return the numbers of the lines that are hidden from students, counted from 1."""
    hidden, inside = set(), False
    for number, line in enumerate(lines, start=1):
        inside = (inside or f"BEGIN {_HIDDEN}" in line) and f"END {_HIDDEN}" not in line
        if inside:
            hidden.add(number)
    return hidden
