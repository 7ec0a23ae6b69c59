"""The formats in which learning platforms hand out submissions, each told by the names that only it gives.

A format reads the path of each file. Where it finds a notebook it says whose it is, in the words of the platform, and
which of several submissions of one student is the last. Sources: the platforms' own documentation of their downloads.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml

from autograder.intake.members import Member
from autograder.submission import exchange_secret, timestamp
from autograder.submission.timestamp import moment

_METADATA_BYTES = 8 * 1024 * 1024


@dataclass(frozen=True)
class Claim:
    """A notebook that somebody handed in."""

    member: Member
    owner: Mapping[str, str]
    """What the platform calls the student, by kind: `name`, `email`, `id`, `canvas_id`, `moodle_id`, `github`."""
    turn: tuple[Any, ...] = ()
    """Of two of one student, the greater one is the later."""
    handed_in: str = ""
    """Date and time, as nbgrader reads them; empty if nothing says so."""
    late: bool = False
    """The platform has marked it as late."""
    secret: str = ""
    """By what nbgrader's exchange knows the feedback on it; empty if it did not come from there."""


@dataclass
class Recognised:
    """What a format makes of the files."""

    format: str
    claims: list[Claim] = field(default_factory=list)
    strange: list[str] = field(default_factory=list)
    """Sentences about what was recognised and holds no notebook."""


_CANVAS = re.compile(r"(?P<name>[^_]+)(?P<late>_LATE)?_(?P<user>\d+)_(?P<number>\d+)_(?P<file>.+)", re.IGNORECASE)
"""`doejane_LATE_12345_678910_lab2_executors-1.ipynb`: who, the user, the upload, and the file as it was called."""
_MOODLE = re.compile(r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_(?P<kind>\w+?)_?")
"""The folder `Jane Doe_12345_assignsubmission_file_`."""
_BLACKBOARD = re.compile(r".+?_(?P<user>[^_]+)_attempt_(?P<when>\d{4}(?:-\d\d){5})(?:_(?P<file>.+)|\.txt)")
"""`Lab 2_jdoe_attempt_2026-11-20-18-30-00_lab2_executors.ipynb`, and a text with the same beginning."""
_INBOUND = re.compile(r"(?P<student>.+?)\+(?P<lab>[^+]+)\+(?P<when>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d+)?[^+]*)(\+.+)?")
"""nbgrader's exchange: `inbound/jane+lab2_executors+2026-11-20 18:30:00.123456 UTC+Hc2x`. What stands behind the time
keeps others from guessing the folder's name, and may be switched off; it says nothing about the student."""
_SUBMISSION = re.compile(r"submission_(?P<number>\d+)")
"""Gradescope's folders; whose they are stands in `submission_metadata.yml`."""


def _is_notebook(member: Member) -> bool:
    return member.name.lower().endswith(".ipynb")


def _given_out(member: Member, form: re.Pattern[str]) -> re.Match[str] | None:
    """What a platform calls a file, or else the zip that it lies in; None if neither name is of the form."""
    return form.fullmatch(member.name) or form.fullmatch(member.zip)


def canvas(files: Sequence[Member], lab: str) -> Recognised:
    """Canvas, "Download submissions": one flat folder."""
    found = Recognised("Canvas")
    with_notebook: set[str] = set()
    others: dict[str, str] = {}
    for member in files:
        match = _given_out(member, _CANVAS)
        if match and _is_notebook(member):
            with_notebook.add(match.string)
            owner = {"canvas": match["name"], "canvas_id": match["user"]}
            turn = (int(match["number"]), member.name == f"{lab}.ipynb", member.path)
            found.claims.append(Claim(member, owner, turn, late=bool(match["late"])))
        elif match:
            others.setdefault(match.string, match["name"])
    found.strange += _no_notebooks(others, with_notebook)
    return found


def _no_notebooks(others: Mapping[str, str], with_notebook: set[str]) -> list[str]:
    """Sentences about what was uploaded, each with its student, and is no notebook, nor a zip that holds one."""
    return [f"{given[:100]!r} of {who} is no notebook." for given, who in others.items() if given not in with_notebook]


def moodle(files: Sequence[Member], lab: str) -> Recognised:
    """Moodle, "Download all submissions": a folder for each student and kind of submission."""
    found = Recognised("Moodle")
    with_notebook: set[str] = set()
    others: dict[str, str] = {}
    for member in files:
        for part in member.path[:-1]:
            match = _MOODLE.fullmatch(part)
            if match and _is_notebook(member):
                with_notebook.add(match["id"])
                exact = member.name == f"{lab}.ipynb"
                found.claims.append(
                    Claim(member, {"name": match["name"], "moodle_id": match["id"]}, (exact, member.path))
                )
            elif match:
                others.setdefault(match["id"], match["name"])
    found.strange += [f"{name} handed in no notebook." for key, name in others.items() if key not in with_notebook]
    return found


def blackboard(files: Sequence[Member], lab: str) -> Recognised:
    """Blackboard, "Assignment file download": one flat folder, with a text for each attempt."""
    found = Recognised("Blackboard")
    with_notebook: set[str] = set()
    others: dict[str, str] = {}
    for member in files:
        match = _given_out(member, _BLACKBOARD)
        if match and _is_notebook(member):
            with_notebook.add(match.string)
            numbers = match["when"].split("-")
            when = f"{'-'.join(numbers[:3])} {':'.join(numbers[3:])}"
            turn = (match["when"], member.name == f"{lab}.ipynb", member.path)
            found.claims.append(Claim(member, {"id": match["user"]}, turn, when))
        elif match and match["file"]:
            others.setdefault(match.string, match["user"])
    found.strange += _no_notebooks(others, with_notebook)
    return found


def gradescope(files: Sequence[Member], lab: str) -> Recognised:
    """Gradescope, "Export submissions": folders with numbers, and a file that says whose they are."""
    found = Recognised("Gradescope")
    metadata = next((member for member in files if member.name == "submission_metadata.yml"), None)
    if metadata is None:
        return found
    told = _gradescope_metadata(metadata)
    for member in files:
        folder = next((part for part in member.path[:-1] if _SUBMISSION.fullmatch(part)), "")
        if folder and _is_notebook(member):
            owner, when = told.get(folder, ({}, ""))
            number = int(folder.removeprefix("submission_"))
            found.claims.append(Claim(member, owner or {"id": folder}, (when, number), moment(when.encode()) or ""))
    return found


def _gradescope_metadata(member: Member) -> dict[str, tuple[dict[str, str], str]]:
    """Of each folder, the first submitter and when it was handed in."""
    try:
        # Ruby writes its keys as symbols, `:name:`, which YAML takes for texts that begin with a colon.
        read = yaml.safe_load(member.read(_METADATA_BYTES))
    except Exception:  # what PyYAML does not understand raises many kinds
        return {}
    told: dict[str, tuple[dict[str, str], str]] = {}
    for folder, entry in (read if isinstance(read, dict) else {}).items():
        who = entry.get(":submitters") if isinstance(entry, dict) else None
        if isinstance(who, list) and who and isinstance(who[0], dict):
            kinds = {":name": "name", ":email": "email", ":sid": "id"}
            owner = {kind: str(who[0][key]) for key, kind in kinds.items() if who[0].get(key)}
            told[str(folder)] = (owner, str(entry.get(":created_at", "")))
    return told


def exchange(files: Sequence[Member], lab: str) -> Recognised:
    """nbgrader's exchange, before `collect`: the folder `inbound`."""
    found = Recognised("nbgrader's exchange")
    secrets = _secrets(files)
    for member in files:
        for part in member.path[:-1]:
            match = _INBOUND.fullmatch(part)
            if match and match["lab"] == lab and member.name == f"{lab}.ipynb":
                owner, when, secret = {"id": match["student"]}, match["when"], secrets.get(member.path[:-1], "")
                found.claims.append(Claim(member, owner, (when,), when, secret=secret))
    return found


def submitted(files: Sequence[Member], lab: str) -> Recognised:
    """nbgrader's `submitted` folder, or a whole course with one: `submitted/STUDENT/LAB/LAB.ipynb`."""
    found = Recognised("nbgrader's folder submitted")
    stamps = {member.path[:-1]: member for member in files if member.name == timestamp.FILE_NAME}
    secrets = _secrets(files)
    for member in files:
        if member.path[-4:-3] == ("submitted",) and member.path[-2:] == (lab, f"{lab}.ipynb"):
            stamp = stamps.get(member.path[:-1])
            when = moment(_start(stamp, timestamp.MOST_BYTES)) if stamp is not None else ""
            secret = secrets.get(member.path[:-1], "")
            found.claims.append(Claim(member, {"id": member.path[-3]}, (), when or "", secret=secret))
    return found


def _secrets(files: Sequence[Member]) -> dict[tuple[str, ...], str]:
    """What nbgrader's exchange put beside notebooks, by folder."""
    named = [member for member in files if member.name == exchange_secret.FILE_NAME]
    return {member.path[:-1]: exchange_secret.secret(_start(member, exchange_secret.MOST_BYTES)) for member in named}


def _start(member: Member, most: int) -> bytes:
    """How a file begins; nothing if it cannot be read, which in a damaged zip has many kinds."""
    with contextlib.suppress(Exception):
        return member.read(most)
    return b""


def classroom(files: Sequence[Member], lab: str) -> Recognised:
    """GitHub Classroom: a repository for each student, whose name is that of the assignment and the student's."""
    found = Recognised("GitHub Classroom")
    where = [(member, member.path.index("labs")) for member in files
             if "labs" in member.path[1:-1] and member.path[-2:] == (lab, f"{lab}.ipynb")]  # fmt: skip
    repositories = {member.path[at - 1]: member for member, at in where}
    start = _common_start(list(repositories))
    if len(repositories) > 1 and start:
        found.claims = [Claim(member, {"github": name[len(start) :]}) for name, member in repositories.items()]
    return found


def flat(files: Sequence[Member], lab: str) -> Recognised:
    """A folder of notebooks, or of zips with one notebook each, named after the students."""
    found = Recognised("a folder of files")
    notebooks = [member for member in files if _is_notebook(member)]
    if notebooks and all(len(member.path) == 1 and member.name != f"{lab}.ipynb" for member in notebooks):
        for member in notebooks:
            found.claims.append(Claim(member, {"id": member.name[: -len(".ipynb")].removeprefix(f"{lab}_")}))
    return found


def _common_start(names: Sequence[str]) -> str:
    """What all names begin with, up to a hyphen; empty if that is nothing, or all of one."""
    start = names[0] if names else ""
    for name in names:
        while not name.startswith(start):
            start = start[:-1]
    return start[: start.rfind("-") + 1]


FORMATS: tuple[Callable[[Sequence[Member], str], Recognised], ...] = (
    gradescope, exchange, submitted, moodle, blackboard, canvas, classroom, flat,
)  # fmt: skip
"""In the order in which they are tried: those whose names nobody else would give come first."""


def recognise(files: Sequence[Member], lab: str) -> Recognised | None:
    """Return what the first fitting format makes of the files; None if none fits: then it is a plain class."""
    for read in FORMATS:
        found = read(files, lab)
        if found.claims:
            return found
    return None
