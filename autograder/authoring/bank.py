"""A bank of past terms: anonymous answers with their final points, which today's kit and lab must still give.

Only programs and files are kept, without the names of students and without answers in words. A difference is either a
mistake in today's check, or a mistake of the past that somebody explains. A lab is not released before that.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.grades import read_grades
from autograder.grading.executors.local import Local
from autograder.grading.runner import Settings, job_of
from autograder.grading.store import ResultStore
from autograder.submission.answers import Submission, take_files
from autograder.submission.reader import read_submission


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Explained(_Model):
    """Why a check gives other points today."""

    points: float | None
    """The points that it gives today."""
    because: str


class Banked(_Model):
    """One student's answers."""

    sources: dict[str, str]
    """The source of each answer that is a file, by grade_id."""
    own: dict[str, str]
    """The files of cells that the student added."""
    points: dict[str, float | None]
    """The final points of each check, with what people decided, by grade_id."""
    explained: dict[str, Explained] = {}
    """Differences that somebody has explained, by grade_id."""


@dataclass(frozen=True)
class Compared:
    """What today's checks make of the entries of a lab."""

    entries: int
    differences: list[Difference]
    """Those that nobody has explained."""
    never_decided: dict[str, int]
    """Of checks that had no points in some entries when these were added: the number of those, by grade_id."""
    untried: list[str]
    """The checks that no entry has final points for, so that the bank says nothing about them."""


@dataclass(frozen=True)
class Difference:
    """A check that gives other points than in the past."""

    entry: str
    check: str
    before: float | None
    now: float | None
    because: str
    """The first reason that the check gives today; empty if it passes."""


def add(root: Path, lab_name: str) -> tuple[int, int]:
    """Add the graded class of a lab to the bank.

    Returns:
        The numbers of new entries, and of students whose answers the bank had already.

    Raises:
        KitError: the lab has no grades.
    """
    lab, paths = load_lab(root, lab_name), CoursePaths(root)
    grades = {grade.student: grade for grade in read_grades(root, lab_name)}
    students = [result.student for result in ResultStore(root).all(lab_name) if result.student in grades]
    if not students:
        raise KitError(f"There are no grades of {lab_name}.", f"Grade a class first: autograder grade {lab_name}")
    new = 0
    checks = {cell.grade_id for cell in lab.checks}
    for student in students:
        submission = read_submission(paths.submitted_notebook(student, lab_name), lab)
        if not submission.readable:
            continue
        sources = {name: text for name, text in submission.sources.items() if lab.answers[name].file is not None}
        of_answers = Submission(sources=submission.sources)
        take_files(lab, of_answers)
        own = {name: text for name, text in submission.files.items() if name not in of_answers.files}
        points = {cell.grade_id: cell.points for cell in grades[student].cells if cell.grade_id in checks}
        name = hashlib.sha256(json.dumps([sources, sorted(own.items())]).encode()).hexdigest()[:12]
        path = paths.bank(lab_name) / f"{name}.json"
        if not path.is_file():
            new += 1
            write_beside(path, Banked(sources=sources, own=own, points=points).model_dump_json(indent=1) + "\n")
    return new, len(students) - new


def check(root: Path, lab_name: str, settings: Settings) -> Compared:
    """Run today's checks on every entry of a lab, and return what they make of it.

    Args:
        root: the course's folder.
        lab_name: the lab.
        settings: how the entries are run.

    Raises:
        KitError: an entry cannot be read.
    """
    lab, entries = load_lab(root, lab_name), _entries(root, lab_name)
    jobs = [job_of(_submission(entry, lab), name, lab, settings) for name, entry in entries.items()]
    found: list[Difference] = []
    with closing(Local(settings.at_once).run(jobs, lambda _: None)) as ran:
        for result in ran:
            found += _differences(result.student, entries[result.student], result)
    stamp = {"state": _state(root, lab), "unexplained": len(found)}
    write_beside(CoursePaths(root).bank_checked(lab_name), json.dumps(stamp) + "\n")
    points = {cell.grade_id: [entry.points.get(cell.grade_id) for entry in entries.values()] for cell in lab.checks}
    return Compared(
        entries=len(entries),
        differences=sorted(found, key=lambda one: (one.check, one.entry)),
        never_decided=dict(
            Counter(name for one in entries.values() for name, got in one.points.items() if got is None)
        ),
        untried=[name for name, before in points.items() if not any(one is not None for one in before)],
    )


def explain(root: Path, lab_name: str, difference: Difference, because: str) -> None:
    """Record why an entry's check gives other points today."""
    entry = _entries(root, lab_name)[difference.entry]
    known = entry.explained | {difference.check: Explained(points=difference.now, because=because)}
    path = CoursePaths(root).bank(lab_name) / f"{difference.entry}.json"
    write_beside(path, entry.model_copy(update={"explained": known}).model_dump_json(indent=1) + "\n")


def refuse_unexplained(root: Path, lab: Lab) -> None:
    """Refuse to release a lab if the bank was not run with today's kit and lab, or if a difference is unexplained.

    Raises:
        KitError: the lab must not be released.
    """
    paths = CoursePaths(root)
    if not any(paths.bank(lab.name).glob("*.json")):
        return
    again = f"Run: autograder bank check {lab.name}"
    try:
        stamp = json.loads(paths.bank_checked(lab.name).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        stamp = {}
    if stamp.get("state") != _state(root, lab):
        raise KitError(f"{lab.name} is not released: the bank of past terms was not run with today's version.", again)
    if stamp["unexplained"]:
        differ = "1 difference is" if stamp["unexplained"] == 1 else f"{stamp['unexplained']} differences are"
        raise KitError(f"{lab.name} is not released: {differ} unexplained in the bank of past terms.", again)


def _state(root: Path, lab: Lab) -> str:
    """Return a digest of the kit, the lab and the bank."""
    paths = sorted(CoursePaths(root).bank(lab.name).glob("*.json"))
    parts = [lab.digest, *(hashlib.sha256(path.read_bytes()).hexdigest() for path in paths)]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _entries(root: Path, lab: str) -> dict[str, Banked]:
    found = {}
    for path in sorted(CoursePaths(root).bank(lab).glob("*.json")):
        try:
            found[path.stem] = Banked.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise KitError(f"{path} is no entry of the bank.", "Restore it from an earlier copy.") from error
    return found


def _submission(entry: Banked, lab: Lab) -> Submission:
    sources = {name: entry.sources.get(name, answer.blank) for name, answer in lab.answers.items()}
    submission = Submission(sources=sources)
    take_files(lab, submission)
    submission.files = {**entry.own, **submission.files}
    return submission


def _differences(name: str, entry: Banked, result: SubmissionResult) -> list[Difference]:
    found = []
    today = {one.grade_id: one for one in result.checks}
    for check_id, before in entry.points.items():
        one, known = today.get(check_id), entry.explained.get(check_id)
        now = one.points if one is not None else None
        if before is None or now == before or (known is not None and known.points == now):
            continue  # nobody had decided, or somebody has explained it
        why = "It gives no result any more."
        if one is not None:
            why = one.first_failure.because if one.first_failure is not None else ""
        found.append(Difference(name, check_id, before, now, why))
    return found
