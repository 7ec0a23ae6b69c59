"""The formats of nbgrader: its exchange, and its folder of submissions."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence

from autograder.intake.claims import Claim, Recognised, nothing_from
from autograder.intake.members import Member, is_notebook
from autograder.submission import exchange_secret, timestamp
from autograder.submission.timestamp import moment

_INBOUND = re.compile(r"(?P<student>.+?)\+(?P<lab>[^+]+)\+(?P<when>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d+)?[^+]*)(\+.+)?")
"""nbgrader's exchange: `inbound/jane+lab2_executors+2026-11-20 18:30:00.123456 UTC+Hc2x`. What stands behind the time
keeps others from guessing the folder's name, and may be switched off; it says nothing about the student."""


def exchange(files: Sequence[Member], lab: str) -> Recognised:
    """nbgrader's exchange, before `collect`: the folder `inbound`."""
    found = Recognised("nbgrader's exchange")
    beside = _beside(files)
    everybody: dict[str, str] = {}
    for member in files:
        match = next(filter(None, map(_INBOUND.fullmatch, member.path[:-1])), None)
        if not match or match["lab"] != lab:
            continue
        student, when = match["student"], match["when"]
        everybody[student] = student
        if is_notebook(member.name):
            secret, turn = _secret(beside, member), (member.name == f"{lab}.ipynb",)
            found.claims.append(Claim(member, {"id": student}, member.name, (when,), turn, when, secret=secret))
    found.strange += nothing_from(everybody, {claim.owner["id"] for claim in found.claims})
    return found


def submitted(files: Sequence[Member], lab: str) -> Recognised:
    """nbgrader's `submitted` folder, or a whole course with one: `submitted/STUDENT/LAB/LAB.ipynb`."""
    found = Recognised("nbgrader's folder submitted")
    beside = _beside(files)
    everybody: dict[str, str] = {}
    for member in files:
        if member.path[-4:-3] != ("submitted",) or member.path[-2] != lab:
            continue
        student = member.path[-3]
        everybody[student] = student
        if is_notebook(member.name):
            stamp = beside.get((*member.path[:-1], timestamp.FILE_NAME))
            when = moment(_start(stamp, timestamp.MOST_BYTES)) if stamp is not None else ""
            turn = (member.name == f"{lab}.ipynb",)
            secret = _secret(beside, member)
            found.claims.append(
                Claim(member, {"id": student}, member.name, turn=turn, handed_in=when or "", secret=secret)
            )
    found.strange += nothing_from(everybody, {claim.owner["id"] for claim in found.claims})
    return found


def _beside(files: Sequence[Member]) -> dict[tuple[str, ...], Member]:
    """What nbgrader's exchange put beside notebooks, by path."""
    names = (timestamp.FILE_NAME, exchange_secret.FILE_NAME)
    return {member.path: member for member in files if member.name in names}


def _secret(beside: Mapping[tuple[str, ...], Member], notebook: Member) -> str:
    member = beside.get((*notebook.path[:-1], exchange_secret.FILE_NAME))
    return exchange_secret.secret(_start(member, exchange_secret.MOST_BYTES)) if member is not None else ""


def _start(member: Member, most: int) -> bytes:
    """How a file begins; nothing if it cannot be read, which in a damaged zip has many kinds."""
    with contextlib.suppress(Exception):
        return member.read(most)
    return b""
