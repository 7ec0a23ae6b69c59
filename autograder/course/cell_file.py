"""The first line of an answer cell says which file the rest of the cell is: `%%node talker`, `%%file camera.yaml`."""

from __future__ import annotations

import re
import sys
import sysconfig
from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder

CELL_BYTES = 64 * 1024
"""The largest answer cell that is read, in bytes of UTF-8."""

NAME_LENGTH = 100
"""Characters of a file's name; file systems allow 255 bytes."""

_NODE_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}(\.[A-Za-z0-9_-]{1,32})*\.(yaml|yml|json|csv)")
_PACKAGE_FILE = re.compile(r"src(/[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}){2,5}")
"""A file of a ROS package, in the place that it has in a colcon workspace."""


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
