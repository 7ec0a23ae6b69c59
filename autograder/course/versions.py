"""The versions of a lab that students have received: a digest of each cell, for each version that was given out.

With them, a cell of an earlier version is told from a cell that a student changed. The record is beside the gradebook,
because it must outlive `make clean`, and only grows.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from autograder.core.record import Record
from autograder.course.cells import cell_digest, grade_id_of, source_of
from autograder.course.paths import CoursePaths


class Version(BaseModel):
    """One version of a lab."""

    model_config = ConfigDict(extra="forbid")

    since: datetime.datetime
    """When the kit saw this version for the first time."""
    cells: dict[str, str]
    """A digest of each cell that has a grade_id, as students receive it."""


_VERSIONS = Record(
    list[Version],
    list,
    "which records the versions of the lab that students have received",
    "students with an earlier version of the lab are then told that they changed its cells",
)


def versions(root: Path, lab: str) -> list[Version]:
    """Return the versions of a lab that have been given out, the oldest first.

    Raises:
        KitError: the record cannot be read.
    """
    return _VERSIONS.read(CoursePaths(root).versions(lab))


def remember(root: Path, lab: str, released: Sequence[Mapping[str, Any]]) -> None:
    """Add a version of a lab to its record, unless it is the version that was added last.

    Args:
        root: the course's folder.
        lab: the lab.
        released: the cells that students receive.

    Raises:
        KitError: the record cannot be read.
    """
    known = versions(root, lab)
    cells = {grade_id_of(dict(cell)): cell_digest(source_of(dict(cell))) for cell in released}
    cells.pop("", None)
    if not known or known[-1].cells != cells:
        now = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
        _VERSIONS.write(CoursePaths(root).versions(lab), [*known, Version(since=now, cells=cells)])


def digests_by_cell(known: Sequence[Version]) -> dict[str, frozenset[str]]:
    """Return the digests that each cell has had in any version, by grade_id."""
    names = {name for version in known for name in version.cells}
    return {name: frozenset(one.cells[name] for one in known if name in one.cells) for name in names}
