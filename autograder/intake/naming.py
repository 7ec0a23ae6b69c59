"""What the students of a class are called here: by the roster, by what they were called before, or by the platform."""

from __future__ import annotations

import hashlib
import os
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from autograder.intake.claims import Claim
from autograder.intake.record import person
from autograder.intake.roster import Roster

_NOT_FIRST = " .@+-,()"
"""To a shell, a spreadsheet or a listing these mean something at the beginning of a name."""
_NOT_LAST = " ."
_NAME_BYTES = 120
"""A longer name is shortened: a gradebook takes 128 characters, a file's name 255 bytes with what is put around it."""


@dataclass
class Student:
    """One student, and what is claimed to be theirs."""

    name: str
    claims: list[Claim] = field(default_factory=list)
    listed: bool = True
    """The roster has them, or there is none."""


def named(claims: Sequence[Claim], roster: Roster | None, before: Mapping[tuple[str, str], str]) -> list[Student]:
    """Return the students of a class, each owner by one name; several may have come to the same name.

    Who was taken in before keeps their name, whoever hands in besides. Where nothing says which of two entries of one
    owner is the later one, each counts as a student of that name.

    Args:
        claims: whose each entry is.
        roster: of the course, if it has one.
        before: what the persons of the platforms were called before.
    """
    by_owner: dict[tuple[object, ...], list[Claim]] = {}
    for claim in claims:
        in_turn = claim.attempt or claim.turn
        by_owner.setdefault((*sorted(claim.owner.items()), None if in_turn else id(claim)), []).append(claim)
    owners = [group[0].owner for group in by_owner.values()]
    names = _by_roster(owners, roster) if roster is not None else _by_platform(owners, before)
    return [
        Student(name or given_name(owner), group, listed=roster is None or bool(name))
        for owner, name, group in zip(owners, names, by_owner.values(), strict=True)
    ]


def _by_roster(owners: Sequence[Mapping[str, str]], roster: Roster) -> list[str]:
    """The roster's names; empty for whom it does not have."""
    found = []
    for owner in owners:
        plain = set(owner) == {"id"}  # a folder's name may be any of them
        ways = dict.fromkeys(("id", "email", "name", "github"), owner["id"]) if plain else owner
        found.append(roster.student(ways) or "")
    return found


def _by_platform(owners: Sequence[Mapping[str, str]], before: Mapping[tuple[str, str], str]) -> list[str]:
    """The platform's names; with its number for a person where two have one name."""
    persons = [person(owner) for owner in owners]
    given = [given_name(owner) for owner in owners]
    many = Counter(name for name, who in zip(given, persons, strict=True) if who is not None)
    taken = {name: who for who, name in before.items()}
    names = []
    for name, who in zip(given, persons, strict=True):
        known = before.get(who) if who is not None else None
        others = who is not None and (many[name] > 1 or taken.get(name, who) != who)
        names.append(known or (f"{name}_{who[1]}" if who is not None and others else name))
    return names


def given_name(owner: Mapping[str, str]) -> str:
    """Return the name that a platform gives a student."""
    return next((owner[kind] for kind in ("id", "github", "name", "canvas", "email") if owner.get(kind)), "")


def file_name(given: str) -> str:
    """The name by which a student is known here, which files and pages can have; empty if nothing was given.

    Accents are joined to their letters: a Mac writes `José` with two characters where other systems write one. A name
    that is long, or has characters that would mean something to a program, is made different from all others by a
    digest of the whole.
    """
    name = unicodedata.normalize("NFC", given)
    plain = "".join(character if _in_names(character) else "_" for character in name)
    if plain[:1] in _NOT_FIRST:
        plain = f"_{plain[1:]}"
    if plain[-1:] in _NOT_LAST:
        plain = f"{plain[:-1]}_"
    if not name or (plain == name and len(os.fsencode(name)) <= _NAME_BYTES):
        return name
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{plain.encode()[: _NAME_BYTES - 9].decode('utf-8', 'ignore').rstrip(_NOT_LAST)}-{digest}"


def _in_names(character: str) -> bool:
    """Letters and digits of any script with their marks, and what stands between the parts of names."""
    return unicodedata.category(character)[0] in "LMN" or character in "_ .@+-,'\u2018\u2019()"
