"""Who is in a lab's class, and what the learning platform called each submission: kept for what goes back to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths


class Taken(BaseModel):
    """One student's submission, as it came in."""

    model_config = ConfigDict(extra="forbid")

    source: str
    """The folder or zip that it was taken from."""
    file: str = ""
    """The notebook's path in there, with the platform's names; empty where no platform gave it out."""
    owner: dict[str, str] = {}
    """What the platform calls the student, by kind."""
    late: bool = False
    """The platform has marked it as late."""
    left: bool = False
    """The source was taken in once more, and the student was not in it: they have left the class."""


_CLASS = TypeAdapter(dict[str, Taken])


def read_class(root: Path, lab: str) -> dict[str, Taken]:
    """Return what is known of a lab's submissions, by student; empty if nothing was taken in yet."""
    try:
        return _CLASS.validate_json(CoursePaths(root).taken(lab).read_bytes())
    except (OSError, ValidationError):
        return {}


def left_class(root: Path, lab: str) -> set[str]:
    """Return who has left the class of a lab."""
    return {student for student, taken in read_class(root, lab).items() if taken.left}


def keep_class(root: Path, lab: str, source: Path, taken: Mapping[str, Taken], complete: bool) -> list[str]:
    """Note what was taken in from a source.

    Who was taken from the same source before, and is not in it any more, has left the class. Grades stay in the
    gradebook, and count again when the student is back.

    Args:
        root: of the course.
        lab: that the submissions answer.
        source: where they came from.
        taken: what is known of each, by student.
        complete: nothing in the source was left out; otherwise nobody can say who has left.

    Returns:
        Sentences about who has left.
    """
    known = read_class(root, lab)
    missing = [
        student
        for student, before in known.items()
        if complete and before.source == str(source.resolve()) and student not in taken and not before.left
    ]
    for student in missing:
        known[student].left = True
        CoursePaths(root).feedback_page(student, lab).unlink(missing_ok=True)
    known.update(taken)
    content = _CLASS.dump_json(dict(sorted(known.items())), indent=1) + b"\n"
    path = CoursePaths(root).taken(lab)
    if not path.is_file() or path.read_bytes() != content:
        write_beside(path, content)
    return [
        f"{student} is not among the submissions any more, and has left grades.csv, the class page and the exports."
        " The gradebook keeps the grades."
        for student in missing
    ]
