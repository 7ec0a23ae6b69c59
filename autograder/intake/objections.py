"""Where a class stops before anything is taken in: somebody would be lost or replaced, or nobody knows who it is."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from autograder.core.errors import KitError
from autograder.intake.asked import Accepted
from autograder.intake.naming import Student, file_name
from autograder.intake.reading import Reading
from autograder.intake.record import Taken, person
from autograder.intake.roster import Roster
from autograder.intake.words import count, some


@dataclass(frozen=True)
class Gone:
    """Who is not among the submissions, though the roster or the last time says so."""

    lost: Mapping[str, Taken]
    renamed: Mapping[str, Taken]
    """Of them, those who are here under another name, because the roster has changed."""


def gone(source: Path, students: Sequence[Student], roster: Roster | None, before: Mapping[str, Taken]) -> Gone:
    """Return who is not among the submissions.

    Of what was taken in from elsewhere only that counts which was this class: some of its students are in this one.

    Args:
        source: of the submissions.
        students: in it.
        roster: of the course, if it has one.
        before: what was taken in before for this lab, by student.
    """
    here = {file_name(student.name) for student in students}
    place = str(source.resolve())
    others = {taken.source for name, taken in before.items() if name in here and not taken.left}
    missing = {
        name: taken
        for name, taken in before.items()
        if name not in here and not taken.left and taken.source in {place, *others}
    }
    for name in map(file_name, roster.students if roster is not None else ()):
        if name not in here and name not in before:
            missing[name] = Taken(source=place)
    persons = {person(claim.owner) for student in students for claim in student.claims} - {None}
    renamed = {name: taken for name, taken in missing.items() if person(taken.owner) in persons}
    return Gone({name: taken for name, taken in missing.items() if name not in renamed}, renamed)


def stop(
    source: Path,
    students: Sequence[Student],
    reading: Reading,
    lost: Collection[str],
    before: Mapping[str, Taken],
    accepted: Collection[Accepted],
) -> None:
    """Stop where somebody would be lost or replaced, or is not in the roster, and nobody has accepted that.

    Args:
        source: of the submissions.
        students: in it.
        reading: how they were found.
        lost: who is not among them.
        before: what was taken in before for this lab, by student.
        accepted: what somebody has said to be right.

    Raises:
        KitError: nobody has.
    """
    strangers = [repr(student.name[:100]) for student in students if not student.listed]
    objections = {
        Accepted.SMALLER: _missing(source, sorted(lost)),
        Accepted.ROSTER: _strangers(strangers),
        Accepted.REPLACED: some(_replaced(students, before), " "),
    }
    open_ones = {kind: sentence for kind, sentence in objections.items() if sentence and kind not in accepted}
    if not open_ones:
        return
    options = " ".join(f"--accept {kind.value}" for kind in open_ones)
    how = f"what {reading.format.title} gives out" if reading.format.title else "a class without a platform"
    inside = f", inside {'/'.join(reading.around)[:100]!r}" if reading.around else ""
    raise KitError(
        f"{' '.join(open_ones.values())} It was read as {how}{inside}, with {count(len(students), 'student')}."
        " Nothing was graded.",
        f"Look at the submissions and at who is meant. If this is right, go on with {options}.",
    )


def _strangers(names: Sequence[str]) -> str:
    fits = "fits" if len(names) == 1 else "fit"
    return f"{some(names, ', ')} {fits} no student of the roster, or several." if names else ""


def _missing(source: Path, lost: Sequence[str]) -> str:
    if not lost:
        return ""
    are = "is" if len(lost) == 1 else "are"
    return (
        f"{count(len(lost), 'student')} of the roster or of the last time {are} not in {source}:"
        f" {some([repr(name[:100]) for name in lost], ', ')}."
    )


def _replaced(students: Sequence[Student], before: Mapping[str, Taken]) -> list[str]:
    """Sentences about whose work would take the place of somebody else's."""
    told = []
    first: dict[str, Student] = {}
    for student in students:
        name = file_name(student.name)
        if name in first:
            one, other = (given.claims[0].entry.name[:80] for given in (first[name], student))
            told.append(f"{one!r} and {other!r} mean the same student, {name[:80]!r}; nothing says which one counts.")
        first.setdefault(name, student)
        was = person(before[name].owner) if name in before and not before[name].left else None
        now = person(student.claims[0].owner)
        if was is not None and now is not None and was[0] == now[0] and was != now:
            told.append(f"{name[:80]!r} was {was[1][:80]!r} the last time, and is {now[1][:80]!r} now.")
    return told
