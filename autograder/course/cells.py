"""Read a cell of a lab: its source, its grade_id, the file that it names, and the lines that students do not see.

The first line of an answer cell may say which file the rest of the cell is written to: `%%node talker`, `%%file
camera.yaml`. Lines that students do not receive are between `BEGIN …` and `END …`, as in nbgrader.
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
"""The line that students find instead of a solution. It is a comment both in Python and in YAML."""
TEXT_STUB = "YOUR ANSWER HERE"

_HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*\s*$", re.MULTILINE)
_FENCED = re.compile(r"^(```|~~~).*?^\1[`~]*$", re.MULTILINE | re.DOTALL)
"""A code block, in which a line that begins with `#` is no heading."""

MORE_AT_GRADING = "# More is checked here when the lab is graded."
"""The line that replaces hidden tests in a released check cell."""

MARK = re.compile(r"\b(BEGIN|END) (SOLUTION|HIDDEN TESTS|MARK SCHEME)\b")
"""A mark: whether it begins or ends a region, and the kind of the region."""

_HIDDEN = "HIDDEN TESTS"

CELL_BYTES = 64 * 1024
"""The size of the largest answer cell that is read, in bytes of UTF-8."""

NAME_LENGTH = 100
"""The number of characters that a file name may have. File systems allow 255 bytes."""

_NODE_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}(\.[A-Za-z0-9_-]{1,32})*\.(yaml|yml|json|csv)")
_PACKAGE_FILE = re.compile(r"src(/[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}){2,5}")
"""The path of a file of a ROS package in a colcon workspace."""

FOR_CHECKS = "for-checks"
"""The tag of a cell that students run but need not read. Like a check, it is collapsed in the released notebook."""


def nbgrader_of(cell: dict[str, Any]) -> dict[str, Any]:
    """Return a cell's nbgrader metadata; empty if the cell has none or if it is not a mapping."""
    metadata = cell.get("metadata")
    nbgrader = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    return nbgrader if isinstance(nbgrader, dict) else {}


def grade_id_of(cell: dict[str, Any]) -> str:
    """Return a cell's grade_id; empty if the cell has none."""
    grade_id = nbgrader_of(cell).get("grade_id")
    return encodable(grade_id) if isinstance(grade_id, str) else ""


def cell_digest(source: str) -> str:
    """Return a digest of a cell's text, without spaces at the ends of lines and blank lines around the text."""
    lines = [line.rstrip() for line in source.replace("\r\n", "\n").strip().split("\n")]
    return hashlib.sha256("\n".join(lines).encode("utf-8", "replace")).hexdigest()[:16]


def blank_mark(source: str) -> dict[str, str]:
    """Return metadata for an answer cell, under the key `autograder`, that shows later whether the cell was changed."""
    return {"blank": cell_digest(source)}


def blank_mark_of(cell: dict[str, Any]) -> str:
    """Return the digest in a cell's `blank_mark`; empty if the cell has no such mark."""
    metadata = cell.get("metadata")
    mark = metadata.get("autograder") if isinstance(metadata, dict) else None
    return str(mark.get("blank", "")) if isinstance(mark, dict) else ""


def source_of(cell: dict[str, Any]) -> str:
    """Return a cell's source as one string that UTF-8 can encode. Notebooks store it as a string or a list of lines.

    Raises:
        ValueError: the source is neither a string nor a list of lines.
    """
    source = cell.get("source", "")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    if not isinstance(source, str):
        raise ValueError("a cell's source is neither text nor lines of text")
    return encodable(source).replace("\r\n", "\n").replace("\r", "\n")


def for_checks(cell: dict[str, Any]) -> bool:
    """Return whether a cell has the tag `for-checks`: only checks use it, for example a lab's own expectations."""
    metadata = cell.get("metadata")
    tags = metadata.get("tags") if isinstance(metadata, dict) else None
    return isinstance(tags, list) and FOR_CHECKS in tags


def headings(markdown: str) -> list[tuple[int, str]]:
    """Return the headings in a cell's text as pairs of level and title. Levels start at 1."""
    return [(len(marks), text) for marks, text in _HEADING.findall(_FENCED.sub("", markdown))]


class BadNameError(ValueError):
    """The name in a cell's first line is not allowed as the name of a file. The message tells a student why."""


@dataclass(frozen=True)
class CellFile:
    """A cell that names a file."""

    magic: str
    """`node` or `file`."""
    name: str
    """The name as it is written in the cell."""
    text: str
    """The text of the file. A program begins with the cell's first line as a comment, so that its line numbers are
    those that JupyterLab shows. In other files this line is left out, because their format may have no comments."""

    @property
    def file_name(self) -> str:
        """The name of the file in the folder of the submission's programs."""
        return f"{self.name}.py" if self.magic == "node" else self.name


def check_name(magic: str, name: str) -> None:
    """Refuse a name unless it is the plain name of a program or data file, or the path of a package's file.

    Raises:
        BadNameError: the name is refused; the message gives the reason.
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
        module = name.removesuffix(".py")
        if module != name and _NODE_NAME.fullmatch(module):
            raise BadNameError(
                f"`{name[:80]}` cannot name a file, because a Python file is written with `%%node {module}`. This is"
                f" also the way to a module of your own: your other programs can then say `from {module} import …`."
            )
        raise BadNameError(
            f"`{name[:80]}` cannot name a file: use letters, digits, `-`, `_` and dots, no folder,"
            " and end in .yaml, .yml, .json or .csv. A file of a package begins with the package's folder,"
            " such as `src/car_sensors/package.xml`."
        )


@cache
def names_installed_module(name: str) -> bool:
    """Return whether a program with this name would hide a module of Python or of an installed package."""
    folders = {sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")}
    spec = PathFinder.find_spec(name, sorted(folders))
    return name in sys.stdlib_module_names or (spec is not None and spec.origin is not None)


def check_free(file: CellFile) -> None:
    """Refuse a program that would hide an installed module, which it or another program may want to import.

    Raises:
        BadNameError: the name is refused; the message gives the reason.
    """
    if file.magic == "node" and names_installed_module(file.name):
        raise BadNameError(
            f"`{file.name}` is the name of an installed module: a program of this name would hide it from every"
            f" `import {file.name}`. Choose another name."
        )


def parse(source: str) -> CellFile | None:
    """Return the file that a cell's first line names; None if the cell names no file.

    Raises:
        BadNameError: the first line names a file, but the name is not allowed.
    """
    lines = source.replace("\r\n", "\n").split("\n")
    above = next((number for number, line in enumerate(lines) if line.strip()), len(lines))
    if above < len(lines):  # IPython removes the indentation of the first line from all lines
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
    """Remove the lines between `BEGIN mark` and `END mark`, or replace them with a stub, as nbgrader does."""
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
    """Return a check cell as students receive it, with a line in each place where more is checked at grading."""
    return without_region(source, _HIDDEN, MORE_AT_GRADING)


def hidden_lines(lines: Sequence[str]) -> set[int]:
    """Return the numbers of the lines that are hidden from students, counted from 1."""
    hidden, inside = set(), False
    for number, line in enumerate(lines, start=1):
        inside = (inside or f"BEGIN {_HIDDEN}" in line) and f"END {_HIDDEN}" not in line
        if inside:
            hidden.add(number)
    return hidden
