"""Classes as learning platforms give them out: every file is made in the form that the platform documents."""

from __future__ import annotations

import contextlib
import io
import sqlite3
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest
import toy

from autograder.core.errors import KitError
from autograder.intake.collect import Collected
from autograder.intake.collect import collect as taken_in
from autograder.intake.options import Accepted
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
    "classroom50": (
        "Classroom 50",
        {
            "cs-toy_submissions_2026_11_20_T_18_30_00/cs-toy-janedoe/labs/toy/toy.ipynb": "jd",
            "cs-toy_submissions_2026_11_20_T_18_30_00/cs-toy-janedoe/README.md": "# Toy",
            "cs-toy_submissions_2026_11_20_T_18_30_00/cs-toy-janedoe/result.json": "{}",
            "cs-toy_submissions_2026_11_20_T_18_30_00/scores.csv": "username,score",
            "cs-toy_submissions_2026_11_20_T_18_30_00/cs-toy-nora-ob/labs/toy/toy.ipynb": "no",
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


def collect(source: Path, lab: str, course: Path, format_name: str = "") -> Collected:
    """Take in a class of which somebody has said that whoever is missing, strange or there twice may be so."""
    return taken_in(source, lab, course, format_name, tuple(Accepted))


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


def test_the_roster_of_classroom_50_names_its_students_by_their_github_names(tmp_path: Path) -> None:
    course = tmp_path / "course"
    course.mkdir()
    heading = "username,first_name,last_name,email,section,github_id,role"
    lines = [
        "janedoe,Jane,Doe,jane.doe@example.edu,A,4711,student",
        "Nora-OB,Nora,O'Brien,,,4712,",
        "prof,P,Rof,,,1,ta",
    ]
    (course / "roster.csv").write_text("\n".join([heading, *lines]), encoding="utf-8")
    files = PLATFORMS["classroom50"][1]
    collected = taken_in(lay_out(files, tmp_path, True), toy.LAB, course)  # the assistant is not missed
    assert texts(collected) == {"janedoe": "jd", "Nora-OB": "no"} and not collected.refused


def test_what_was_replaced_late_or_no_notebook_is_said(tmp_path: Path) -> None:
    collected = collect(lay_out(PLATFORMS["canvas"][1], tmp_path, True), toy.LAB, tmp_path / "course")
    notes = "\n".join(collected.notes)
    assert "'doejane_LATE_12345_678950_toy-1.ipynb' replaces 'doejane_12345_678901_toy.ipynb'" in notes
    assert "doejane: Canvas has marked it as late. Its download has no time, so no points are taken for that." in notes
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
        collected = collect(lay_out(PLATFORMS[name][1], tmp_path / name, True), toy.LAB, tmp_path / "course", name)
        file = collected.notebooks["jd01"].with_name("submission_secret.txt")
        assert (file.read_text() if file.is_file() else "") == secret


def test_who_is_not_in_the_roster_is_left_out_and_named(tmp_path: Path) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_text(ROSTER.replace("jd01", "jd99").replace("12345", "99999").replace("Doe", "Dough"))
    collected = collect(lay_out(PLATFORMS["canvas"][1], tmp_path, False), toy.LAB, course)
    assert texts(collected) == {"mm02": "jm"}
    assert any("doejane" in sentence and "roster" in sentence for sentence in collected.refused)


@pytest.mark.parametrize(
    "uploads",
    [("doe_1_9_toy.ipynb", "doe_1_10_toy.ipynb"), ("doe_1_900_toy.ipynb", "doe_1_1000_toy-1.ipynb")],
    ids=["of one name", "of another name"],
)
def test_of_a_students_uploads_in_canvas_the_one_with_the_greatest_number_counts(
    uploads: tuple[str, str], tmp_path: Path
) -> None:
    files = {uploads[0]: "first", uploads[1]: "second", "roe_2_11_toy.ipynb": "jr"}
    collected = collect(lay_out(files, tmp_path, False), toy.LAB, tmp_path / "course")
    assert texts(collected) == {"doe": "second", "roe": "jr"}
    assert f"{uploads[0]!r} of 'doe' (a later file counts)" in collected.line


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
    assert "without a student's name was left out" in collected.refused[0]


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
def test_every_name_is_taken_and_two_names_stay_two(tmp_path: Path, zipped: bool) -> None:
    names = ["Robert Downey Jr.", "'Amr", "Jane & Bob", "Jane ; Bob", "\N{GRINNING FACE}"]
    collected = collect(lay_out({f"{name}/toy.ipynb": name for name in names}, tmp_path, zipped), toy.LAB, tmp_path)
    assert sorted(texts(collected).values()) == sorted(names) and not collected.refused
    assert "'Amr" in collected.notebooks and len(collected.notes) == len(names) - 1


WRAPPED = {
    "a folder around all": {"all/ann/toy.ipynb": "a", "all/bob/toy.ipynb": "b", "readme.txt": ""},
    "two folders around all": {"2026/all/ann/toy.ipynb": "a", "2026/all/bob/toy.ipynb": "b", "readme.txt": ""},
    "folders inside": {"ann/lab/toy.ipynb": "a", "bob/toy.ipynb": "b", "readme.txt": ""},
    "files and folders": {"toy_ann.ipynb": "a", "bob/toy.ipynb": "b", "readme.txt": ""},
    "the kit's own folders": {
        "ann/ros2-labs/labs/toy/toy.ipynb": "a",
        "bob/ros2-labs/labs/toy/toy.ipynb": "b",
        "readme.txt": "",
    },
}


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize("files", WRAPPED.values(), ids=WRAPPED)
def test_folders_around_a_class_or_a_notebook_do_no_harm(tmp_path: Path, files: dict[str, str], zipped: bool) -> None:
    collected = collect(lay_out(files, tmp_path, zipped), toy.LAB, tmp_path / "course")
    assert texts(collected) == {"ann": "a", "bob": "b"}
    assert len(collected.refused) == 1 and "'readme.txt'" in collected.refused[0]


def zip_with(files: Mapping[str, str | bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return content.getvalue()


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
def test_a_students_zip_in_the_zip_of_a_class_that_lies_in_a_folder_is_read(tmp_path: Path, zipped: bool) -> None:
    upload = zip_with({"labs/toy/toy.ipynb": "jm", "submitted/eve/toy/toy.ipynb": "not a class"})
    inner = {"Jane Doe_501_assignsubmission_file_/toy.ipynb": "jd", "Jo_502_assignsubmission_file_/all.zip": upload}
    collected = collect(lay_out({"download.zip": zip_with(inner)}, tmp_path, zipped), toy.LAB, tmp_path / "course")
    assert (collected.format, texts(collected)["Jane Doe"]) == ("Moodle", "jd")
    assert collected.notebooks.keys() == {"Jane Doe", "Jo"}


def test_a_zip_of_zips_in_a_folder_is_a_class(tmp_path: Path) -> None:
    inner = {"ann.zip": zip_of("a"), "bob.zip": zip_of("b")}
    collected = collect(lay_out({"all.zip": zip_with(inner)}, tmp_path, False), toy.LAB, tmp_path / "course")
    assert texts(collected) == {"ann": "a", "bob": "b"} and not collected.refused


INCOMPLETE: dict[str, tuple[dict[str, str], dict[str, str], list[str]]] = {
    # name: (files, notebooks, what is said about what was left out)
    "Moodle's files without folders": (
        {"Jane Doe_501_assignsubmission_file_toy.ipynb": "jd", "Jo_502_assignsubmission_file_mine.ipynb": "jo",
         "Jo_502_assignsubmission_onlinetext.html": "", "Cem_503_assignsubmission_file_a.pdf": ""},
        {"Jane Doe": "jd", "Jo": "jo"}, ["'Cem' holds 'Cem_503_assignsubmission_file_a.pdf' and no notebook"],
    ),
    "two notebooks of other names": (
        {"Jane_501_assignsubmission_file_/a.ipynb": "", "Jane_501_assignsubmission_file_/b.ipynb": "",
         "Jo_502_assignsubmission_file_/toy (1).ipynb": "jo", "Jo_502_assignsubmission_file_/old.ipynb": "old"},
        {"Jo": "jo"}, ["'Jane' holds 2 notebooks, of which none is called toy.ipynb"],
    ),
    "a second file in Canvas": (
        {"doe_1_10_toy.ipynb": "jd", "doe_1_11_scratch.ipynb": "no", "roe_2_12_toy.ipynb": "jr"},
        {"doe": "jd", "roe": "jr"}, [],
    ),
    "a user name with a line in Blackboard": (
        {"Lab_2_a_doe_attempt_2026-11-19-10-00-00_toy.ipynb": "ad", "Lab_2_bob_attempt_2026-11-19-10-00-00.txt": "",
         "Lab_2_b_doe_attempt_2026-11-19-10-00-00_toy.ipynb": "bd"},
        {"a_doe": "ad", "b_doe": "bd"}, ["'bob' holds 'Lab_2_bob_attempt_2026-11-19-10-00-00.txt' and no notebook"],
    ),
    "a group in Gradescope": (
        {"submission_metadata.yml": """submission_1:
  :submitters: [{":name": Ann}, {":name": Bob}]
submission_2:
  :submitters: [{":name": Cem}]
""", "submission_1/toy.ipynb": "ab", "submission_2/a.pdf": "", "submission_3/toy.ipynb": "?"},
        {"Ann": "ab", "Bob": "ab"}, ["'Cem' holds 'a.pdf' and no notebook", "to whom submission_3 belongs"],
    ),
    "repositories without a notebook": (
        {"toy-ann/labs/toy/toy.ipynb": "a", "toy-bob/labs/toy/toy.ipynb": "b", "toy-cem/README.md": "",
         "toy-dan/labs/toy/mine.ipynb": "d"},
        {"ann": "a", "bob": "b", "dan": "d"}, ["'cem' holds 'README.md' and no notebook"],
    ),
    "nbgrader's folders": (
        {"submitted/ann/toy/toy.ipynb": "a", "submitted/bob/toy/mine.ipynb": "b", "submitted/cem/toy/a.pdf": "",
         "submitted/dan/other/other.ipynb": ""},
        {"ann": "a", "bob": "b"}, ["'cem' holds 'a.pdf' and no notebook"],
    ),
    "files": (
        {"ann.ipynb": "a", "bob.pdf": "", "toy.ipynb": "", "roster.csv": "id"},
        {"ann": "a"}, ["'bob.pdf' is not a student's", "It is not clear to whom 'toy.ipynb' belongs"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("files, taken, said", INCOMPLETE.values(), ids=INCOMPLETE)
def test_whatever_has_no_notebook_is_named(
    tmp_path: Path, files: dict[str, str], taken: dict[str, str], said: list[str]
) -> None:
    collected = collect(lay_out(files, tmp_path, True), toy.LAB, tmp_path / "course")
    assert texts(collected) == taken and len(collected.refused) == len(said)
    for words in said:
        assert any(words in sentence for sentence in collected.refused)


@pytest.mark.parametrize("zipped", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize(
    "name", ["jd01/toy.ipynb", "jd01/toy/toy.ipynb", "jd01.ipynb", "doejane_12345_678901_toy.ipynb"]
)
def test_an_empty_file_is_no_zero(tmp_path: Path, name: str, zipped: bool) -> None:
    (tmp_path / "roster.csv").write_text(ROSTER, encoding="utf-8")
    other = name.replace("jd01", "mm02").replace("doejane_12345", "mullerjurgen_12346")
    collected = collect(lay_out({name: "", other: "jm"}, tmp_path, zipped), toy.LAB, tmp_path)
    assert texts(collected) == {"mm02": "jm"}
    assert len(collected.refused) == 1 and "empty file" in collected.refused[0]


AS_EXCEL = ROSTER.replace('"Doe, Jane"', "Jane Doe")


@pytest.mark.parametrize(
    "content",
    [
        AS_EXCEL.encode("utf-8-sig"),
        AS_EXCEL.replace(",", ";").encode("cp1252"),
        AS_EXCEL.replace(",", "\t").replace("\n", "\r\n").encode("utf-16"),
        b"\n" + AS_EXCEL.encode(),
    ],
    ids=["mark", "semicolons", "tabs", "empty line"],
)
def test_a_roster_is_read_as_spreadsheets_write_it(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "roster.csv").write_bytes(content)
    names = {"Jane Doe/toy.ipynb": "jd", "Jürgen Müller/toy.ipynb": "jm"}
    collected = collect(lay_out(names, tmp_path, True), toy.LAB, tmp_path)
    assert texts(collected) == {"jd01": "jd", "mm02": "jm"} and not collected.notes


def test_an_id_means_its_student_whatever_others_are_called(tmp_path: Path) -> None:
    roster = "id,name,section,github\njane,Jane Roe,x,jroe\njd01,Jane Doe,bob,jane\nmm-2,Jo,x,jo-an\n"
    (tmp_path / "roster.csv").write_text(roster)
    names = {f"{name}/toy.ipynb": name for name in ("jane", "bob", "garcia")}
    collected = collect(lay_out(names, tmp_path, True), toy.LAB, tmp_path)
    assert collected.notebooks.keys() == {"jane", "bob", "garcia"} and len(collected.notes) == 2
    (tmp_path / "repositories").mkdir()
    files = {"toy-jo-an/labs/toy/toy.ipynb": "jo", "toy-jo-b/labs/toy/toy.ipynb": "?"}
    collected = collect(lay_out(files, tmp_path / "repositories", True), toy.LAB, tmp_path)
    assert texts(collected) == {"mm-2": "jo"} and len(collected.refused) == 1


def test_numbers_that_a_spreadsheet_gave_a_decimal_point_are_the_platforms_numbers(tmp_path: Path) -> None:
    (tmp_path / "roster.csv").write_text("id,name,canvas_id\njd01,,12345.0\nmm02,,\nno03,,12347.0\n")
    collected = collect(lay_out({"doejane_12345_678901_toy.ipynb": "jd"}, tmp_path, True), toy.LAB, tmp_path)
    assert texts(collected) == {"jd01": "jd"}


def test_canvas_names_are_found_with_and_without_accents(tmp_path: Path) -> None:
    (tmp_path / "roster.csv").write_text("id,name\nmg,María José García\nbm,Bob Müller\n", encoding="utf-8")
    files = {"garciamariajose_1_2_toy.ipynb": "mg", "müllerbob_3_4_toy.ipynb": "bm"}
    assert texts(collect(lay_out(files, tmp_path, False), toy.LAB, tmp_path)) == {"mg": "mg", "bm": "bm"}


def test_two_folders_of_one_student_in_the_roster_do_not_replace_each_other_unsaid(tmp_path: Path) -> None:
    course = tmp_path / "course"
    course.mkdir()
    (course / "roster.csv").write_text(ROSTER + ",,,,,,\n", encoding="utf-8")  # as spreadsheets write an empty line
    files = {"janedoe/toy.ipynb": "by GitHub", "jd01/toy.ipynb": "by number"}
    collected = collect(lay_out(files, tmp_path, False), toy.LAB, course)
    assert texts(collected) == {"jd01": "by GitHub"}
    assert "'janedoe' and 'jd01' belong to the same student; the second was left out" in collected.refused[0]


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


@pytest.mark.parametrize(
    "text, words",
    [
        ("name\nJane", "no column `id`; its first line is 'name'"),
        ("id\na\na\n", "twice"),
        ("\x81", "UTF-8"),
        ("id,name\n", "nobody"),
        ("id,a\n,b\n", "Line 2"),
    ],
)
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


def test_a_gradebook_that_another_program_holds_is_a_sentence(tmp_path: Path) -> None:
    course = toy.make_course(tmp_path / "course")
    (course / "gradebook").mkdir()
    source = toy.hand_in(tmp_path / "class", "ann", toy.CELLS).parent.parent
    with contextlib.closing(sqlite3.connect(course / "gradebook" / "gradebook.db", isolation_level=None)) as other:
        # Others may read, or not even that.
        for lock, arguments in (("IMMEDIATE", ["grade", toy.LAB, str(source)]), ("EXCLUSIVE", ["export", "csv"])):
            other.execute(f"BEGIN {lock}")
            done = subprocess.run(
                [str(Path(sys.executable).with_name("autograder")), *arguments],
                cwd=course, capture_output=True, text=True, check=False,
            )  # fmt: skip
            other.execute("ROLLBACK")
            assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
            assert "database is locked" in done.stderr and "no other program uses the gradebook" in done.stderr
