"""Take in the submissions of a class from a folder or a zip, and write them to `build/submitted`.

Only the lab's notebook of each student is taken, as bytes, and the files that nbgrader's exchange puts beside it. Names
are checked, links are not followed, and a name in a zip cannot choose where a file is written. Every file that is left
out is reported, and does not affect other students. If a student would be missing or replaced, nothing is taken in
until a person has accepted that.
"""

from __future__ import annotations

import contextlib
import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import read_plain, write_beside
from autograder.course.lab import lab_names
from autograder.course.paths import CoursePaths
from autograder.intake.entries import Entry, NotUnderstoodError
from autograder.intake.formats import PLAIN
from autograder.intake.members import is_notebook
from autograder.intake.options import Accepted
from autograder.intake.record import Taken, keep_class, known_persons, person
from autograder.intake.record import read_class as taken_before
from autograder.intake.roster import FILE_NAME, Roster, Student, file_name, named, read_roster
from autograder.intake.which_format import Known, Reading, read_class
from autograder.intake.which_notebook import Chosen, beside, choose, read
from autograder.intake.words import count, some
from autograder.submission import exchange_secret, timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES


@dataclass(frozen=True)
class Gone:
    """The students from the roster or from the last run who are not among the submissions."""

    lost: Mapping[str, Taken]
    """The students who are missing."""
    renamed: Mapping[str, str]
    """The new names of students who are among the submissions under another name, by their old names."""


def gone(
    source: Path,
    students: Sequence[Student],
    roster: Roster | None,
    before: Mapping[str, Taken],
    known: Mapping[tuple[str, str], str],
) -> Gone:
    """Return the students who are not among the submissions.

    A student who was taken in from another source counts only if that source held the same class, which is assumed if
    some of its students are in this class.

    Args:
        source: the folder or zip of the submissions.
        students: the students whose work is in it.
        roster: the course's roster, if it has one.
        before: what was taken in before for this lab, by student.
        known: the names in the gradebook of the persons who were taken in before, for this lab or for another.
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
    persons = {person(claim.owner): file_name(student.name) for student in students for claim in student.claims}
    persons.pop(None, None)
    renamed = {name: persons[who] for name, taken in missing.items() if (who := person(taken.owner)) in persons}
    if roster is not None:  # it knows the number even if the platform of this lab does not tell it
        new_ids = {old: file_name(new) for who, old in known.items() if (new := roster.holder(*who)) is not None}
        listed = set(map(file_name, roster.students))
        renamed |= {old: new for old, new in new_ids.items() if old not in listed}
    return Gone({name: taken for name, taken in missing.items() if name not in renamed}, renamed)


def stop(
    source: Path,
    students: Sequence[Student],
    reading: Reading,
    missing: Gone,
    before: Mapping[str, Taken],
    accepted: Collection[Accepted],
) -> None:
    """Stop if a student would be missing or replaced, or is not in the roster, and no person has accepted that.

    Args:
        source: the folder or zip of the submissions.
        students: the students whose work is in it.
        reading: how the source was read.
        missing: the students who are missing, or have another name.
        before: what was taken in before for this lab, by student.
        accepted: the objections that a person has accepted.

    Raises:
        KitError: there is an objection that no person has accepted.
    """
    strangers = [repr(student.name[:100]) for student in students if not student.listed]
    objections = {
        Accepted.SMALLER: _missing(source, sorted(missing.lost)),
        Accepted.RENAMED: some([_renamed(old, new) for old, new in sorted(missing.renamed.items())], " "),
        Accepted.ROSTER: _strangers(strangers),
        Accepted.REPLACED: some(_replaced(students, before), " "),
    }
    open_ones = {kind: sentence for kind, sentence in objections.items() if sentence and kind not in accepted}
    if not open_ones:
        return
    options = " ".join(f"--accept {kind.value}" for kind in open_ones)
    how = f"a class from {reading.format.title}" if reading.format.title else "a class without a platform"
    inside = f", inside {'/'.join(reading.around)[:100]!r}" if reading.around else ""
    raise KitError(
        f"{' '.join(open_ones.values())} The submissions were read as {how}{inside}, with"
        f" {count(len(students), 'student')}. Nothing was graded.",
        f"Check the submissions and to whom they belong. If all is right, run the command again with {options};"
        f" with make, write ARGS='{options}'.",
    )


def _strangers(names: Sequence[str]) -> str:
    matches = "matches" if len(names) == 1 else "match"
    return f"{some(names, ', ')} {matches} no student in the roster, or more than one." if names else ""


def _renamed(old: str, new: str) -> str:
    same = f"has the same number on the platform as {new[:80]!r}, so they are one person."
    return f"{old[:80]!r} of an earlier run {same}"


def _missing(source: Path, lost: Sequence[str]) -> str:
    if not lost:
        return ""
    are = "is" if len(lost) == 1 else "are"
    return (
        f"{count(len(lost), 'student')} from the roster or from the last run {are} missing in {source}:"
        f" {some([repr(name[:100]) for name in lost], ', ')}."
    )


def _replaced(students: Sequence[Student], before: Mapping[str, Taken]) -> list[str]:
    """Return sentences about submissions that would replace the work of somebody else."""
    told = []
    first: dict[str, Student] = {}
    for student in students:
        name = file_name(student.name)
        if name in first:
            one, other = (given.claims[0].entry.name[:80] for given in (first[name], student))
            told.append(
                f"{one!r} and {other!r} belong to the same student, {name[:80]!r}, and it is not clear which of them"
                " counts."
            )
        first.setdefault(name, student)
        was = person(before[name].owner) if name in before and not before[name].left else None
        now = person(student.claims[0].owner)
        if was is not None and now is not None and was[0] == now[0] and was != now:
            told.append(f"{name[:80]!r} was {was[1][:80]!r} in the last run, but is {now[1][:80]!r} now.")
    return told


CLOSED = """\
# Here lie submissions under the names that nbgrader looks for. Without this file, nbgrader started in this folder
# would take it for a course of its own, and execute them.
import sys

sys.exit("This folder is not a course: start nbgrader in the folder above it. Nothing was executed.")
"""
"""The nbgrader configuration that is put into the folder above the submissions."""


_ONCE = re.compile(r"([.;] [Ii]t was left out)?\.$")
"""The end of a sentence about something that was left out; a list of such things does not repeat it."""


@dataclass
class Collected:
    """What was taken in, and what was left out."""

    format: str = ""
    """The learning platform that the submissions came from; empty if they do not come from a platform."""
    around: tuple[str, ...] = ()
    """The folders and zips in the source that contain the whole class."""
    notebooks: dict[str, Path] = field(default_factory=dict)
    """The notebook under `build/submitted`, by student; an empty file if the student handed in nothing."""
    refused: list[str] = field(default_factory=list)
    """Sentences about what was left out, and why."""
    notes: list[str] = field(default_factory=list)
    """Sentences about files that were replaced, students who were late, and students who have another name here."""
    files: int = 0
    """The number of files that were seen."""
    students: int = 0
    """The number of students to whom the files belong."""
    unused: list[str] = field(default_factory=list)
    """Notebooks that do not count because another one does, each with a short reason."""
    companions: int = 0
    """The number of students' files that are no notebooks."""

    @property
    def line(self) -> str:
        """A summary: the numbers of files and students, and the files that were not used, with the reasons."""
        given = f", from {self.format}" if self.format else ""
        inside = f", inside {'/'.join(self.around)[:100]!r}" if self.around else ""
        told = f"{count(self.files, 'file')} of {count(self.students, 'student')}{given}{inside}."
        unused = [*self.unused]
        if self.companions:
            unused.append(
                f"{count(self.companions, 'file')} that {'is' if self.companions == 1 else 'are'} no notebook"
            )
        if unused:
            told += f" Not used: {some(unused, '; ')}."
        if self.refused:
            told += f" LEFT OUT: {some([_ONCE.sub('', one) for one in self.refused], '; ')}."
        return told if unused or self.refused else f"{told} All are used."


def collect(
    source: Path,
    lab: str,
    root: Path,
    format_name: str = "",
    accepted: Collection[Accepted] = (),
    tried_in: Path | None = None,
) -> Collected:
    """Take in a class.

    Args:
        source: a folder or a zip with the submissions, either as a learning platform exports them (`formats`), or with
            a folder, zip or notebook for each student, named after the student. The class may be inside further folders
            and zips.
        lab: the lab to take in.
        root: the course's folder. A file `roster.csv` in it maps the platform's names to those of the gradebook.
        format_name: the format of the submissions; empty to detect it.
        accepted: the objections that a person has accepted.
        tried_in: a folder to which the notebooks are written instead of the course. The course is then not changed.

    Raises:
        KitError: there is nothing to take in, or the source can be read in two ways, or a student would be missing or
            replaced. In each case nothing is changed.
    """
    roster = read_roster(root / FILE_NAME) if (root / FILE_NAME).is_file() else None
    before = taken_before(root, lab)
    own = source.resolve() == CoursePaths(root).submitted.resolve()
    reading = read_class(source, lab, format_name, _known(own, roster, before))
    recognised = reading.recognised
    persons = known_persons(root, lab)
    students = named(recognised.claims, roster, persons)
    missing = gone(source, students, roster, before, persons)
    stop(source, students, reading, missing, before, accepted)
    collected = Collected(_title(reading), reading.around, notes=[*reading.notes, *(roster.shared if roster else [])])
    others = [name for name in lab_names(root) if name != lab]
    collected.refused += [f"{sentence} It was left out." for sentence in recognised.strange]
    handed_in = {
        student.name: (student, *found)
        for student in _one_each(students, reading, collected)
        if (found := _handed_in(student, lab, others, reading, collected)) is not None
    }
    collected.students = len({file_name(student.name) for student in students})
    collected.files = len(recognised.strange) + sum(map(_number_of_files, {one.entry for one in recognised.claims}))
    if not handed_in:
        why = f" {collected.refused[0]}" if collected.refused else ""
        raise KitError(f"There are no submissions in {source}.{why}", f"Each student needs a folder with {lab}.ipynb.")
    paths = CoursePaths(tried_in or root)
    if not (paths.build / "nbgrader_config.py").is_file():
        write_beside(paths.build / "nbgrader_config.py", CLOSED)
    taken: dict[str, Taken] = {}
    for name, (student, chosen, notebook) in handed_in.items():
        collected.notebooks[name] = _write(paths, name, lab, chosen, notebook, collected)
        if own and name in before:  # what the platform said about the submission is still true
            taken[name] = before[name].model_copy(update={"left": False})
        else:
            taken[name] = _taken(source, reading, student, chosen)
    if tried_in is None:
        keep_class(root, lab, taken, missing.lost, missing.renamed)
        collected.notes += _farewells(missing, before)
    return collected


def _taken(source: Path, reading: Reading, student: Student, chosen: Chosen) -> Taken:
    platform = reading.format is not PLAIN and not chosen.claim.by_hand
    return Taken(
        source=str(source.resolve()),
        around="/".join(reading.around),
        file="/".join(chosen.member.path) if platform and chosen.member is not None else "",
        owner=dict(student.claims[0].owner) if platform else {},
        late=chosen.claim.late,
    )


def _title(reading: Reading) -> str:
    claims = reading.recognised.claims
    flat = reading.format is PLAIN and claims and all(is_notebook(claim.entry.name) for claim in claims)
    return "a folder of files" if flat else reading.format.title


def _number_of_files(entry: Entry) -> int:
    try:
        return len(entry.files)
    except NotUnderstoodError:  # the entry is a file that cannot be opened
        return 1


def _known(own: bool, roster: Roster | None, before: Mapping[str, Taken]) -> Known:
    def is_student(name: str) -> bool:
        ways = dict.fromkeys(("id", "email", "name", "github"), name)
        return name in before or (roster is not None and roster.student(ways) is not None)

    around = {taken.around for taken in before.values()} if before else None
    return Known(is_student, roster is not None, own, around)


def _one_each(students: Sequence[Student], reading: Reading, collected: Collected) -> list[Student]:
    """Return each student once, under the student's name here. Conflicts between them have been accepted before."""
    found: dict[str, Student] = {}
    for student in students:
        name = file_name(student.name)
        here = Student(name, student.claims)
        if not name:
            collected.refused.append("A submission without a student's name was left out.")
        elif not student.listed and reading.format is not PLAIN and not student.claims[0].by_hand:
            who = ", ".join(student.claims[0].owner.values())[:100]
            collected.refused.append(f"{who!r} matches no student in the roster, or more than one; it was left out.")
        elif name in found:
            # A file that a person has added to those of the platform counts as the later one.
            kept, left = (here, found[name]) if student.claims[0].by_hand else (found[name], here)
            one, other = (given.claims[0].entry.name[:80] for given in (kept, left))
            collected.refused.append(f"{one!r} and {other!r} belong to the same student; the second was left out.")
            found[name] = kept
        else:
            found[name] = here
            if not student.listed:
                collected.notes.append(f"{name[:100]!r} is not in the roster, so the student keeps this name.")
            if name != unicodedata.normalize("NFC", student.name):
                collected.notes.append(
                    f"{student.name[:80]!r} cannot be a file's name here; the student is called {name!r}."
                )
    return [found[name] for name in sorted(found)]


def _handed_in(
    student: Student, lab: str, others: Collection[str], reading: Reading, collected: Collected
) -> tuple[Chosen, bytes] | None:
    """Return the notebook of a student that counts, and its bytes. If this is unclear, report it and return None."""
    who = student.name[:80]
    try:
        chosen = choose(student.claims, lab, others)
        notebook = read(chosen.member) if chosen.member is not None else b""
    except NotUnderstoodError as reason:
        collected.refused.append(f"{who!r} {reason}; it was left out.")
        return None
    collected.companions += chosen.companions
    if chosen.member is None:
        if reading.format is not PLAIN:
            collected.refused.append(f"{who!r} handed in no notebook; it was left out.")
            return None
        return chosen, notebook
    for other in chosen.doubtful:
        with contextlib.suppress(Exception):  # each kind of archive raises its own errors
            if other.read(NOTEBOOK_BYTES + 1) == notebook:
                collected.unused.append(f"{'/'.join(other.path)[-200:]!r} (the same as {chosen.member.name[:80]!r})")
                continue
        collected.refused.append(
            f"{'/'.join(other.path)[-200:]!r} is a copy of the notebook of {who!r} with other contents;"
            f" {chosen.member.name[:80]!r} counts, and the copy was left out."
        )
    for other in chosen.others:
        collected.unused.append(f"{'/'.join(other.path)[-200:]!r} ({chosen.member.name[:80]!r} of {who!r} counts)")
    for claim, why in chosen.replaced:
        names = f"{chosen.claim.entry.name[:100]!r} replaces {claim.entry.name[:100]!r}"
        collected.notes.append(f"{who}: {names}.")
        collected.unused.append(f"{claim.entry.name[:100]!r} of {who!r} ({why})")
    for claim, trouble in chosen.not_understood:
        told = f"{chosen.claim.entry.name[:100]!r} of {who!r} counts"
        collected.unused.append(f"{claim.entry.name[:100]!r}, which {trouble} ({told})")
    if chosen.claim.late:
        collected.notes.append(
            f"{who}: {reading.format.title} has marked it as late."
            + ("" if chosen.claim.handed_in else " Its download has no time, so no points are taken for that.")
        )
    return chosen, notebook


def _write(paths: CoursePaths, student: str, lab: str, chosen: Chosen, notebook: bytes, collected: Collected) -> Path:
    """Write a student's notebook and the exchange's files beside it, and return the path of the notebook."""
    path = paths.submitted_notebook(student, lab)
    # An unchanged file keeps its modification time, so nbgrader and people see that nothing new was handed in.
    if _read(paths.submitted, [student, lab, path.name]) != notebook:
        _remove_links(paths.submitted, student, lab)
        write_beside(path, notebook)
    stamp = chosen.claim.handed_in.encode() or beside(chosen, timestamp.FILE_NAME, timestamp.MOST_BYTES)
    said = timestamp.moment(stamp) if stamp else ""
    if said is None:
        collected.refused.append(f"{timestamp.FILE_NAME} of {student} is not a date and time; it was left out.")
    _keep(paths.submitted, [student, lab, timestamp.FILE_NAME], said or "")
    secret = exchange_secret.secret(beside(chosen, exchange_secret.FILE_NAME, exchange_secret.MOST_BYTES))
    _keep(paths.submitted, [student, lab, exchange_secret.FILE_NAME], secret)
    return path


def _farewells(missing: Gone, before: Mapping[str, Taken]) -> list[str]:
    """Return sentences about students who have left the class."""
    left = [
        f"{student} is no longer among the submissions and was removed from grades.csv, the class page and the exports."
        " The gradebook keeps the grades."
        for student in missing.lost
        if student in before
    ]
    return left


def _keep(submitted: Path, parts: Sequence[str], text: str) -> None:
    """Write a file that nbgrader expects beside a notebook, such as its timestamp; remove it if the text is empty."""
    path = submitted.joinpath(*parts)
    if not text:
        path.unlink(missing_ok=True)
    elif _read(submitted, parts) != text.encode():
        write_beside(path, text)


def _read(folder: Path, parts: Sequence[str]) -> bytes | None:
    with contextlib.suppress(OSError):
        return read_plain(folder, parts, NOTEBOOK_BYTES + 1)
    return None


def _remove_links(submitted: Path, student: str, lab: str) -> None:
    """Remove links in the path to which a notebook will be written, because writing would follow them."""
    for path in (submitted / student, submitted / student / lab):
        if path.is_symlink():
            path.unlink()
