"""The formats in which learning platforms hand out submissions, each told by the names that only it gives.

A format reads the path of each file. Where it finds a notebook it says whose it is, in the words of the platform, and
which of several submissions of one student is the last. Sources: the platforms' own documentation of their downloads.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import yaml

from autograder.intake import nbgrader_folders
from autograder.intake.claims import Claim, Recognised, nothing_from
from autograder.intake.members import Member, is_notebook
from autograder.intake.roster import FILE_NAME as ROSTER
from autograder.submission.timestamp import moment

_METADATA_BYTES = 8 * 1024 * 1024


_CANVAS = re.compile(r"(?P<name>[^_]+)(?P<late>_LATE)?_(?P<user>\d+)_(?P<number>\d+)_(?P<file>.+)", re.IGNORECASE)
"""`doejane_LATE_12345_678910_lab2_executors-1.ipynb`: who, the user, the upload, and the file as it was called."""
_MOODLE = re.compile(r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*))?")
"""The folder `Jane Doe_12345_assignsubmission_file_`, or the beginning of a file's name: Moodle offers both."""
_BLACKBOARD = re.compile(r"(?P<head>.+?_(?P<user>[^_]+))_attempt_(?P<when>\d{4}(?:-\d\d){5})(?:_(?P<file>.+)|\.txt)")
"""`Lab 2_jdoe_attempt_2026-11-20-18-30-00_lab2_executors.ipynb`, and a text with the same beginning."""
_SUBMISSION = re.compile(r"submission_(?P<number>\d+)")
"""Gradescope's folders; whose they are stands in `submission_metadata.yml`."""


def _given_out(member: Member, form: re.Pattern[str]) -> re.Match[str] | None:
    """What a platform calls a file, or else a zip that it lies in; None if no name is of the form."""
    return next(filter(None, map(form.fullmatch, (member.name, *member.zips))), None)


def _called(member: Member, match: re.Match[str]) -> str:
    return match["file"] or member.name if match.string == member.name else member.name


def canvas(files: Sequence[Member], lab: str) -> Recognised:
    """Canvas, "Download submissions": one flat folder."""
    found = Recognised("Canvas")
    with_notebook: set[str] = set()
    others: dict[str, str] = {}
    for member in files:
        match = _given_out(member, _CANVAS)
        if match and is_notebook(member.name):
            with_notebook.add(match.string)
            owner = {"canvas": match["name"], "canvas_id": match["user"]}
            turn = (int(match["number"]), member.name == f"{lab}.ipynb", member.path)
            found.claims.append(Claim(member, owner, _called(member, match), turn=turn, late=bool(match["late"])))
        elif match:
            others.setdefault(match.string, match["name"])
    found.strange += _no_notebooks(others, with_notebook)
    return found


def _no_notebooks(others: Mapping[str, str], with_notebook: set[str]) -> list[str]:
    """Sentences about what was uploaded, each with its student, and is no notebook, nor a zip that holds one."""
    return [f"{given[:100]!r} of {who} is no notebook." for given, who in others.items() if given not in with_notebook]


def moodle(files: Sequence[Member], lab: str) -> Recognised:
    """Moodle, "Download all submissions": a folder for each student and kind of submission, or files with its name."""
    found = Recognised("Moodle")
    everybody: dict[str, str] = {}
    for member in files:
        match = next(filter(None, map(_MOODLE.fullmatch, member.path)), None)
        if match:
            everybody.setdefault(match["id"], match["name"])
        if match and is_notebook(member.name):
            owner = {"name": match["name"], "moodle_id": match["id"]}
            called = _called(member, match)
            found.claims.append(Claim(member, owner, called, turn=(called == f"{lab}.ipynb", member.path)))
    found.strange += nothing_from(everybody, {claim.owner["moodle_id"] for claim in found.claims})
    return found


def blackboard(files: Sequence[Member], lab: str) -> Recognised:
    """Blackboard, "Assignment file download": one flat folder, with a text for each attempt."""
    found = Recognised("Blackboard")
    matches = [(member, match) for member in files if (match := _given_out(member, _BLACKBOARD))]
    heads = list({match["head"]: None for _, match in matches})
    start = len(_common_start(heads, "_")) if len(heads) > 1 else 0  # the assignment; a user's name may have a `_`, too
    with_notebook: set[str] = set()
    everybody: dict[str, str] = {}
    others: dict[str, str] = {}
    for member, match in matches:
        user = match["head"][start:] if start else match["user"]
        everybody[user] = user
        if is_notebook(member.name):
            with_notebook |= {match.string, user}
            numbers = match["when"].split("-")
            when = f"{'-'.join(numbers[:3])} {':'.join(numbers[3:])}"
            turn = (member.name == f"{lab}.ipynb", member.path)
            found.claims.append(Claim(member, {"id": user}, _called(member, match), (match["when"],), turn, when))
        elif match["file"]:
            others.setdefault(match.string, user)
    found.strange += _no_notebooks(others, with_notebook)
    found.strange += nothing_from(everybody, with_notebook | set(others.values()))
    return found


def gradescope(files: Sequence[Member], lab: str) -> Recognised:
    """Gradescope, "Export submissions": folders with numbers, and a file that says whose they are."""
    found = Recognised("Gradescope")
    metadata = next((member for member in files if member.name == "submission_metadata.yml"), None)
    if metadata is None:
        return found
    told = _gradescope_metadata(metadata)
    with_notebook: set[str] = set()
    for member in files:
        folder = next((part for part in member.path[:-1] if _SUBMISSION.fullmatch(part)), "")
        if folder in told and is_notebook(member.name):
            with_notebook.add(folder)
            owners, when = told[folder]
            attempt = (when, int(folder.removeprefix("submission_")))
            turn, handed_in = (member.name == f"{lab}.ipynb", member.path), moment(when.encode()) or ""
            found.claims += [Claim(member, owner, member.name, attempt, turn, handed_in) for owner in owners]
        elif folder:
            told.setdefault(folder, ([], ""))
    names = {folder: ", ".join(next(iter(owner.values())) for owner in told[folder][0]) or folder for folder in told}
    found.strange += [
        f"{name} handed in no notebook." if told[folder][0] else f"{folder} is of nobody in {metadata.name}."
        for folder, name in names.items() if folder not in with_notebook
    ]  # fmt: skip
    return found


def _gradescope_metadata(member: Member) -> dict[str, tuple[list[dict[str, str]], str]]:
    """Of each folder, who handed it in, which may be a group, and when."""
    try:
        # Ruby writes its keys as symbols, `:name:`, which YAML takes for texts that begin with a colon.
        read = yaml.safe_load(member.read(_METADATA_BYTES))
    except Exception:  # what PyYAML does not understand raises many kinds
        return {}
    told: dict[str, tuple[list[dict[str, str]], str]] = {}
    for folder, entry in (read if isinstance(read, dict) else {}).items():
        who = entry.get(":submitters") if isinstance(entry, dict) else None
        if isinstance(who, list):
            kinds = {":name": "name", ":email": "email", ":sid": "id"}
            group = [{kind: str(one[key]) for key, kind in kinds.items() if one.get(key)}
                     for one in who if isinstance(one, dict)]  # fmt: skip
            told[str(folder)] = ([owner for owner in group if owner], str(entry.get(":created_at", "")))
    return told


def classroom(files: Sequence[Member], lab: str) -> Recognised:
    """GitHub Classroom: a repository for each student, whose name is that of the assignment and the student's."""
    found = Recognised("GitHub Classroom")
    where = [(member, member.path.index("labs")) for member in files
             if "labs" in member.path[1:-1] and is_notebook(member.name)]  # fmt: skip
    where = [(member, at) for member, at in where if member.path[at + 1 : -1] == (lab,)]
    repositories = {member.path[:at]: member.path[at - 1] for member, at in where}
    names = list(repositories.values())
    start = _common_start(names, "-")
    if len(set(names)) == len(names) > 1 and start:
        for member, at in where:
            turn = (member.name == f"{lab}.ipynb",)
            found.claims.append(Claim(member, _github(member.path[at - 1], start), member.name, turn=turn))
        folders = {path[:-1] for path in repositories}
        others = {member.path[:at]: member.path[at - 1] for member in files
                  for at in range(1, len(member.path)) if member.path[: at - 1] in folders}  # fmt: skip
        found.strange = [f"{name} holds no notebook of {lab}." for path, name in others.items()
                         if path not in repositories and name.startswith(start)]  # fmt: skip
    return found


def _github(repository: str, start: str) -> dict[str, str]:
    return {"github": repository[len(start) :], "repository": repository}


def flat(files: Sequence[Member], lab: str) -> Recognised:
    """A folder of notebooks named after the students."""
    found = Recognised("a folder of files")
    notebooks = [member for member in files if is_notebook(member.name)]
    if all(len(member.path) == 1 for member in notebooks) and any(m.name != f"{lab}.ipynb" for m in notebooks):
        for member in files:
            if is_notebook(member.name) and member.name != f"{lab}.ipynb":
                found.claims.append(Claim(member, {"id": member.name[: -len(".ipynb")].removeprefix(f"{lab}_")}))
            elif member.name != ROSTER:
                found.strange.append(f"{'/'.join(member.path)[:100]!r} is no student's notebook.")
    return found


def _common_start(names: Sequence[str], end: str) -> str:
    """What all names begin with, up to a character at which it may end; empty if that is nothing, or all of one."""
    start = names[0] if names else ""
    for name in names:
        while not name.startswith(start):
            start = start[:-1]
    return start[: start.rfind(end) + 1]


FORMATS: tuple[Callable[[Sequence[Member], str], Recognised], ...] = (
    gradescope, nbgrader_folders.exchange, nbgrader_folders.submitted, moodle, blackboard, canvas, classroom,
)  # fmt: skip
"""Those whose names nobody else would give come first; it counts where two find the same number of students."""


def recognise(files: Sequence[Member], lab: str) -> Recognised | None:
    """Return what a format makes of the files; None if none fits: then it is a plain class.

    Of several that fit, the one that finds most students counts: what a student packed may look like a format, too.
    """
    found = [read(files, lab) for read in FORMATS]
    best = max(found, key=lambda one: len({tuple(claim.owner.items()) for claim in one.claims}))
    best = best if best.claims else flat(files, lab)
    return best if best.claims else None
