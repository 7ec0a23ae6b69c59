"""The formats in which learning platforms export submissions. Each is recognised by names that only it uses.

A format reads the names at the level of the class. For each name of its form, it says to which student the entry
belongs, with the names that the platform uses. It does not rely on names inside a student's folder or zip, except to
recognise GitHub repositories. The forms are taken from the platforms' documentation of their downloads.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import yaml

from autograder.intake.entries import Claim, Entry, Kind, NotUnderstoodError, Recognised
from autograder.intake.members import is_hidden, is_notebook
from autograder.intake.options import FormatName
from autograder.intake.roster import FILE_NAME as ROSTER
from autograder.intake.which_notebook import is_of_lab
from autograder.submission.timestamp import moment

_METADATA = "submission_metadata.yml"
_METADATA_BYTES = 8 * 1024 * 1024
_TEXT_BYTES = 2000


@dataclass(frozen=True)
class Format:
    """A form in which the submissions of a class are exported."""

    name: FormatName
    title: str
    """The platform that exports this format."""
    read: Callable[[Sequence[Entry], str], Recognised]
    """A function that takes the entries of a class and the lab, and says to whom the entries belong."""
    around: re.Pattern[str] = re.compile(r"(?!)")
    """The names of folders that only this platform puts around a class."""
    certain: bool = True
    """Whether only this platform uses such names; if not, most entries of a class must have them."""


# In a name, the platform's part comes first and the student's name for the file comes last. If the form of the
# platform's part occurs a second time, the second occurrence belongs to the student's name for the file.
_CANVAS = re.compile(
    r"(?P<name>.+?)(?P<late>_LATE)?_(?P<user>\d+)_((?P<number>\d+)_(?P<file>.+)|(text|link)\.html)", re.IGNORECASE
)
"""`doejane_LATE_12345_678910_lab2_executors-1.ipynb`: the student, the ids of user and upload, and the file's name."""
_MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*)|\.html)?")
_MOODLE_FOLDER = re.compile(r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_[a-z]+_?")
"""The folder `Jane Doe_12345_assignsubmission_file_`. Moodle can also put this text before each file's name."""
_MOODLE_ID = re.compile(r"_(\d+)_assignsubmission_[a-z]+")
_BLACKBOARD = re.compile(r"(?P<head>.+?_(?P<user>[^_]+_*?))_attempt_(?P<when>\d{4}(?:-\d\d){5})(?:_(?P<file>.+)|\.txt)")
"""`Lab 2_jdoe_attempt_2026-11-20-18-30-00_lab2_executors.ipynb`, and a text with the same beginning."""
_BLACKBOARD_NAME = re.compile(r"Name:.*\((?P<user>[^()]+)\)\s*")
_SUBMISSION = re.compile(r"submission_(?P<number>\d+)")
"""Gradescope's folders. The file `submission_metadata.yml` says to whom they belong."""
_DOWNLOAD = re.compile(r".+_submissions_\d{4}(_\d\d){2}_T(_\d\d){3}")
"""The folder that Classroom 50 downloads into, `class-lab2_submissions_2026_11_20_T_18_30_00`. Its numbers also have
the form of Canvas."""
_SCORES = "scores.csv"
"""The table of scores that Classroom 50 writes beside the repositories."""
_INBOUND = re.compile(r"(?P<student>.+?)\+(?P<lab>[^+]+)\+(?P<when>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d+)?[^+]*)(\+.+)?")
"""nbgrader's exchange: `inbound/jane+lab2_executors+2026-11-20 18:30:00.123456 UTC+Hc2x`. The random text after the
time keeps others from guessing the folder's name. It can be switched off, and says nothing about the student."""
_OF_NBGRADER = {"source", "release", "submitted", "autograded", "feedback", "solutions", "labs", "build", "gradebook"}
"""The folders that a course may have beside nbgrader's folder of submissions."""


def _forms(entries: Sequence[Entry], form: re.Pattern[str]) -> list[tuple[Entry, re.Match[str]]]:
    """Return the entries whose names match a form. The name of a zip counts without its ending."""
    named = ((entry, entry.stem if entry.kind is Kind.ZIP else entry.name) for entry in entries)
    return [(entry, match) for entry, name in named if entry.kind is not Kind.LINK and (match := form.fullmatch(name))]


def canvas(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise Canvas, "Download submissions": one folder with the files of all students."""
    found = Recognised()
    for entry, match in _forms([entry for entry in entries if not _DOWNLOAD.fullmatch(entry.stem)], _CANVAS):
        owner = {"canvas": match["name"], "canvas_id": match["user"]}
        called = match["file"] or entry.name
        number = int(match["number"] or 0)
        turn = (number, called == f"{lab}.ipynb", entry.name)
        found.claims.append(Claim(entry, owner, called, number=number, turn=turn, late=bool(match["late"])))
    return found


def moodle(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise Moodle, "Download all submissions": a folder for each student, or files with such names."""
    found = Recognised()
    folders = _forms([entry for entry in entries if entry.kind is Kind.FOLDER], _MOODLE_FOLDER)
    files = _forms([entry for entry in entries if entry.kind is not Kind.FOLDER], _MOODLE)
    for entry, match in (*folders, *files):
        if entry.kind is not Kind.FOLDER and len(set(_MOODLE_ID.findall(match.string))) > 1:
            found.strange.append(f"{entry.name[:200]!r} can be read as the name of two students' files.")
            found.aside.append(entry)
            continue
        owner = {"name": match["name"], "moodle_id": match["id"]}
        called = match["file"] or "" if entry.kind is not Kind.FOLDER else ""
        found.claims.append(Claim(entry, owner, called, turn=(called == f"{lab}.ipynb", entry.name)))
    return found


def blackboard(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise Blackboard, "Assignment file download": one folder, with a text file for each attempt."""
    found = Recognised()
    matches = _forms(entries, _BLACKBOARD)
    heads = list({match["head"]: None for _, match in matches})
    start = len(_common_start(heads, "_")) if len(heads) > 1 else 0  # the assignment; user names may also contain `_`
    users = {match["head"]: user for entry, match in matches if (user := _blackboard_user(entry, match))}
    for entry, match in matches:
        user = users.get(match["head"]) or (match["head"][start:] if start else match["user"])
        numbers = match["when"].split("-")
        when = f"{'-'.join(numbers[:3])} {':'.join(numbers[3:])}"
        called = match["file"] or ""
        turn = (called == f"{lab}.ipynb", entry.name)
        found.claims.append(Claim(entry, {"id": user}, called, (match["when"],), turn=turn, handed_in=when))
    return found


def _blackboard_user(entry: Entry, match: re.Match[str]) -> str:
    """Return the user name in Blackboard's text file of an attempt, `Name: Jane Doe (jdoe)`; empty if it has none."""
    if match["file"] or entry.kind is not Kind.OTHER:
        return ""
    with contextlib.suppress(Exception):  # a damaged zip raises many kinds of errors
        first = entry.files[0].read(_TEXT_BYTES).decode("utf-8-sig", "replace").splitlines()[:1]
        named = _BLACKBOARD_NAME.fullmatch(first[0]) if first else None
        if named and match["head"].endswith(f"_{named['user']}"):
            return named["user"]
    return ""


def gradescope(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise Gradescope, "Export submissions": numbered folders, and a file that says to whom they belong."""
    found = Recognised()
    metadata = next((entry for entry in entries if entry.name == _METADATA and entry.kind is Kind.OTHER), None)
    if metadata is None:
        return found
    found.aside.append(metadata)
    told = _gradescope_metadata(metadata)
    if told is None:
        found.strange.append(f"{_METADATA} cannot be read, but only this file says to whom the folders belong.")
    for entry, match in _forms(entries, _SUBMISSION):
        owners, when = (told or {}).get(entry.stem, ([], ""))
        if not owners:
            found.strange.append(f"{_METADATA} does not say to whom {entry.name} belongs.")
            found.aside.append(entry)
        attempt = (when, int(match["number"]))
        found.claims += [Claim(entry, owner, "", attempt, handed_in=moment(when.encode()) or "") for owner in owners]
    return found if len(found.aside) > 1 or found.claims else Recognised()


def _gradescope_metadata(entry: Entry) -> dict[str, tuple[list[dict[str, str]], str]] | None:
    """Return who handed in each folder, which may be a group, and when; None if the file cannot be read."""
    try:
        # Ruby writes its keys as symbols, `:name:`. In YAML these are strings that begin with a colon.
        read = yaml.safe_load(entry.files[0].read(_METADATA_BYTES))
    except Exception:  # PyYAML raises many kinds of errors
        return None
    told: dict[str, tuple[list[dict[str, str]], str]] = {}
    for folder, line in (read if isinstance(read, dict) else {}).items():
        who = line.get(":submitters") if isinstance(line, dict) else None
        if isinstance(who, list):
            kinds = {":name": "name", ":email": "email", ":sid": "id"}
            group = [{kind: str(one[key]) for key, kind in kinds.items() if one.get(key)}
                     for one in who if isinstance(one, dict)]  # fmt: skip
            told[str(folder)] = ([owner for owner in group if owner], str(line.get(":created_at", "")))
    return told


def classroom50(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise what Classroom 50 downloads: a repository for each student, with the student's name at its end."""
    found = Recognised()
    folders = [entry for entry in entries if entry.kind in (Kind.FOLDER, Kind.ZIP) and "-" in entry.stem]
    with_lab = [entry for entry in folders if _has_labs(entry, lab)]
    start = _common_start([entry.stem for entry in with_lab], "-")
    if len(with_lab) < 2 or not start:
        return found
    for entry in folders:
        if entry.stem.startswith(start):
            owner = {"github": entry.stem[len(start) :], "repository": entry.stem}
            found.claims.append(Claim(entry, owner))
    found.aside += [entry for entry in entries if entry.name == _SCORES]
    return found


def repositories(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise Classroom 50 if a person named this format.

    In this case even a single repository is accepted. Its whole name counts as the student's name.
    """
    found = classroom50(entries, lab)
    single = [entry for entry in entries if entry.kind in (Kind.FOLDER, Kind.ZIP) and _has_labs(entry, lab)]
    if not found.claims and len(single) == 1:
        found.claims.append(Claim(single[0], {"github": single[0].stem, "repository": single[0].stem}))
    return found


def _has_labs(entry: Entry, lab: str) -> bool:
    """Return whether an entry has the layout of the repository that students get."""
    with contextlib.suppress(NotUnderstoodError):
        paths = [entry.below(member) for member in entry.files]
        return any(len(path) == 3 and path[:2] == ("labs", lab) and is_notebook(path[2]) for path in paths)
    return False


def exchange(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise the folder `inbound` of nbgrader's exchange, as it is before `nbgrader collect`.

    Every user of the machine can make a folder there, with any name. If students have accounts, a folder that belongs
    to another account than the student's is left out, unless the person who grades has copied it.
    """
    found = Recognised()
    forms = _forms([entry for entry in entries if entry.kind is Kind.FOLDER], _INBOUND)
    accounts = any(entry.account == match["student"] for entry, match in forms)
    for entry, match in forms:
        if match["lab"] != lab:
            found.aside.append(entry)
        elif accounts and entry.account not in ("", match["student"]):
            found.strange.append(f"{entry.name[:200]!r} belongs to the account {entry.account!r}.")
            found.aside.append(entry)
        else:
            found.claims.append(Claim(entry, {"id": match["student"]}, "", (match["when"],), handed_in=match["when"]))
    return found if found.claims else Recognised()


def submitted(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise nbgrader's `submitted` folder in a course: `submitted/STUDENT/LAB/LAB.ipynb`."""
    found = Recognised()
    folder = next((entry for entry in entries if entry.kind is Kind.FOLDER and entry.name == "submitted"), None)
    if folder is None:
        return found
    found = by_lab(folder.inside, lab)
    if not any(claim.only for claim in found.claims):
        return Recognised()
    found.aside += [folder, *(entry for entry in entries if entry.name in _OF_NBGRADER and entry is not folder)]
    return found


def by_lab(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise folders of students that contain a folder for the lab, as in nbgrader's `submitted` and the kit's own.

    Folders that contain only folders for other labs are not used. All other entries are read as in a class without a
    platform.
    """
    found = Recognised()
    others = []
    for entry in entries:
        paths = None
        if entry.kind is Kind.FOLDER:
            with contextlib.suppress(NotUnderstoodError):  # this is reported later, when the entry is read
                paths = [entry.below(member) for member in entry.files]
        if paths is not None and any(path[0] == lab and len(path) > 1 for path in paths):
            found.claims.append(Claim(entry, {"id": entry.name}, only=lab))
        elif paths is not None and all(len(path) > 1 for path in paths):
            found.aside.append(entry)
        else:
            others.append(entry)
    added = plain(others, lab)
    found.claims += [replace(claim, by_hand=True) for claim in added.claims]
    found.strange += added.strange
    return found


def plain(entries: Sequence[Entry], lab: str) -> Recognised:
    """Recognise a class without a platform: a folder, zip or notebook for each student, named after the student."""
    found = Recognised()
    for entry in entries:
        student = owner_of(entry, lab)
        if entry.kind is Kind.LINK:
            found.strange.append(f"{entry.shown} is a link; links are not followed.")
        elif is_hidden((entry.name,)):
            if entry.is_work and entry.name != ".ipynb_checkpoints":
                found.strange.append(f"{entry.name[:80]!r} is hidden: its name begins with a dot.")
        elif student is not None:
            found.claims.append(Claim(entry, {"id": student}, entry.name))
        elif entry.is_work:
            because = "because it has the name of the lab"
            found.strange.append(f"It is not clear to whom {entry.name[:80]!r} belongs, {because}.")
        elif entry.name != ROSTER:
            found.strange.append(f"{entry.name[:80]!r} is not a student's folder, notebook or zip.")
    return found


def owner_of(entry: Entry, lab: str) -> str | None:
    """Return the student after whom an entry is named in a class without a platform; None if it names no student."""
    if entry.kind is Kind.FOLDER:
        return entry.name
    if entry.kind not in (Kind.ZIP, Kind.NOTEBOOK) or is_of_lab(entry.stem, lab):
        return None
    return entry.stem.removeprefix(f"{lab}_")


def _common_start(names: Sequence[str], end: str) -> str:
    """Return the beginning that all names share, up to and including the last `end` in it; empty if there is none."""
    start = names[0] if names else ""
    for name in names:
        while not name.startswith(start):
            start = start[:-1]
    return start[: start.rfind(end) + 1]


PLAIN = Format(FormatName.PLAIN, "", plain)
PLATFORMS: Mapping[str, Format] = {
    one.name: one
    for one in (
        Format(FormatName.GRADESCOPE, "Gradescope", gradescope, re.compile(r"assignment_\d+_export")),
        Format(FormatName.EXCHANGE, "nbgrader's exchange", exchange, re.compile(r"inbound")),
        Format(FormatName.SUBMITTED, "nbgrader's folder submitted", submitted),
        Format(FormatName.MOODLE, "Moodle", moodle),
        Format(FormatName.BLACKBOARD, "Blackboard", blackboard),
        Format(FormatName.CANVAS, "Canvas", canvas),
        Format(FormatName.CLASSROOM50, "Classroom 50", classroom50, _DOWNLOAD, certain=False),
    )
}
"""The formats of platforms, by the names of the formats."""
CLASSROOM50 = replace(PLATFORMS["classroom50"], read=repositories)
"""The format of Classroom 50 for the case that a person named it."""
