"""Who is in a lab's class, and what the learning platform called each submission: kept for what goes back to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.paths import CoursePaths

_OF_PLATFORMS = ("canvas_id", "moodle_id", "repository", "email")
"""Kinds of names that mean one person on a platform, the surest first."""
_IN_EACH_LAB = ("moodle_id",)
"""Those that a platform gives anew for each assignment."""


class Taken(BaseModel):
    """One student's submission, as it came in."""

    model_config = ConfigDict(extra="forbid")

    source: str
    """The folder or zip that it was taken from."""
    around: str = ""
    """The folders and zips in the source that lay around the class."""
    file: str = ""
    """The notebook's path in there, with the platform's names; empty where no platform gave it out."""
    owner: dict[str, str] = {}
    """What the platform calls the student, by kind."""
    late: bool = False
    """The platform has marked it as late."""
    left: bool = False
    """The student was not among the submissions when they were taken in once more, or never was, and somebody has said
    that this is right."""


_CLASS = TypeAdapter(dict[str, Taken])


def read_class(root: Path, lab: str) -> dict[str, Taken]:
    """Return what is known of a lab's submissions, by student; empty if nothing was taken in yet.

    Raises:
        KitError: it cannot be understood, so that nobody could say who is missing.
    """
    path = CoursePaths(root).taken(lab)
    try:
        return _CLASS.validate_json(path.read_bytes())
    except FileNotFoundError:
        return {}
    except (OSError, ValidationError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not as this version of the kit writes it"
        raise KitError(
            f"{path}, which records who was in the class in the last run, cannot be read: {why}.",
            "Replace it with an earlier copy. If you have none, move the file away; the next run then cannot tell who"
            " is missing or was replaced.",
        ) from error


def left_class(root: Path, lab: str) -> set[str]:
    """Return who has left the class of a lab."""
    return {student for student, taken in read_class(root, lab).items() if taken.left}


def person(owner: Mapping[str, str]) -> tuple[str, str] | None:
    """Return by what a platform tells one person from all others; None if a name is all that is known."""
    return next(((kind, owner[kind]) for kind in _OF_PLATFORMS if owner.get(kind)), None)


def known_persons(root: Path, lab: str) -> dict[tuple[str, str], str]:
    """Return what the persons of a course's platforms are called here, as taken in before, for this lab or another."""
    known: dict[tuple[str, str], str] = {}
    folder = CoursePaths(root).taken(lab).parent
    others = [path.stem for path in sorted(folder.glob("*.json")) if path.stem != lab]
    for name in (*others, lab):  # what this lab's class says counts most
        for student, taken in read_class(root, name).items():
            who = person(taken.owner)
            if who is not None and (name == lab or who[0] not in _IN_EACH_LAB):
                known[who] = student
    return known


def keep_class(root: Path, lab: str, taken: Mapping[str, Taken], gone: Mapping[str, Taken]) -> None:
    """Note what was taken in.

    Grades of who has left stay in the gradebook, and count again when the student is back.

    Args:
        root: of the course.
        lab: that the submissions answer.
        taken: what is known of each, by student.
        gone: who is not in the class any more.
    """
    known = read_class(root, lab)
    for student in gone:
        CoursePaths(root).feedback_page(student, lab).unlink(missing_ok=True)
    known.update({student: one.model_copy(update={"left": True}) for student, one in gone.items()})
    known.update(taken)
    content = _CLASS.dump_json(dict(sorted(known.items())), indent=1) + b"\n"
    path = CoursePaths(root).taken(lab)
    if not path.is_file() or path.read_bytes() != content:
        write_beside(path, content)
