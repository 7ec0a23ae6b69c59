"""Record who is in a lab's class and what the learning platform called each submission.

The exports that go back to the platform need this, and so does the next run, to find out who is missing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from autograder.core.record import Record
from autograder.course.paths import CoursePaths

_OF_PLATFORMS = ("canvas_id", "moodle_id", "repository", "email")
"""The kinds of names that identify one person on a platform, the most reliable first."""
_IN_EACH_LAB = ("moodle_id",)
"""The kinds of names that are different for each assignment."""


class Taken(BaseModel):
    """What is recorded about the submission of one student."""

    model_config = ConfigDict(extra="forbid")

    source: str
    """The folder or zip that it was taken from."""
    around: str = ""
    """The path of the folders and zips in the source that contained the whole class."""
    file: str = ""
    """The path of the notebook in the source, with the platform's names; empty if it does not come from a platform."""
    owner: dict[str, str] = {}
    """The platform's names for the student, by kind."""
    late: bool = False
    """Whether the platform has marked the submission as late."""
    left: bool = False
    """Whether the student has left the class: either is missing, which a person has accepted, or has a new name."""
    now: str = ""
    """The student's new name; empty if the student has none."""


_CLASS = Record(
    dict[str, Taken],
    dict,
    "which records who was in the class in the last run",
    "the next run then cannot tell who is missing or was replaced",
)


def read_class(root: Path, lab: str) -> dict[str, Taken]:
    """Return what is recorded about a lab's submissions, by student; empty if nothing has been taken in yet.

    Raises:
        KitError: the record cannot be read, so that it is unknown who is missing.
    """
    return _CLASS.read(CoursePaths(root).taken(lab))


def left_class(root: Path, lab: str) -> set[str]:
    """Return the students who have left the class of a lab."""
    return {student for student, taken in read_class(root, lab).items() if taken.left}


def person(owner: Mapping[str, str]) -> tuple[str, str] | None:
    """Return the kind and value of the name that identifies a person on a platform; None if there is no such name."""
    return next(((kind, owner[kind]) for kind in _OF_PLATFORMS if owner.get(kind)), None)


def known_persons(root: Path, lab: str) -> dict[tuple[str, str], str]:
    """Return the names in the gradebook of all persons who were taken in before, for this lab or for another."""
    persons = _PERSONS.read(CoursePaths(root).persons)
    known = {(one.kind, one.value): one.name for one in persons if one.lab in ("", lab)}
    folder = CoursePaths(root).taken(lab).parent
    others = [path.stem for path in sorted(folder.glob("*.json")) if path.stem != lab]
    for name in (*others, lab):  # this lab's record comes last, so it takes precedence
        for student, taken in read_class(root, name).items():
            who = person(taken.owner)
            if who is not None and not taken.now and (name == lab or who[0] not in _IN_EACH_LAB):
                known[who] = student
    return known


def new_names(root: Path) -> dict[str, str]:
    """Return the new names of students whose names have changed, by their old names, from the records of all labs."""
    records = [read_class(root, path.stem) for path in sorted(CoursePaths(root).taken("x").parent.glob("*.json"))]
    return {student: taken.now for record in records for student, taken in record.items() if taken.now}


def rename_in_class(root: Path, lab: str, old: str, new: str) -> None:
    """Write the new name of a student into the record of a lab's class, if the class has only the old one."""
    known = read_class(root, lab)
    if old in known and not known[old].left:
        known.setdefault(new, known[old])
        known[old] = known[old].model_copy(update={"left": True, "now": new})
        _CLASS.write(CoursePaths(root).taken(lab), dict(sorted(known.items())))


class _Person(BaseModel):
    """A person on a platform, and the person's name in the gradebook."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    lab: str
    """The lab for which the platform's number holds; empty if it holds for all labs."""
    kind: str
    value: str
    name: str


_PERSONS = Record(
    list[_Person],
    list,
    "which remembers the names of the students",
    "two students with the same name may then be called differently than before",
)


def _remember_persons(root: Path, lab: str, taken: Mapping[str, Taken], renamed: Mapping[str, str]) -> None:
    known = {(one.lab, one.kind, one.value): one for one in _PERSONS.read(CoursePaths(root).persons)}
    before = dict(known)
    for key, before_now in before.items():
        known[key] = before_now.model_copy(update={"name": renamed.get(before_now.name, before_now.name)})
    for name, one in taken.items():
        who = person(one.owner)
        if who is not None:
            where = lab if who[0] in _IN_EACH_LAB else ""
            known[where, *who] = _Person(lab=where, kind=who[0], value=who[1], name=name)
    if known != before:
        _PERSONS.write(CoursePaths(root).persons, [known[key] for key in sorted(known)])


def keep_class(
    root: Path, lab: str, taken: Mapping[str, Taken], gone: Mapping[str, Taken], renamed: Mapping[str, str]
) -> None:
    """Record what was taken in, and remove the feedback pages of students who have left.

    Their grades stay in the gradebook, and count again if they come back.

    Args:
        root: the course's folder.
        lab: the lab to which the submissions belong.
        taken: what is known about each submission, by student.
        gone: the students who are no longer in the class.
        renamed: the new names of students whose names have changed, by their old names.
    """
    _remember_persons(root, lab, taken, renamed)
    known = read_class(root, lab)
    for student in (*gone, *renamed):
        CoursePaths(root).feedback_page(student, lab).unlink(missing_ok=True)
        left = gone.get(student) or known.get(student) or Taken(source="")  # this lab may not have the old name
        known[student] = left.model_copy(update={"left": True, "now": renamed.get(student, "")})
    known.update(taken)
    _CLASS.write(CoursePaths(root).taken(lab), dict(sorted(known.items())))
