"""A bank of past terms: anonymous answers with their verdicts, which today's kit and lab must still give.

A verdict is the final points of a check, and, if nobody changed these points by hand, the points of its parts, the
reasons for which points were lost, and how many expectations held. Points alone would hide a check that takes points
off for the wrong reason, or that no longer looks at something.

Only programs and files are kept, without the names of students and without answers in words. A difference is either a
mistake in today's check, or a mistake of the past that somebody explains. A lab is not released before that.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections import Counter
from contextlib import closing
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError
from rich.console import Console

from autograder.authoring.mutation.mutants import using
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.core.results import CheckResult, Part, Status, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import Steps
from autograder.gradebook.grades import read_grades
from autograder.grading.class_runner import run_jobs
from autograder.grading.executors.local import Local
from autograder.grading.runner import Settings, job_of
from autograder.grading.store import ResultStore
from autograder.grading.trusted_result import was_too_busy
from autograder.intake.words import some
from autograder.submission.answers import Submission, take_files
from autograder.submission.reader import read_submission


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Verdict(_Model):
    """What a check says about an entry, without the sentences for the student."""

    points: float | None
    parts: list[Part] | None = None
    """The parts with their titles and points; None if only the points are known or decided."""
    codes: dict[str, str] | None = None
    """The code of the first failure in each part, by the part's title; None as above."""
    expectations: dict[str, int] | None = None
    """How many expectations hold in each part that has all of its points, by the part's title; None as above. An answer
    that is right shows by this that a check no longer looks at something."""

    def is_covered_by(self, known: Verdict) -> bool:
        """Return whether all that is known about the verdict of the past holds for this one as well."""
        return (
            known.points == self.points
            and (known.parts is None or known.parts == self.parts)
            and (known.codes is None or known.codes == self.codes)
            and (known.expectations is None or known.expectations == self.expectations)
        )


class Explained(Verdict):
    """A verdict of today that differs from the past, and why it is right."""

    because: str


class Banked(_Model):
    """One student's answers."""

    sources: dict[str, str]
    """The source of each answer that is a file, by grade_id."""
    own: dict[str, str]
    """The files of cells that the student added."""
    points: dict[str, float | None]
    """The final points of each check, with what people decided, by grade_id."""
    verdicts: dict[str, Verdict] = {}
    """The verdicts of the checks whose points nobody changed, by grade_id."""
    explained: dict[str, Explained] = {}
    """Differences that somebody has explained, by grade_id."""

    def verdict(self, check: str) -> Verdict:
        """Return what is known about the verdict of a check."""
        return self.verdicts.get(check, Verdict(points=self.points[check]))


class Difference(_Model):
    """A check that says something else than in the past."""

    entry: str
    check: str
    before: Verdict
    now: Verdict
    because: str
    """The first reason that the check gives today; empty if it passes."""

    @property
    def changes(self) -> list[str]:
        """What is different, in a few words each."""
        before, now, found = self.before, self.now, []
        if before.points != now.points:
            found.append(f"{_number(before.points)} → {_number(now.points)}")
        if before.parts is not None and now.parts is not None:
            old, new = ({part.title: part for part in one} for one in (before.parts, now.parts))
            found += [f"part `{title}` is gone" for title in old if title not in new]
            found += [f"part `{title}` is new" for title in new if title not in old]
            found += [
                f"part `{title}` {_of(old[title])} → {_of(part)}"
                for title, part in new.items()
                if title in old and old[title] != part
            ]
        if before.codes is not None and now.codes is not None:
            for part in dict.fromkeys([*before.codes, *now.codes]):
                reasons = [f"`{codes[part]}`" if part in codes else "no reason" for codes in (before.codes, now.codes)]
                where = f" of part `{part}`" if part else ""
                if reasons[0] != reasons[1]:
                    found.append(f"reason{where} {reasons[0]} → {reasons[1]}")
        if before.expectations is not None and now.expectations is not None:
            for part, number in before.expectations.items():
                where = f" of part `{part}`" if part else ""
                if now.expectations.get(part, number) != number:
                    found.append(f"expectations{where} {number} → {now.expectations[part]}")
        return found


class _Stamp(_Model):
    """With which version the bank was run, and what it found that nobody has explained."""

    state: str
    differences: list[Difference]
    too_busy: int
    """The number of verdicts that the machine was too busy for."""


@dataclass(frozen=True)
class Compared:
    """What today's checks make of the entries of a lab."""

    entries: int
    differences: list[Difference]
    """Those that nobody has explained."""
    too_busy: dict[str, int]
    """Of checks that could not be decided today because the machine was too busy: in how many entries, by grade_id."""
    never_decided: dict[str, int]
    """Of checks that had no points in some entries when these were added: the number of those, by grade_id."""
    untried: list[str]
    """The checks that no entry has final points for, so that the bank says nothing about them."""


@dataclass(frozen=True)
class Added:
    """What has become of the submissions of a graded class."""

    entries: int
    """The number of new entries."""
    known: int
    """The number of students whose answers were in the bank already."""
    unreadable: int
    """The number of students whose notebook cannot be read."""


def add(root: Path, lab_name: str) -> Added:
    """Add the graded class of a lab to the bank.

    Raises:
        KitError: the lab has no grades.
    """
    lab, paths = load_lab(root, lab_name), CoursePaths(root)
    grades = {grade.student: grade for grade in read_grades(root, lab_name)}
    results = {one.student: one for one in ResultStore(root).all(lab_name) if one.student in grades}
    if not results:
        raise KitError(
            f"There are no grades of {lab_name}.", f"Grade a class first: autograder grade {lab_name} SUBMISSIONS"
        )
    new = unreadable = 0
    checks = {cell.grade_id for cell in lab.checks}
    for student, result in results.items():
        submission = read_submission(paths.submitted_notebook(student, lab_name), lab)
        if not submission.readable:
            unreadable += 1
            continue
        sources = {name: text for name, text in submission.sources.items() if lab.answers[name].file is not None}
        of_answers = Submission(sources=submission.sources)
        take_files(lab, of_answers)
        own = {name: text for name, text in submission.files.items() if name not in of_answers.files}
        points = {cell.grade_id: cell.points for cell in grades[student].cells if cell.grade_id in checks}
        given = {one.grade_id: verdict(one) for one in result.checks}
        verdicts = {name: one for name, one in given.items() if one.points == points.get(name)}
        name = hashlib.sha256(json.dumps([sources, sorted(own.items())]).encode()).hexdigest()[:12]
        path = paths.bank(lab_name) / f"{name}.json"
        if not path.is_file():
            new += 1
            banked = Banked(sources=sources, own=own, points=points, verdicts=verdicts)
            write_beside(path, banked.model_dump_json(indent=1) + "\n")
    return Added(entries=new, known=len(results) - new - unreadable, unreadable=unreadable)


def check(root: Path, lab_name: str, settings: Settings) -> Compared:
    """Run today's checks on every entry of a lab, show the progress, and return what they make of it.

    Args:
        root: the course's folder.
        lab_name: the lab.
        settings: how the entries are run.

    Raises:
        KitError: there is no entry, or one cannot be read.
    """
    lab, entries = load_lab(root, lab_name), _entries(root, lab_name)
    if not entries:
        raise KitError(f"The bank has no answers of {lab_name}.", f"Add a graded class: autograder bank add {lab_name}")
    jobs = [job_of(_submission(entry, lab), name, lab, settings) for name, entry in entries.items()]
    found: list[Difference] = []
    too_busy: Counter[str] = Counter()
    with (
        Steps(len(jobs), Console(file=sys.stderr, highlight=False)) as steps,
        closing(run_jobs(Local(settings.at_once, settings.further), jobs, steps.started)) as ran,
    ):
        for result in ran:
            steps.finished(result)
            found += differences(result.student, entries[result.student], result)
            too_busy.update(one.grade_id for one in result.checks if was_too_busy(one))
    found.sort(key=lambda one: (one.check, one.entry))
    _write_stamp(root, lab, found, too_busy.total())
    points = {cell.grade_id: [entry.points.get(cell.grade_id) for entry in entries.values()] for cell in lab.checks}
    return Compared(
        entries=len(entries),
        differences=found,
        too_busy=dict(too_busy),
        never_decided=dict(
            Counter(name for one in entries.values() for name, got in one.points.items() if got is None)
        ),
        untried=[name for name, before in points.items() if not any(one is not None for one in before)],
    )


def programs(root: Path, lab_name: str, entry: str, check_id: str) -> dict[str, str]:
    """Return the sources of an entry that can affect a check, by the grade_id of the answer.

    Raises:
        KitError: there is no such entry or check, or an entry cannot be read.
    """
    lab, entries = load_lab(root, lab_name), _entries(root, lab_name)
    if entry not in entries:
        raise KitError(f"The bank has no entry {entry} of {lab_name}.", "`autograder bank check` lists the entries.")
    meant = next((cell for cell in lab.checks if cell.grade_id == check_id), None)
    if meant is None:
        raise KitError(f"{lab_name} has no check `{check_id}`.", "`autograder bank check` lists the checks.")
    sources = _submission(entries[entry], lab).sources
    return {name: sources[name] for name in sorted(using(lab, meant)) if name in entries[entry].sources}


def explain(root: Path, lab_name: str, entry: str, check_id: str, because: str) -> int:
    """Record why a check says something else today, as the last run of the bank has found.

    Args:
        root: the course's folder.
        lab_name: the lab.
        entry: the entry; `all` for all entries in which the check differs.
        check_id: the check.
        because: the reason.

    Returns:
        The number of differences that are explained now.

    Raises:
        KitError: the last run found no such difference, or an entry cannot be read.
    """
    lab, stamp, entries = load_lab(root, lab_name), _read_stamp(root, lab_name), _entries(root, lab_name)
    found = stamp.differences if stamp is not None else []
    meant = [one for one in found if one.check == check_id and entry in (one.entry, "all") and one.entry in entries]
    if not meant:
        raise KitError(
            f"The last `autograder bank check {lab_name}` found no difference of {check_id} in {entry!r}.",
            f"Run it, and name an entry that it lists, or `all`: autograder bank check {lab_name}",
        )
    of_today = stamp if stamp is not None and stamp.state == _state(root, lab) else None
    for one in meant:
        banked = entries[one.entry]
        known = banked.explained | {check_id: Explained(**one.now.model_dump(), because=because)}
        path = CoursePaths(root).bank(lab_name) / f"{one.entry}.json"
        write_beside(path, banked.model_copy(update={"explained": known}).model_dump_json(indent=1) + "\n")
    if of_today is not None:  # nothing but the explanations has changed, so nothing needs to run again
        _write_stamp(root, lab, [one for one in found if one not in meant], of_today.too_busy)
    return len(meant)


def refuse_unexplained(root: Path, lab: Lab) -> None:
    """Refuse to release a lab if the bank was not run completely with today's version, or a difference is unexplained.

    Raises:
        KitError: the lab must not be released.
    """
    paths = CoursePaths(root)
    if not any(paths.bank(lab.name).glob("*.json")):
        return
    again = f"Run: autograder bank check {lab.name}"
    stamp = _read_stamp(root, lab.name)
    if stamp is None or stamp.state != _state(root, lab):
        raise KitError(f"{lab.name} is not released: the bank of past terms was not run with today's version.", again)
    if stamp.differences:
        differ = "1 difference is" if len(stamp.differences) == 1 else f"{len(stamp.differences)} differences are"
        where = some([f"{one.check} of {one.entry}" for one in stamp.differences], ", ")
        raise KitError(
            f"{lab.name} is not released: {differ} unexplained in the bank of past terms: {where}.",
            f"Correct the check, or explain the difference: autograder bank explain {lab.name} ENTRY CHECK REASON",
        )
    if stamp.too_busy:
        raise KitError(
            f"{lab.name} is not released: the machine was too busy to run the whole bank of past terms.",
            f"{again}. Do this when the machine has less to do, or with fewer entries at once, such as --jobs 1.",
        )


def _read_stamp(root: Path, lab: str) -> _Stamp | None:
    try:
        return _Stamp.model_validate_json(CoursePaths(root).bank_checked(lab).read_bytes())
    except (OSError, ValidationError):
        return None  # it never ran, or another version of the kit wrote this


def _write_stamp(root: Path, lab: Lab, found: list[Difference], too_busy: int) -> None:
    stamp = _Stamp(state=_state(root, lab), differences=found, too_busy=too_busy)
    write_beside(CoursePaths(root).bank_checked(lab.name), stamp.model_dump_json(indent=1) + "\n")


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


def verdict(check: CheckResult) -> Verdict:
    """Return what a check says about an entry, without the sentences."""
    codes: dict[str, str] = {}
    for one in check.outcomes:
        if one.status in (Status.FAILED, Status.UNKNOWN):
            codes.setdefault(one.part, one.code)
    whole = {part.title for part in check.parts if part.points == part.max_points}
    whole |= {""} if check.points == check.max_points else set()
    passed = [(one.part, one.title) for one in check.outcomes if one.status is Status.PASSED and one.part in whole]
    # On a busy machine, a check that asks until something happens may ask once more: equal neighbours count as one.
    held = Counter(part for (part, _), _ in groupby(passed))
    return Verdict(points=check.points, parts=check.parts, codes=codes, expectations=dict(held))


def differences(name: str, entry: Banked, result: SubmissionResult) -> list[Difference]:
    """Return the checks that say something else about an entry than in the past.

    Checks that are explained or that the machine was too busy for are left out.
    """
    found = []
    today = {one.grade_id: one for one in result.checks}
    for check_id, points in entry.points.items():
        one, before, known = today.get(check_id), entry.verdict(check_id), entry.explained.get(check_id)
        now = verdict(one) if one is not None else Verdict(points=None)
        if points is None or now.is_covered_by(before) or (known is not None and now.is_covered_by(known)):
            continue  # nobody had decided, or somebody has explained it
        if one is not None and was_too_busy(one):
            continue  # this says nothing about the check
        why = "It gives no result any more."
        if one is not None:
            why = one.first_failure.because if one.first_failure is not None else ""
        found.append(Difference(entry=name, check=check_id, before=before, now=now, because=why))
    return found


def _number(points: float | None) -> str:
    return "?" if points is None else f"{points:g}"


def _of(part: Part) -> str:
    return f"{part.points:g} of {part.max_points:g}"
