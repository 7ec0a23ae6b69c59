"""Takes in what was handed in: a folder or a zip with something of each student's, into `build/submitted`.

Of each student only the lab's notebook is taken, as bytes, and what nbgrader's exchange puts beside it. Names are
checked, links are not followed, nothing is unpacked to a place that a name in a zip could choose. What is not taken is
said, and costs nobody else anything. Where somebody would be lost or replaced, nothing is taken in until a person has
said that this is right.
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
    how = f"a class from {reading.format.title}" if reading.format.title else "a class without a platform"
    inside = f", inside {'/'.join(reading.around)[:100]!r}" if reading.around else ""
    raise KitError(
        f"{' '.join(open_ones.values())} The submissions were read as {how}{inside}, with"
        f" {count(len(students), 'student')}. Nothing was graded.",
        f"Check the submissions and to whom they belong. If all is right, run the command again with {options}.",
    )


def _strangers(names: Sequence[str]) -> str:
    matches = "matches" if len(names) == 1 else "match"
    return f"{some(names, ', ')} {matches} no student in the roster, or more than one." if names else ""


def _missing(source: Path, lost: Sequence[str]) -> str:
    if not lost:
        return ""
    are = "is" if len(lost) == 1 else "are"
    return (
        f"{count(len(lost), 'student')} from the roster or from the last run {are} missing in {source}:"
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
"""nbgrader's configuration in the folder of what was taken in."""


_ONCE = re.compile(r"([.;] [Ii]t was left out)?\.$")
"""The end of a sentence about what was left out, which goes without saying in a list of such."""


@dataclass
class Collected:
    """What was taken in."""

    format: str = ""
    """The learning platform that the submissions came from; empty for a class that none gave out."""
    around: tuple[str, ...] = ()
    """The folders and zips in the source that lie around the class."""
    notebooks: dict[str, Path] = field(default_factory=dict)
    """The notebook under `build/submitted`, by student; an empty file where nothing was handed in."""
    refused: list[str] = field(default_factory=list)
    """What was left out, and why, as sentences."""
    notes: list[str] = field(default_factory=list)
    """What replaced what, who was late, and who has another name here, as sentences."""
    files: int = 0
    """How many were seen."""
    students: int = 0
    """Whose they are."""
    unused: list[str] = field(default_factory=list)
    """Notebooks that do not count and need not, each with the reason, in a few words."""
    companions: int = 0
    """Files of students that are no notebooks."""

    @property
    def line(self) -> str:
        """How many files were seen, how many students they are, and which files were not used and why."""
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
        source: a folder or a zip, as a learning platform gives it out (`formats`), or with something of each student's
            under the student's name; folders and zips around all of them do no harm.
        lab: to take.
        root: of the course. A file `roster.csv` there joins the platforms' names to those of the gradebook.
        format_name: as what to read it; empty: as what it is.
        accepted: what somebody has said to be right.
        tried_in: a folder that gets the notebooks in place of the course, of which nothing is changed then.

    Raises:
        KitError: there is nothing to take in, or it can be read in two ways, or somebody would be lost or replaced. In
            each case nothing is changed.
    """
    roster = read_roster(root / FILE_NAME) if (root / FILE_NAME).is_file() else None
    before = taken_before(root, lab)
    own = source.resolve() == CoursePaths(root).submitted.resolve()
    reading = read_class(source, lab, format_name, _known(own, roster, before))
    recognised = reading.recognised
    students = named(recognised.claims, roster, known_persons(root, lab))
    missing = gone(source, students, roster, before)
    stop(source, students, reading, missing.lost, before, accepted)
    collected = Collected(_title(reading), reading.around, notes=list(reading.notes))
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
        do = f"Each student needs a folder that holds {lab}.ipynb."
        raise KitError(f"There are no submissions in {source}.{why}", do)
    paths = CoursePaths(tried_in or root)
    if not (paths.build / "nbgrader_config.py").is_file():
        write_beside(paths.build / "nbgrader_config.py", CLOSED)
    taken: dict[str, Taken] = {}
    for name, (student, chosen, notebook) in handed_in.items():
        collected.notebooks[name] = _write(paths, name, lab, chosen, notebook, collected)
        if own and name in before:  # what the platform said of it still holds
            taken[name] = before[name].model_copy(update={"left": False})
        else:
            taken[name] = _taken(source, reading, student, chosen)
    if tried_in is None:
        keep_class(root, lab, taken, {**missing.lost, **missing.renamed})
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
    except NotUnderstoodError:  # it is a file that cannot be looked into
        return 1


def _known(own: bool, roster: Roster | None, before: Mapping[str, Taken]) -> Known:
    def is_student(name: str) -> bool:
        ways = dict.fromkeys(("id", "email", "name", "github"), name)
        return name in before or (roster is not None and roster.student(ways) is not None)

    around = {taken.around for taken in before.values()} if before else None
    return Known(is_student, roster is not None, own, around)


def _one_each(students: Sequence[Student], reading: Reading, collected: Collected) -> list[Student]:
    """The students under the names that they have here, each once; what stands in the way of that has been accepted."""
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
            # What somebody has added beside a platform's files is the later one.
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
    """What of a student's counts, and its bytes; None if nobody can say, which is told."""
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
        with contextlib.suppress(Exception):  # each way of packing fails in its own way
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
        collected.notes.append(f"{who}: {reading.format.title} has marked it as late.")
    return chosen, notebook


def _write(paths: CoursePaths, student: str, lab: str, chosen: Chosen, notebook: bytes, collected: Collected) -> Path:
    """Write a student's notebook, and what nbgrader's exchange put beside it; return the notebook's place."""
    path = paths.submitted_notebook(student, lab)
    # An unchanged file keeps its time: nbgrader and people can see that nothing new was handed in.
    if _read(paths.submitted, [student, lab, path.name]) != notebook:
        _remove_links(paths.submitted, student, lab)
        write_beside(path, notebook)
    stamp = chosen.claim.handed_in.encode() or beside(chosen, timestamp.FILE_NAME, timestamp.MOST_BYTES)
    said = timestamp.moment(stamp) if stamp else ""
    if said is None:
        collected.refused.append(f"{timestamp.FILE_NAME} of {student} is no date and time; it was left out.")
    _keep(paths.submitted, [student, lab, timestamp.FILE_NAME], said or "")
    secret = exchange_secret.secret(beside(chosen, exchange_secret.FILE_NAME, exchange_secret.MOST_BYTES))
    _keep(paths.submitted, [student, lab, exchange_secret.FILE_NAME], secret)
    return path


def _farewells(missing: Gone, before: Mapping[str, Taken]) -> list[str]:
    """Sentences about who has left the class."""
    left = [
        f"{student} is no longer among the submissions and was removed from grades.csv, the class page and the exports."
        " The gradebook keeps the grades."
        for student in missing.lost
        if student in before
    ]
    return left + [
        f"{student} has a different name now, so the old name was removed from grades.csv, the class page and the"
        " exports. Points that somebody gave by hand stay in the gradebook under the old name."
        for student in missing.renamed
    ]


def _keep(submitted: Path, parts: Sequence[str], text: str) -> None:
    """Write what nbgrader looks for beside a notebook: when it was handed in, and how feedback on it is fetched."""
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
    """Remove links that lie where a notebook is to be written: writing would follow them."""
    for path in (submitted / student, submitted / student / lab):
        if path.is_symlink():
            path.unlink()
