"""Builds classes of every form that intake takes, with unlucky and hostile names in what students wrote.

As a script, `python tests/support/class_forms.py 10000` takes in as many classes, and says of each in which somebody
was lost, swapped or replaced; a number behind that is the first seed.
"""

from __future__ import annotations

import io
import random
import shutil
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from autograder.core.errors import KitError
from autograder.intake.collect import Collected, collect
from autograder.intake.roster import file_name

LAB = "toy"
PEOPLE = [
    "ann", "bob", "cem", "doe", "eve", "Jane Doe", "Jürgen Müller", "O'Brien Nora", "van_dyke_jan", "a_1", "B-2",
    "submission", "labs", "toys", "inbound", "Smith_LATE", "李雷", "María José", "x.y", "ann-marie", "12345", "José",
    "Robert Downey Jr.", "copy", "team 1 (2)", "late", "_under", "assignsubmission", "attempt", "file_", "zip",
]  # fmt: skip
FILE_NAMES = [
    "toy.ipynb", "TOY.ipynb", "toy-1.ipynb", "toy (1).ipynb", "my work.ipynb", "my_1_2_notes.ipynb", "final.ipynb",
    "ann_222_999_toy.ipynb", "Bob_501_assignsubmission_file_toy.ipynb", "Lab_bob_attempt_2026-11-20-18-30-00_toy.ipynb",
    "bob+toy+2026-11-20 10:00:00 UTC+a.ipynb", "submission_metadata.ipynb", "toy_bob.ipynb", "bob.ipynb", "_1_2_.ipynb",
]  # fmt: skip
METADATA = "submission_1:\n  :submitters:\n  - :name: bob\n    :sid: bob\n    :email: bob@x\n"
COMPANIONS = [
    "README.md", "photo.png", "data/a.csv", "roster.csv", "timestamp.txt", "submission_metadata.yml", "course.toml",
    "bob_222_999_notes.txt", "Bob_501_assignsubmission_file_/x.txt", "bob+toy+2026-11-20 10:00:00 UTC+a/x.txt",
    "submitted/bob/toy/x.txt", "toy-bob/labs/toy/x.txt", "submission_1/x.txt", "nbgrader_config.py",
    "Lab_bob_attempt_2026-11-20-18-30-00.txt", ".ipynb_checkpoints/toy-checkpoint.ipynb", "__MACOSX/._toy.ipynb",
]  # fmt: skip
OTHER_NOTEBOOKS = [
    "old/toy.ipynb", "ann_222_999_toy.ipynb", "Bob_501_assignsubmission_file_/toy.ipynb", "bob/toy.ipynb",
    "bob+toy+2026-12-20 10:00:00 UTC+a/toy.ipynb", "submitted/bob/toy/toy.ipynb", "toy-bob/labs/toy/toy.ipynb",
    "submission_1/toy.ipynb", "Lab_bob_attempt_2026-12-20-18-30-00_toy.ipynb", "scratch.ipynb",
]  # fmt: skip


@dataclass
class Student:
    """Somebody in a class that is built."""

    name: str
    number: int
    work: str
    files: dict[str, bytes] = field(default_factory=dict)
    """What they handed in, by path; with the notebook that must count."""
    notebook: str = "toy.ipynb"


@dataclass
class Built:
    """A class."""

    form: str
    files: dict[str, bytes]
    students: list[Student]
    hostile: bool


def built(seed: int) -> Built:
    """Return the class of a seed."""
    dice = random.Random(seed)
    hostile = dice.random() < 0.7
    names = dice.sample(PEOPLE, dice.choice([1, 2, 2, 3, 4, 6]))
    if dice.random() < 0.2 and len(names) > 1:
        names[-1] = names[0] + dice.choice(["", "_1", " ", "-1", "é"])
    students = [
        Student(name, 100 + 7 * number + dice.randrange(5), f"the work of {number} {name}")
        for number, name in enumerate(names)
    ]
    for student in students:
        _hand_in(student, dice, hostile)
    form = dice.choice(list(FORMS))
    if form.startswith("plain") or form in ("exchange", "submitted", "classroom50", "blackboard"):
        # Who gives these names sees to it that no two are one.
        students = list({student.name.replace(" ", ""): student for student in students}.values())
    files = FORMS[form](students, dice)
    if hostile and form.startswith("plain") and seed % 5 == 0:  # one student twice, as where a zip was unpacked
        again = Student(students[0].name, 0, "", {"toy.ipynb": b"not the work that counts"})
        for two in (_plain_folders, _plain_zips, _plain_files):
            files = two([again], dice) | files
    return Built(form, _packed(files, form, dice), students, hostile)


def _hand_in(student: Student, dice: random.Random, hostile: bool) -> None:
    student.notebook = dice.choice(FILE_NAMES) if hostile else "toy.ipynb"
    student.files = {student.notebook: student.work.encode()}
    for name in dice.sample(COMPANIONS, dice.randrange(4) if hostile else 0):
        text = METADATA if name.endswith(".yml") else "2026-11-20 10:00:00" if name == "timestamp.txt" else "x"
        student.files[name] = text.encode()
    if hostile and dice.random() < 0.5:  # the lab's own name at the top decides what counts then
        student.files.pop(student.notebook)
        student.notebook = "toy.ipynb"
        student.files["toy.ipynb"] = student.work.encode()
        for name in dice.sample(OTHER_NOTEBOOKS, dice.randrange(1, 4)):
            student.files[name] = f"not the work of {student.name}".encode()


def zipped(files: dict[str, bytes]) -> bytes:
    """Return a zip of files."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return content.getvalue()


def _upload(student: Student, dice: random.Random) -> tuple[str, bytes]:
    """One file, as platforms take it: the notebook, or a zip with all."""
    if len(student.files) > 1 or dice.random() < 0.3:
        name = dice.choice(["work.zip", "toy.zip", "hw_1_2_x.zip", "bob_222_999_toy.zip", "submitted.zip"])
        inner = student.files
        if dice.random() < 0.2:
            inner = {"in.zip": zipped(student.files)}
        return name, zipped(inner)
    return student.notebook, student.files[student.notebook]


def _canvas(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        name, content = _upload(student, dice)
        late = dice.choice(["", "", "_LATE"])
        plain = student.name.replace(" ", "").lower()
        files[f"{plain}{late}_{student.number}_{dice.randrange(1000, 9999)}_{name}"] = content
    return files


def _moodle(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    flat = dice.random() < 0.4
    files = {}
    for student in students:
        start = f"{student.name}_{student.number}_assignsubmission_file_"
        if flat:
            name, content = _upload(student, dice)
            files[f"{start}{name}"] = content
        else:
            files |= {f"{start}/{name}": content for name, content in student.files.items()}
            if dice.random() < 0.3:
                files[f"{start.replace('_file_', '_onlinetext_')}/onlinetext.html"] = b"<p>"
    return files


def _blackboard(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        user = student.name.replace(" ", "")
        name, content = _upload(student, dice)
        start = f"Lab 2_{user}_attempt_2026-11-{dice.randrange(10, 28)}-10-00-00"
        files[f"{start}_{name}"] = content
        files[f"{start}.txt"] = f"Name: {student.name} ({user})\nAssignment: Lab 2\n".encode()
    return files


def _gradescope(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    told = ""
    for student in students:
        folder = f"submission_{student.number}"
        told += (
            f"{folder}:\n  :submitters:\n  - :name: {student.name!r}\n    :email: s{student.number}@x.edu\n".replace(
                '"O\'Brien Nora"', "O'Brien Nora"
            )
        )
        files |= {f"{folder}/{name}": content for name, content in student.files.items()}
    listed = {"submission_metadata.yml": told.encode()}
    return listed | files if dice.random() < 0.5 else files | listed


def _classroom50(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        top = f"toy-{student.name.replace(' ', '')}"
        files[f"{top}/labs/toy/{student.notebook}"] = student.files[student.notebook]
        files |= {f"{top}/{name}": text for name, text in student.files.items() if not name.endswith(".ipynb")}
    return files


def _exchange(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        top = f"{student.name}+toy+2026-11-{dice.randrange(10, 28)} 10:00:00.123456 UTC+{dice.randrange(10**6)}"
        files |= {f"{top}/{name}": text for name, text in student.files.items()}
    return files


def _submitted(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {"source/toy/toy.ipynb": b"the lab"}
    for student in students:
        files |= {f"submitted/{student.name}/toy/{name}": text for name, text in student.files.items()}
    return files


def _plain_folders(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        deeper = dice.choice(["", "", "", "toy/", "lab/"])
        files |= {f"{student.name}/{deeper}{name}": text for name, text in student.files.items()}
    return files


def _plain_zips(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    return {f"{student.name}.zip": zipped(student.files) for student in students}


def _plain_files(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    start = dice.choice(["", "toy_"])
    return {f"{start}{student.name}.ipynb": student.files[student.notebook] for student in students}


def _plain_mixed(students: list[Student], dice: random.Random) -> dict[str, bytes]:
    files = {}
    for student in students:
        files |= dice.choice([_plain_folders, _plain_zips, _plain_files])([student], dice)
    return files


FORMS: dict[str, Callable[[list[Student], random.Random], dict[str, bytes]]] = {
    "canvas": _canvas, "moodle": _moodle, "blackboard": _blackboard, "gradescope": _gradescope,
    "classroom50": _classroom50, "exchange": _exchange, "submitted": _submitted, "plain folders": _plain_folders,
    "plain zips": _plain_zips, "plain files": _plain_files, "plain mixed": _plain_mixed,
}  # fmt: skip


def _packed(files: dict[str, bytes], form: str, dice: random.Random) -> dict[str, bytes]:
    around = {"exchange": "inbound", "classroom50": "cs-toy_submissions_2026_11_20_T_18_30_00"}
    around["gradescope"] = "assignment_5_export"
    wrap = dice.random()
    if wrap < 0.3:
        top = around.get(form, "all of them")
        return {f"{top}/{name}": content for name, content in files.items()}
    if wrap < 0.4 and len(files) > 1:
        return {"download.zip": zipped(files)}
    return files


def lay_out(files: dict[str, bytes], place: Path, packed: bool) -> Path:
    """Write a class as a folder or as a zip, and return its place."""
    if packed:
        (place / "in.zip").write_bytes(zipped(files))
        return place / "in.zip"
    for name, content in files.items():
        (place / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        (place / "in" / name).write_bytes(content)
    return place / "in"


def called(student: Student, form: str) -> set[str]:
    """Return the names that a student may have, by what the platform wrote."""
    name = student.name
    if form in ("canvas",):
        name = name.replace(" ", "").lower()
        # Canvas' numbers are the first in a name: where the student's own ends with a number, that is read as one.
        bare = {name, name.removesuffix("_late"), name.removesuffix("_1"), name.removesuffix("_1_1")}
        return {
            file_name(one)
            for bare_name in bare
            for one in (bare_name, f"{bare_name}_{student.number}", f"{bare_name}_1")
        }
    if form in ("blackboard", "classroom50"):
        name = name.replace(" ", "")
    if form == "classroom50":  # where there is one repository, nothing says where the student's name begins in its own
        return {file_name(one) for one in (name, f"toy-{name}")}
    return {file_name(one) for one in (name, f"{name}_{student.number}", f"{name}_s{student.number}@x.edu")}


def wrongs(made: Built, collected: Collected) -> list[str]:
    """Return who was lost, swapped or replaced, as sentences."""
    found = []
    told = "\n".join([*collected.refused, *collected.notes])
    texts = {name: path.read_text(encoding="utf-8") for name, path in collected.notebooks.items()}
    by_work = {student.work: student for student in made.students}
    for name, text in texts.items():
        owner = by_work.get(text)
        if owner is None:
            found.append(f"{name} has {text!r}, which is nobody's work that counts")
        elif name not in called(owner, made.form):
            found.append(f"{name} has {text!r}")
    for student in made.students:
        if student.work not in texts.values() and not any(
            name in told for name in (*called(student, made.form), "LEFT")
        ):
            found.append(f"{student.name} is lost without a word")
    return found


def tried(seed: int) -> tuple[Built, str, list[str]]:
    """Take in the class of a seed; return it, what became of it, and who was lost, swapped or replaced."""
    made = built(seed)
    place = Path(tempfile.mkdtemp(prefix="class-form-"))
    try:
        source = lay_out(made.files, place, random.Random(seed).random() < 0.5)
        try:
            collected = collect(source, LAB, place / "course")
        except KitError as error:
            return (
                made,
                f"stopped: {error.what}",
                [] if (place / "course").exists() is False else ["something is written"],
            )
        return made, "left out" if collected.refused else "whole", wrongs(made, collected)
    finally:
        shutil.rmtree(place)


def main() -> int:
    """Try as many classes as the first argument says; return 1 if anybody was lost, swapped or replaced."""
    number, first = (*(int(word) for word in sys.argv[1:] if word.isdigit()), 300, 0)[:2]
    first = first if len(sys.argv) > 2 else 0
    became: Counter[str] = Counter()
    bad = 0
    for seed in range(first, first + number):
        made, what, wrong = tried(seed)
        became[f"{'hostile' if made.hostile else 'honest'}, {what.split(':')[0]}"] += 1
        bad += bool(wrong)
        for sentence in wrong:
            print(f"{seed} ({made.form}): {sentence}")
        if not made.hostile and what != "whole" and "-v" in sys.argv:
            print(f"{seed} ({made.form}): {what}")
    print(f"{number} classes, in {bad} somebody lost, swapped or replaced; {dict(became)}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
