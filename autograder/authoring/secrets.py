"""What of a lab students may not get, and where it stands in what they would get.

A hidden test, a solution and a mark scheme are looked for as they stand in the lab's source, whatever the spaces; of
all but a marked solution also each line that is long enough to be told from any other.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from autograder.course.cells import nbgrader_of, source_of
from autograder.course.paths import CoursePaths

_REGION = re.compile(r"BEGIN (HIDDEN TESTS|SOLUTION|MARK SCHEME)[^\n]*\n(.*?)^[^\n]*END \1", re.DOTALL | re.MULTILINE)
_MARK = re.compile(r"#+ (BEGIN|END) (HIDDEN TESTS|SOLUTION|MARK SCHEME)$")
_TELLING = 24
"""Characters without spaces from which on a text stands for itself: shorter ones occur everywhere."""
_PACKED = (".whl", ".zip")


@dataclass(frozen=True)
class Secret:
    """A text of a lab that students may not get."""

    lab: str
    kind: str
    text: str
    """Without spaces and ends of lines."""


def secrets_of(root: Path, labs: Sequence[str]) -> list[Secret]:
    """Return what of these labs may not be given out; what students receive of the lab anyway is no secret."""
    paths = CoursePaths(root)
    found: dict[str, Secret] = {}
    for lab in labs:
        source = paths.solutions / lab / f"{lab}.ipynb"
        if not source.is_file():
            continue
        given = "".join(_dense(text) for text in _sources(paths.labs / lab / f"{lab}.ipynb"))
        for cell in json.loads(source.read_text(encoding="utf-8"))["cells"]:
            text = source_of(cell)
            regions = _REGION.findall(text)
            if nbgrader_of(cell).get("solution") and "BEGIN SOLUTION" not in text:  # then all of it is one
                regions.append(("answer", text))
            for kind, inner in regions:
                pieces = [inner] if kind == "SOLUTION" else [inner, *inner.split("\n")]
                for piece in map(_dense, pieces):
                    if len(piece) >= _TELLING and piece not in given:
                        found.setdefault(piece, Secret(lab, kind.lower().rstrip("s"), piece))
    return list(found.values())


def leaks(folder: Path, secrets: Sequence[Secret]) -> list[str]:
    """Say which files of a folder, or of the wheels and zips in it, hold a secret, or the mark that begins one."""
    found = []
    for name, text in _texts(folder):
        dense = _dense(text)
        found += [f"{name}: a {one.kind} of {one.lab}" for one in secrets if one.text in dense]
        if name.endswith(".ipynb") and any(
            _MARK.search(line.strip()) for line in text.replace("\\n", "\n").split("\n")
        ):
            found.append(f"{name}: the mark of a solution or a hidden test")
    return found


def _dense(text: str) -> str:
    return "".join(text.split())


def _sources(notebook: Path) -> list[str]:
    return [source_of(cell) for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]]


def _texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Every file as text; of a notebook the cells, in which no quotation mark is written as two characters."""
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = str(path.relative_to(folder))
        if path.suffix in _PACKED:
            with zipfile.ZipFile(path) as packed:
                for inner in packed.namelist():
                    yield from _as_text(f"{name}/{inner}", packed.read(inner))
        else:
            yield from _as_text(name, path.read_bytes())


def _as_text(name: str, content: bytes) -> Iterator[tuple[str, str]]:
    text = content.decode("utf-8", "replace")
    yield name, text
    if name.endswith(".ipynb"):
        yield name, "\n".join(source_of(cell) for cell in json.loads(text)["cells"])
