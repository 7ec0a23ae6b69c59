"""Classes as learning platforms give them out: every file is made in the form that the platform documents."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest
import toy

from autograder.core.errors import KitError
from autograder.intake.collect import Collected, collect
from autograder.submission import timestamp

ROSTER = """id,name,email,section,canvas_id,moodle_id,github
jd01,"Doe, Jane",jane.doe@example.edu,A,12345,501,janedoe
mm02,Jürgen Müller,j.mueller@example.edu,B,12346,502,jmueller
no03,Nora O'Brien,nora@example.edu,B,12347,503,nora-ob
"""
GRADESCOPE = """submission_101:
  :submitters:
  - :name: Jane Doe
    :sid: jd01
    :email: jane.doe@example.edu
  :created_at: 2026-11-20 18:30:00.000000000 -08:00
  :score: 0.0
submission_102:
  :submitters:
  - :name: Jane Doe
    :sid: jd01
    :email: jane.doe@example.edu
  :created_at: 2026-11-20 19:30:00.000000000 -08:00
submission_103:
  :submitters:
  - :name: Jürgen Müller
    :email: j.mueller@example.edu
  :created_at: 2026-11-19 08:00:00.000000000 -08:00
"""
PLATFORMS: dict[str, tuple[str, dict[str, str], dict[str, str], dict[str, str]]] = {
    # name: (what it is called, files, notebooks without a roster, notebooks with one)
    "canvas": (
        "Canvas",
        {
            "doejane_12345_678901_toy.ipynb": "first",
            "doejane_LATE_12345_678950_toy-1.ipynb": "second",
            "mullerjurgen_12346_678902_My notebook.ipynb": "jm",
            "obriennora_12347_678903_photo.png": "a picture",
        },
        {"doejane": "second", "mullerjurgen": "jm"},
        {"jd01": "second", "mm02": "jm"},
    ),
    "moodle": (
        "Moodle",
        {
            "Jane Doe_501_assignsubmission_file_/toy.ipynb": "jd",
            "Jane Doe_501_assignsubmission_onlinetext_/onlinetext.html": "<p>Here it is</p>",
            "Jürgen Müller_502_assignsubmission_file/solution.ipynb": "jm",
            "Nora O'Brien_503_assignsubmission_onlinetext/onlinetext.html": "<p>I forgot the file</p>",
        },
        {"Jane Doe": "jd", "Jürgen Müller": "jm"},
        {"jd01": "jd", "mm02": "jm"},
    ),
    "blackboard": (
        "Blackboard",
        {
            "Lab 2_jd01_attempt_2026-11-19-10-00-00_toy.ipynb": "first",
            "Lab 2_jd01_attempt_2026-11-20-18-30-00_toy.ipynb": "second",
            "Lab 2_jd01_attempt_2026-11-20-18-30-00.txt": "Name: Jane Doe (jd01)",
            "Lab 2_mm02_attempt_2026-11-18-08-00-00_toy.ipynb": "jm",
        },
        {"jd01": "second", "mm02": "jm"},
        {"jd01": "second", "mm02": "jm"},
    ),
    "gradescope": (
        "Gradescope",
        {
            "assignment_55_export/submission_metadata.yml": GRADESCOPE,
            "assignment_55_export/submission_101/toy.ipynb": "first",
            "assignment_55_export/submission_102/toy.ipynb": "second",
            "assignment_55_export/submission_103/toy.ipynb": "jm",
        },
        {"jd01": "second", "Jürgen Müller": "jm"},
        {"jd01": "second", "mm02": "jm"},
    ),
    "classroom": (
        "GitHub Classroom",
        {
            "toy-submissions/toy-janedoe/labs/toy/toy.ipynb": "jd",
            "toy-submissions/toy-janedoe/README.md": "# Toy",
            "toy-submissions/toy-nora-ob/labs/toy/toy.ipynb": "no",
        },
        {"janedoe": "jd", "nora-ob": "no"},
        {"jd01": "jd", "no03": "no"},
    ),
    "exchange": (
        "nbgrader's exchange",
        {
            "inbound/jd01+toy+2026-11-19 10:00:00.000000 UTC+a1/toy.ipynb": "first",
            "inbound/jd01+toy+2026-11-20 10:00:00.000000 UTC+b2/toy.ipynb": "second",
            "inbound/jd01+toy+2026-11-20 10:00:00.000000 UTC+b2/submission_secret.txt": "b2b2",
            "inbound/mm02+toy+2026-11-18 10:00:00.000000 UTC/toy.ipynb": "jm",
            "inbound/mm02+other+2026-11-18 10:00:00.000000 UTC+c3/other.ipynb": "another lab",
        },
        {"jd01": "second", "mm02": "jm"},
        {"jd01": "second", "mm02": "jm"},
    ),
    "submitted": (
        "nbgrader's folder submitted",
        {
            "course/submitted/jd01/toy/toy.ipynb": "jd",
            "course/submitted/jd01/toy/timestamp.txt": "2026-11-20 18:30:00 UTC",
            "course/submitted/mm02/toy/toy.ipynb": "jm",
            "course/source/toy/toy.ipynb": "the lab",
            "roster of 2026.csv": "id",
        },
        {"jd01": "jd", "mm02": "jm"},
        {"jd01": "jd", "mm02": "jm"},
    ),
    "flat": (
        "a folder of files",
        {"jd01.ipynb": "jd", "toy_mm02.ipynb": "jm"},
        {"jd01": "jd", "mm02": "jm"},
        {"jd01": "jd", "mm02": "jm"},
    ),
}


def lay_out(files: Mapping[str, str | bytes], place: Path, zipped: bool) -> Path:
    """The files as a folder or as a zip."""
    if zipped:
        with zipfile.ZipFile(place / "in.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, text in files.items():
                archive.writestr(name, text)
        return place / "in.zip"
    for name, text in files.items():
        (place / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        (place / "in" / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return place / "in"


def texts(collected: Collected) -> dict[str, str]:
    return {student: path.read_text() for student, path in collected.notebooks.items()}


@pytest.mark.parametrize("with_roster", [False, True], ids=["as given", "roster"])
@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize("name", PLATFORMS)
def test_a_platforms_export_is_recognised(tmp_path: Path, name: str, zipped: bool, with_roster: bool) -> None:
    called, files, as_given, by_roster = PLATFORMS[name]
    course = tmp_path / "course"
    course.mkdir()
    if with_roster:
        (course / "roster.csv").write_text(ROSTER, encoding="utf-8")
    collected = collect(lay_out(files, tmp_path, zipped), toy.LAB, course)
    assert collected.format == called
    assert texts(collected) == (by_roster if with_roster else as_given)


def test_what_was_replaced_late_or_no_notebook_is_said(tmp_path: Path) -> None:
    collected = collect(lay_out(PLATFORMS["canvas"][1], tmp_path, True), toy.LAB, tmp_path / "course")
    notes = "\n".join(collected.notes)
    assert "'doejane_LATE_12345_678950_toy-1.ipynb' replaces 'doejane_12345_678901_toy.ipynb'" in notes
    assert "doejane: Canvas has marked it as late" in notes
    assert len(collected.refused) == 1 and "photo.png" in collected.refused[0]


def test_when_it_was_handed_in_is_kept(tmp_path: Path) -> None:
    for name, moment in (("gradescope", "2026-11-20 19:30:00-08:00"), ("blackboard", "2026-11-20 18:30:00")):
        place = tmp_path / name
        place.mkdir()
        collected = collect(lay_out(PLATFORMS[name][1], place, False), toy.LAB, place / "course")
        stamp = collected.notebooks["jd01"].with_name(timestamp.FILE_NAME)
        assert stamp.read_text() == moment


def test_by_what_the_exchange_knows_feedback_is_kept_as_long_as_a_submission_is_from_there(tmp_path: Path) -> None:
    for name, secret in (("exchange", "b2b2"), ("submitted", "")):
        (tmp_path / name).mkdir()
        collected = collect(lay_out(PLATFORMS[name][1], tmp_path / name, True), toy.LAB, tmp_path / "course")
        file = collected.notebooks["jd01"].with_name("submission_secret.txt")
        assert (file.read_text() if file.is_file() else "") == secret


def test_who_is_not_in_the_roster_is_left_out_and_named(tmp_path: Path) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_text(ROSTER.replace("jd01", "jd99").replace("12345", "99999").replace("Doe", "Dough"))
    collected = collect(lay_out(PLATFORMS["canvas"][1], tmp_path, False), toy.LAB, course)
    assert texts(collected) == {"mm02": "jm"}
    assert any("doejane" in sentence and "roster" in sentence for sentence in collected.refused)


def test_two_students_of_one_name_stay_two(tmp_path: Path) -> None:
    files = {"doejane_1_11_toy.ipynb": "one", "doejane_2_12_toy.ipynb": "other"}
    collected = collect(lay_out(files, tmp_path, True), toy.LAB, tmp_path / "course")
    assert texts(collected) == {"doejane_1": "one", "doejane_2": "other"}


def zip_of(text: str, name: str = "toy.ipynb") -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr(name, text)
    return content.getvalue()


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize(
    ("names", "called"),
    [
        (("jd01.zip", "mm02.zip"), ""),
        (("doejane_12345_678901_toy.zip", "mullerjurgen_12346_678902_work.zip"), "Canvas"),
        (("Lab 2_jd01_attempt_2026-11-19-10-00-00_toy.zip", "Lab 2_mm02_attempt_2026-11-18-08-00-00_a.zip"),
         "Blackboard"),
    ],
    ids=["students", "canvas", "blackboard"],
)  # fmt: skip
def test_zips_with_a_notebook_each_are_a_class(
    tmp_path: Path, names: tuple[str, str], called: str, zipped: bool
) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_text(ROSTER, encoding="utf-8")
    files = {name: zip_of(text) for name, text in zip(names, ("jd", "mm"), strict=True)}
    collected = collect(lay_out(files, tmp_path, zipped), toy.LAB, course)
    assert texts(collected) == {"jd01": "jd", "mm02": "mm"}
    assert (collected.format, collected.refused) == (called, [])


def test_a_name_that_leaves_nothing_of_the_student_is_refused_and_stops_nobody_else(tmp_path: Path) -> None:
    collected = collect(lay_out({"toy_.ipynb": "?", "toy_ann.ipynb": "ann"}, tmp_path, False), toy.LAB, tmp_path / "c")
    assert texts(collected) == {"ann": "ann"}
    assert "'' cannot be a student's name" in collected.refused[0]


def test_two_folders_of_one_student_in_the_roster_do_not_replace_each_other_unsaid(tmp_path: Path) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_text(ROSTER + ",,,,,,\n", encoding="utf-8")  # as spreadsheets write an empty line
    files = {"janedoe/toy.ipynb": "by GitHub", "jd01/toy.ipynb": "by number"}
    collected = collect(lay_out(files, tmp_path, False), toy.LAB, course)
    assert texts(collected) == {"jd01": "by GitHub"}
    assert "'janedoe' and 'jd01' mean the same student; the second was left out" in collected.refused[0]


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
def test_nobody_gets_a_zero_for_what_was_not_understood(tmp_path: Path, zipped: bool) -> None:
    files = {
        "ann/toy.ipynb": "ann",
        "bob/one.ipynb": "1",
        "bob/two.ipynb": "2",
        "cem/report.pdf": "pdf",
        "eve/TOY.IPYNB": "eve",
        "eve/old.ipynb": "old",
    }
    collected = collect(lay_out(files, tmp_path, zipped), toy.LAB, tmp_path / "course")
    assert texts(collected) == {"ann": "ann", "eve": "eve"}
    told = "\n".join(collected.refused)
    assert "holds 2 notebooks" in told and "'report.pdf' and no notebook" in told and len(collected.refused) == 2


@pytest.mark.parametrize("text, words", [("name\nJane", "has no `id`"), ("id\na\na\n", "twice"), ("\xff", "UTF-8")])
def test_a_roster_that_is_none_is_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(KitError) as caught:
        collect(lay_out(PLATFORMS["flat"][1], tmp_path, False), toy.LAB, course)
    assert words in str(caught.value)


def test_grade_says_what_was_left_out_by_its_exit_status(tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    notebook = course / "labs" / toy.LAB / f"{toy.LAB}.ipynb"
    text = (
        notebook.read_text() if notebook.exists() else (course / "solutions" / toy.LAB / f"{toy.LAB}.ipynb").read_text()
    )
    source = lay_out({"doejane_1_11_toy.ipynb": text, "roe_2_12_notes.txt": "sorry"}, tmp_path, True)
    done = subprocess.run(
        [str(Path(sys.executable).with_name("autograder")), "grade", toy.LAB, str(source)],
        cwd=course, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert "notes.txt" in done.stdout and "doejane" in done.stdout
