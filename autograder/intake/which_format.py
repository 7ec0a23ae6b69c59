"""Decide how a class is read: which platform exported it, and which folders and zips are around it.

A class without a platform is always one of the possible readings. If two readings are possible, the kit does not guess.
It stops with a message, and an option of the command names the format.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from autograder.core.errors import KitError
from autograder.intake.entries import Claim, Entry, Kind, NotUnderstoodError, Recognised, listed
from autograder.intake.formats import CLASSROOM50, PLAIN, PLATFORMS, Format, by_lab, owner_of
from autograder.intake.members import is_hidden, is_notebook
from autograder.intake.roster import given_name
from autograder.intake.which_notebook import choose, is_of_lab
from autograder.intake.words import some

_MOST_AROUND = 3
"""The number of folders and zips that may be around a class, one inside the other."""


@dataclass
class Reading:
    """A way to read the entries of a class."""

    format: Format
    recognised: Recognised
    around: tuple[str, ...] = ()
    """The folders and zips in the source that are around the class."""
    notes: list[str] = field(default_factory=list)
    """Sentences about students whose work was added by hand."""

    @property
    def owners(self) -> list[str]:
        """The names of the students; each is listed once."""
        return list(dict.fromkeys(given_name(claim.owner) for claim in self.recognised.claims))


@dataclass(frozen=True)
class Known:
    """What is known about a class before it is read."""

    is_student: Callable[[str], bool] = lambda _: False
    """A function that returns whether a student with this name is in the roster or was taken in before."""
    roster: bool = False
    """Whether there is a roster, so that somebody who is not in it is no student."""
    own: bool = False
    """Whether the source is the course's own folder of submissions, which holds the work for every lab."""
    around: Collection[str] | None = None
    """The folders and zips that were around the class when it was taken in before; None if it was not taken in."""


@dataclass(frozen=True)
class _Asked:
    source: Path
    lab: str
    format: Format | None
    """The format that a person has named; None if no format was named."""
    known: Known


def read_class(source: Path, lab: str, format_name: str = "", known: Known | None = None) -> Reading:
    """Read the contents of a folder or zip as a class.

    Args:
        source: the folder or zip.
        lab: the lab whose notebooks are wanted.
        format_name: the name of the format, if a person has named it; otherwise empty.
        known: what is known about the class.

    Raises:
        KitError: the source is not a class, or it can be read in two ways.
    """
    named = {**PLATFORMS, PLAIN.name: PLAIN, CLASSROOM50.name: CLASSROOM50}.get(format_name)
    found = listed(source, lab)
    if known is not None and known.own:
        return Reading(PLAIN, by_lab(found.entries, lab))
    reading = _read(found.entries, (), _Asked(source, lab, named, known or Known()))
    reading.recognised.strange += found.bad_names()
    return reading


def _read(entries: Sequence[Entry], around: tuple[str, ...], asked: _Asked) -> Reading:
    reading = None if asked.format is PLAIN else _of_platform(entries, around, asked)
    if reading is not None:
        return reading
    work = _work(entries)
    beside = [entry for entry in entries if entry not in work]
    if len(work) == 1 and work[0].kind is not Kind.NOTEBOOK and len(around) < _MOST_AROUND:
        inner = _inside(work[0], around, asked)
        if inner is not None:
            inner.recognised.strange += PLAIN.read(beside, asked.lab).strange
            return inner
    if asked.format not in (None, PLAIN):
        raise KitError(
            f"No name in {asked.source} has the form that {asked.format.title} uses.",
            "Leave --format out, or name another.",
        )
    return Reading(PLAIN, PLAIN.read(entries, asked.lab), around)


def _work(entries: Sequence[Entry]) -> list[Entry]:
    return [entry for entry in entries if entry.is_work and not is_hidden((entry.name,))]


def _of_platform(entries: Sequence[Entry], around: tuple[str, ...], asked: _Asked) -> Reading | None:
    """Return the class as a platform exported it; None if no name has the form of a platform.

    Raises:
        KitError: some names have the form of a platform and too many others do not, or two platforms are possible.
    """
    work = _work(entries)
    formats = [asked.format] if asked.format is not None else list(PLATFORMS.values())
    options: list[tuple[Format, Recognised, int, int]] = []
    for one in formats:
        told = one.read(entries, asked.lab)
        seen = {id(claim.entry) for claim in told.claims} | {id(entry) for entry in told.aside}
        of_form = sum(id(entry) in seen for entry in work)
        if seen and (of_form or not work) and (one.certain or 2 * of_form >= len(work)):
            options.append((one, told, of_form, len(work) - of_form))
    whole = [option for option in options if not option[3]]
    if asked.format is None and len(whole or options) > 1:
        raise _two_ways(asked, [option[0].title for option in whole or options], [])
    if not options:
        return None
    chosen, told, of_form, rest = (whole or options)[0]
    seen = {id(claim.entry) for claim in told.claims} | {id(entry) for entry in told.aside}
    others = [entry for entry in entries if id(entry) not in seen]
    if rest and asked.format is None and (of_form < 2 or of_form < rest):
        names = [entry.name for entry in work if id(entry) not in seen]
        raise _two_ways(asked, [chosen.title], names)
    added = PLAIN.read(others, asked.lab)
    told.claims += [replace(claim, by_hand=True) for claim in added.claims]
    told.strange += added.strange
    notes = [
        f"The name {claim.entry.name[:100]!r} does not have the form that {chosen.title} uses, so somebody has added"
        f" it. It is taken as the work of {claim.owner['id'][:100]!r}."
        for claim in added.claims
    ]
    return Reading(chosen, told, around, notes)


def _two_ways(asked: _Asked, titles: Sequence[str], others: Sequence[str]) -> KitError:
    ways = " or ".join(f"as a class from {title}" for title in titles)
    names = f" {some([repr(name[:80]) for name in others], ', ')} {_do(others)} not have such a name." if others else ""
    plain = "" if len(titles) > 1 else ", or as a class in which folders and files have the names of students"
    return KitError(
        f"{asked.source} can be read {ways}{plain}.{names} Nothing was graded.",
        f"Say which it is: --format {' or --format '.join(_named(titles))} or --format plain.",
    )


def _named(titles: Sequence[str]) -> list[str]:
    return [one.name for one in PLATFORMS.values() if one.title in titles]


def _do(names: Sequence[str]) -> str:
    return "does" if len(names) == 1 else "do"


def _inside(only: Entry, around: tuple[str, ...], asked: _Asked) -> Reading | None:
    """Return the class in the only folder or zip of the source; None if that folder or zip is a student's work.

    Raises:
        KitError: it may be a class or a student's work.
    """
    student = owner_of(only, asked.lab)
    if student is not None and asked.known.is_student(student):
        return None
    if any(is_notebook(entry.name) and entry.stem.casefold() == asked.lab.casefold() for entry in only.inside):
        return None  # a notebook with the lab's name makes it a student's work, whatever else is in it
    if asked.format is PLAIN:  # then the innermost names that can be names of students count
        work = _work(only.inside)
        alone = not work or (len(work) == 1 and work[0].kind is Kind.NOTEBOOK)
        return None if alone or _is_packed(work, asked.lab) else _read(only.inside, (*around, only.name), asked)
    inner = _read(only.inside, (*around, only.name), asked)
    if inner.format.around.fullmatch(only.stem) or inner.format is asked.format is not PLAIN:
        return inner
    is_class = len(inner.around) > len(around) + 1 or _is_class(inner, only.inside, asked.lab)
    if student is None:  # the name cannot be the name of a student
        return inner if is_class else None
    if not is_class and not _may_be_class(inner, only.inside, asked.lab):
        return None
    owners = inner.owners
    if asked.known.roster and all(map(asked.known.is_student, owners)):
        return inner
    before = asked.known.around
    if is_class and not _is_students(only, asked.lab) and (before is None or "/".join(inner.around) in before):
        return inner
    names = some([repr(name[:80]) for name in owners], ", ")
    are = "is a student" if len(owners) == 1 else "are students"
    raise KitError(
        f"{asked.source} contains only {only.name[:80]!r}. This may be the work of a student with this name, or a class"
        f" of {len(owners)}: {names}. Nothing was graded.",
        f"If {names} {are}, add --format {inner.format.name}. If {student[:80]!r} is a student, put the name into"
        " roster.csv, or put the work beside that of others.",
    )


def _is_students(entry: Entry, lab: str) -> bool:
    """Return whether an entry can be read as the work of one student."""
    try:
        return choose([Claim(entry, {"id": entry.stem}, entry.name)], lab).member is not None
    except NotUnderstoodError:
        return False


def _may_be_class(inner: Reading, inside: Sequence[Entry], lab: str) -> bool:
    """Return whether the names in a folder or zip allow that it is a class and not the work of one student."""
    work = _work(inside)
    if any(is_notebook(entry.name) and is_of_lab(entry.name, lab) for entry in work):
        return False
    return bool(inner.recognised.claims) and not _is_packed(work, lab)


def _is_packed(work: Sequence[Entry], lab: str) -> bool:
    """Return whether entries have the layout that students get: only the labs, or the whole kit.

    A student may have the name of one of these folders, so no other entry may contain a notebook.
    """
    names = {entry.name for entry in work}
    own = {lab, "labs", *(("kit", "lectures") if {"labs", "kit"} <= names else ())}
    others = [entry for entry in work if entry.name not in own]
    return bool(names & {lab, "labs"}) and not any(_holds_notebook(entry) for entry in others)


def _is_class(inner: Reading, inside: Sequence[Entry], lab: str) -> bool:
    """Return whether this is almost certainly a class: it has a platform's names, or the lab's notebook twice."""
    if not _may_be_class(inner, inside, lab):
        return False
    if inner.format is not PLAIN:
        return True
    return sum(_holds_lab(claim.entry, lab) for claim in inner.recognised.claims) > 1


def _holds_notebook(entry: Entry) -> bool:
    try:
        return any(is_notebook(member.name) for member in entry.files)
    except NotUnderstoodError:
        return False


def _holds_lab(entry: Entry, lab: str) -> bool:
    try:
        return entry.kind is not Kind.NOTEBOOK and any(
            is_notebook(member.name) and is_of_lab(member.name, lab) for member in entry.files
        )
    except NotUnderstoodError:
        return False
