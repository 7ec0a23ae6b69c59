"""What goes back from a graded class: every table, page and zip shows the gradebook's number, for the right student."""

from __future__ import annotations

import csv
import dataclasses
import datetime
import io
import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import toy
from conftest import BROWSER_SECONDS
from junitparser import JUnitXml
from places import ROOT

from autograder.core.grades import CellGrade, Grade
from autograder.core.results import CheckResult, Isolation, Outcome, Part, Ranked, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.gradebook.class_run import ClassRun, Intake, grade_class
from autograder.gradebook.grades import class_entries, read_grades
from autograder.gradebook.own_courses import prepare_nbgrader
from autograder.gradebook.settings import gradebook_address, gradebook_file
from autograder.grading.executors import local
from autograder.grading.runner import Settings
from autograder.grading.trusted_result import validated
from autograder.intake.options import Accepted
from autograder.intake.roster import read_roster
from autograder.intake.which_format import read_class
from autograder.report.class_page import write_class_page
from autograder.report.export import FORMATS
from autograder.report.export.entry import Entry
from autograder.report.feedback_page import Heading, Task, feedback_html
from autograder.report.term_page import Appeal, write_term_page

ROSTER = """id,name,email,section,canvas_id,moodle_id
ann,"=Doe, Ann",ann@example.edu,A,12345,501
bob,Bob Müller,bob@example.edu,B,12346,502
cem,Cem,cem@example.edu,B,12347,503
"""
FILES = {
    "ann": "doeann_12345_678901_toy.ipynb",
    "bob": "mullerbob_LATE_12346_678902_toy-2.ipynb",
    "cem": "cem_12347_678903_toy.ipynb",
}
SCORES = {"ann": 9.5, "bob": 2.5, "cem": None}
"""Ann: 5 by checks, 4 and half a point of extra credit by hand. Bob: 2 by a check, 1.5 by hand, 1 for being late."""


@dataclass
class Graded:
    """The class and where it lies."""

    root: Path
    source: Path
    run: ClassRun
    pages: dict[str, str] = field(default_factory=dict)
    """Feedback, by student."""

    def export(self, form: str, column: str = "") -> Any:
        return FORMATS[form](class_entries(self.root, toy.LAB), column)


def answers(root: Path, talker: str, why: str = "Because of that.") -> str:
    sources = {"talker": f"%%node talker\n{talker}", "answers": "%%file answers.yaml\nanswer: 42", "why": why}
    return json.dumps(load_lab(root, toy.LAB).clean_notebook(sources))


def grade(root: Path, source: Path) -> ClassRun:
    return grade_class(root, toy.LAB, source, Settings(isolation=Isolation.NONE), Intake(accepted=tuple(Accepted)))


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graded]:
    """A class of three from Canvas, checked, then graded by hand."""
    patch = pytest.MonkeyPatch()
    patch.setattr(local, "run_in_worker", lambda job, *_: validated(toy.judge(job), job.checks))
    root = toy.make_course(tmp_path_factory.mktemp("handed_back") / "course")
    (root / "roster.csv").write_text(ROSTER, encoding="utf-8")
    source = root.parent / "submissions"
    source.mkdir()
    for student, talker in (("ann", "print('hello')"), ("bob", "print('no')"), ("cem", "die")):
        (source / FILES[student]).write_text(answers(root, talker), encoding="utf-8")
    grade(root, source)
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    with Gradebook(gradebook_address(root)) as gradebook:
        for student, points, more in (("ann", 4, 0.5), ("bob", 1.5, None)):
            mark = gradebook.find_grade("why", toy.LAB, toy.LAB, student)
            mark.manual_score, mark.extra_credit, mark.needs_manual_grade = points, more, False
            gradebook.find_comment("why", toy.LAB, toy.LAB, student).manual_comment = f"Well said, {student}."
        gradebook.find_submission_notebook(toy.LAB, toy.LAB, "bob").late_submission_penalty = 1
        gradebook.db.commit()
    file = gradebook_file(root)
    assert file is not None
    os.utime(file)
    run = grade(root, source)
    pages = {
        student: (root / "build" / "feedback" / student / toy.LAB / f"{toy.LAB}.html").read_text(encoding="utf-8")
        for student in FILES
    }
    yield Graded(root, source, run, pages)
    patch.undo()


def rows(text: str | bytes) -> list[dict[str, str]]:
    assert isinstance(text, str)
    return list(csv.DictReader(io.StringIO(text)))


def unpacked(content: str | bytes) -> dict[str, str]:
    assert isinstance(content, bytes)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name).decode() for name in archive.namelist()}


def nbgraders_own_export(root: Path, folder: Path) -> dict[str, float]:
    shutil.copy(ROOT / "nbgrader_config.py", root)
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", "export", "--to", str(folder / "all.csv")],
        cwd=root, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    (root / "nbgrader_config.py").unlink()
    assert done.returncode == 0, done.stderr
    return {row["student_id"]: float(row["score"]) for row in rows((folder / "all.csv").read_text())}


def test_one_number_stands_in_gradebook_table_and_results(graded: Graded) -> None:
    assert {one.student: one.score for one in read_grades(graded.root)} == SCORES
    table = {row["student"]: row for row in rows(graded.run.grades.read_text())}
    assert {name: row["score"] for name, row in table.items()} == {"ann": "9.5", "bob": "2.5", "cem": ""}
    assert {name: row["waiting"] for name, row in table.items()} == {"ann": "0", "bob": "0", "cem": "2"}
    added: dict[str, float] = {}
    for row in rows(graded.export("csv").content):
        added[row["student"]] = added.get(row["student"], 0.0) + float(row["points"] or 0)
    assert added == {"ann": 9.5, "bob": 2.5, "cem": 2.0}


def test_canvas_finds_every_student_and_score(graded: Graded) -> None:
    """As its importer reads: the first two headings, the row of points possible, a student by number."""
    made = graded.export("canvas", "Toy lab (4711)")
    head, possible, *students = list(csv.reader(io.StringIO(made.content)))
    assert "Student" in head[0] and "ID" in head[1] and head[4] == "Section" and head[5] == "Toy lab (4711)"
    assert head[2:4] == ["SIS User ID", "SIS Login ID"]
    assert "Points Possible" in possible[0] and possible[5] == "9"
    roster = read_roster(graded.root / "roster.csv")
    found = {roster.student({"canvas_id": row[1]}): row[5] for row in students}
    assert found == {"ann": "9.5", "bob": "2.5"}
    assert [sentence.split()[0] for sentence in made.left_out] == ["cem"]
    assert students[0][0] == "'=Doe, Ann", "a name is no formula"


def test_moodle_finds_every_student_and_score(graded: Graded) -> None:
    """As its importer reads: the number after `Participant`, and three columns that it cannot do without."""
    made = rows(graded.export("moodle").content)
    assert {"Identifier", "Grade", "Last modified (grade)"} <= made[0].keys()
    roster = read_roster(graded.root / "roster.csv")
    found = {roster.student({"moodle_id": row["Identifier"][len("Participant ") :]}): row["Grade"] for row in made}
    assert found == {"ann": "9.5", "bob": "2.5"}
    assert made[0]["Feedback comments"] == "Well said, ann." and made[0]["Maximum Grade"] == "9"


def test_blackboard_finds_every_student_and_score(graded: Graded) -> None:
    made = graded.export("blackboard", "Toy [Total Pts: 9 Score] |4711")
    assert all(line.startswith('"') and line.endswith('"') for line in made.content.splitlines())
    table = rows(made.content)
    scores = {row["Username"]: row["Toy [Total Pts: 9 Score] |4711"] for row in table}
    assert scores == {"ann": "9.5", "bob": "2.5"}
    assert (table[0]["Last Name"], table[1]["Last Name"]) == ("'=Doe", "Müller")


def test_feedback_goes_back_under_the_names_that_the_platform_gave(graded: Graded, tmp_path: Path) -> None:
    canvas = unpacked(graded.export("canvas-feedback").content)
    assert set(canvas) == {str(Path(name).with_suffix(".html")) for name in FILES.values()}
    moodle = graded.export("moodle-feedback").content
    assert unpacked(moodle)["Bob Müller_502_assignsubmission_file/toy.html"] == graded.pages["bob"]
    file = "Bob Müller_502_assignsubmission_file_my toy.ipynb"  # given out without folders
    flat = [dataclasses.replace(entry, file=file) for entry in class_entries(graded.root, toy.LAB)][:1]
    assert set(unpacked(FORMATS["moodle-feedback"](flat, "").content)) == {
        "Bob Müller_502_assignsubmission_file_/toy.html"
    }
    # What Moodle reads out of a folder's name is what the intake reads out of it.
    names = {name.replace("toy.html", "toy.ipynb"): "" for name in unpacked(moodle)}
    with zipfile.ZipFile(tmp_path / "moodle.zip", "w") as archive:
        for name in names:
            archive.writestr(name, "")
    reading = read_class(tmp_path / "moodle.zip", toy.LAB)
    assert reading.format.title == "Moodle"
    assert {claim.owner["moodle_id"] for claim in reading.recognised.claims} == {"501", "502", "503"}


def test_gradescope_gets_a_result_for_each_submission(graded: Graded) -> None:
    made = {name: json.loads(text) for name, text in unpacked(graded.export("gradescope").content).items()}
    assert set(made) == {f"toy/{student}/results.json" for student in FILES}
    ann, bob, cem = (made[f"toy/{student}/results.json"] for student in ("ann", "bob", "cem"))
    assert (ann["score"], bob["score"], cem["score"]) == (9.5, 2.5, 2)
    assert sum(test.get("score", 0) for test in bob["tests"]) == 2.5
    undecided = cem["tests"][0]
    assert "score" not in undecided and "status" not in undecided and "your instructor decides" in undecided["output"]
    assert "secret" not in json.dumps(made) and "not graded yet" in cem["output"]


def test_junit_has_a_suite_for_each_student(graded: Graded) -> None:
    xml = JUnitXml.fromstring(graded.export("junit").content.encode())
    suites = {suite.name: suite for suite in xml}
    assert set(suites) == {"toy.ann", "toy.bob", "toy.cem"}
    names = [(case.classname, case.name) for suite in xml for case in suite]
    assert len(set(names)) == len(names)
    score = {one.name: one.value for one in suites["toy.bob"].properties()}["score"]
    assert (xml.tests, xml.failures, xml.errors, score) == (9, 1, 1, "2.5")


def test_the_feedback_page_says_first_what_it_came_to_and_what_to_repair(graded: Graded) -> None:
    ann, bob, cem = (graded.pages[student] for student in ("ann", "bob", "cem"))
    assert "9.5 of 9 points<" in ann and "Well said, ann." in ann and "Doe, Ann" in ann
    assert "2.5 of 9 points<" in bob and "after 1 point off for handing in late" in bob
    assert bob.index("What to repair first") < bob.index("3 points lost") < bob.index('id="task-1"')
    assert "What to repair first" not in ann
    assert f"autograder appeal labs/{toy.LAB}/{toy.LAB}.ipynb" in bob and "--name bob" in bob
    assert "autograder appeal" not in ann
    assert "2 of 9 points so far" in cem and "2 answers are not graded yet" in cem and "up to 7 points" in cem
    for page in graded.pages.values():
        assert "secret" not in page and "http" not in page.replace("http-equiv", "")


def test_the_courses_answer_stands_below_the_students_for_who_grades_and_nowhere_else(graded: Graded) -> None:
    notebook = graded.root / "build" / "autograded" / "ann" / "toy" / "toy.ipynb"
    sources = ["".join(cell["source"]) for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]]
    answer = sources.index("Because of that.")
    assert sources[answer + 1].startswith("**For whoever grades") and sources[answer + 1].endswith("Because.")
    assert sum("For whoever grades" in source for source in sources) == 1
    assert all("For whoever grades" not in page for page in graded.pages.values())


def test_the_class_page_shows_what_needs_a_person(graded: Graded) -> None:
    page = graded.root / "build" / "report" / "toy.html"
    write_class_page(page, class_entries(graded.root, toy.LAB), datetime.date(2026, 11, 22))
    text = page.read_text(encoding="utf-8")
    assert "3 students" in text and "mean <b>4.67</b>" in text and "median <b>2.5</b>" in text
    assert "1 student: " in text and "1 of 3" in text and "An answer in words" in text
    assert text.count("handed in late") == 1 and text.index("Bob Müller") < text.index("handed in late")
    assert "late: -1<" in text
    assert "check_talker" in text and "secret reason" in text and "<script>alert" not in text
    for student in FILES:
        assert f'href="../feedback/{student}/toy/toy.html"' in text


def test_one_point_is_one_point(tmp_path: Path) -> None:
    unknown = [Outcome(status=Status.UNKNOWN, title="It drives", because="The machine was too busy.")]
    checks = [CheckResult(grade_id=f"check_{most}", max_points=most, outcomes=unknown) for most in (1, 2.5)]
    result = SubmissionResult(student="ann", lab="toy", digest="d", isolation=Isolation.FULL, checks=checks)
    entries = [Entry("ann", "toy", result)]
    text = write_class_page(tmp_path / "toy.html", entries, datetime.date(2026, 11, 22)).read_text()
    assert "decide about 1 point<" in text and "decide about 2.5 points<" in text


def test_the_class_page_has_a_table_of_the_best_for_a_check_that_ranks(tmp_path: Path) -> None:
    def entry(student: str, seconds: float, points: float) -> Entry:
        ranked = Ranked(value=seconds, unit="seconds", figures={"touches": 2 - points})
        passed = Outcome(status=Status.PASSED, title="It arrives")
        check = CheckResult(
            grade_id="check_way", title="The way", max_points=2, points=points, outcomes=[passed], ranked=ranked
        )
        result = SubmissionResult(student=student, lab="toy", digest="d", isolation=Isolation.FULL, checks=[check])
        return Entry(student, "toy", result)

    entries = [entry("slow", 40.25, 2), entry("fast", 31.5, 2), entry("touches", 20.0, 1)]
    text = write_class_page(tmp_path / "toy.html", entries, datetime.date(2026, 11, 22)).read_text()
    table = text.partition("The best: The way")[2].partition("</table>")[0]
    assert table.index("fast") < table.index("31.5") < table.index("slow") < table.index("40.2")
    assert "touches</button>" in table and ">touches<" not in table.partition("<tbody>")[2]


def test_who_is_gone_from_the_source_leaves_the_class_until_they_are_back(graded: Graded, tmp_path: Path) -> None:
    gone = (graded.source / FILES["cem"]).rename(graded.root / "cem.ipynb")
    run = grade(graded.root, graded.source)
    assert any(note.startswith("cem is no longer among the submissions") for note in run.collected.notes)
    assert "cem" not in run.grades.read_text() and not list(
        (graded.root / "build" / "feedback" / "cem").rglob("*.html")
    )
    assert [entry.student for entry in class_entries(graded.root)] == ["ann", "bob"]
    assert nbgraders_own_export(graded.root, tmp_path) == {"ann": 9.5, "bob": 2.5}
    gone.rename(graded.source / FILES["cem"])
    assert "cem,toy,,9,2" in grade(graded.root, graded.source).grades.read_text()


def test_a_page_on_which_most_is_wrong_is_no_longer_than_eight_screens(browser: Any) -> None:
    """As long as those of lab 3, which has the most tasks."""
    why = (
        "The rule `camera/image_colour:=front/image_raw` changed nothing: nothing is called `/area/camera/image_colour`"
    )
    tasks, cells, checks = [], [], []
    for number in range(20):
        name, parts = f"check_{number}", [Part(title=f"part {part}", max_points=0.5, points=0) for part in range(4)]
        outcomes = [
            Outcome(
                status=Status.FAILED, title=f"`/area/camera_{number}` has a publisher on `/status_{part}`",
                because=f"{why}, the name on its left side, in line {number}.", expected="1 publisher",
                observed="none; topics: /camera/image_color, /emergency_stop", hint="Compare them. See lecture 3.",
                part=f"part {part}",
            )
            for part in range(4)
        ]  # fmt: skip
        wrong = CheckResult(grade_id=name, title=name, max_points=2, points=0, parts=parts, outcomes=outcomes)
        right = CheckResult(grade_id=name, title=name, max_points=2, points=2)
        checks.append(right if number % 5 == 0 else wrong)
        cells.append(CellGrade(name, checks[-1].points, 2, True, False))
        tasks.append(Task(f"Task {number}", [name], {f"program_{number}": "print('hello')"}, f"Part {number // 5}"))
    result = SubmissionResult(student="ann", lab="toy", digest="d", isolation=Isolation.FULL, checks=checks)
    day = datetime.date(2026, 11, 22)
    text = feedback_html(Heading("Toy", "ann"), tasks, result, Grade("ann", "toy", tuple(cells), 0), day)
    window = browser.new_page(viewport={"width": 1280, "height": 800})
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    window.set_content(text)
    assert window.evaluate("document.documentElement.scrollHeight") < 8 * 800
    window.close()


def test_no_table_of_the_class_page_scrolls_sideways_at_1200_pixels(browser: Any, tmp_path: Path) -> None:
    why = "The topic `/car/sensors/temperature_monitor/state` has another type, std_msgs/msg/Float64MultiArray."
    failed = Outcome(status=Status.FAILED, title="a title", because=why, code="waits-for-a-service")
    check = CheckResult(
        grade_id="check_temperature_monitor", title="Warnings", max_points=3, points=0, outcomes=[failed]
    )
    entries = [
        Entry(
            student,
            "toy",
            SubmissionResult(student=student, lab="toy", digest="d", isolation=Isolation.FULL, checks=[check]),
        )
        for student in ("first.lastname@students.example.edu", "second.lastname@students.example.edu")
    ]
    page = write_class_page(tmp_path / "toy.html", entries, datetime.date(2026, 11, 22))
    window = browser.new_page(viewport={"width": 1200, "height": 800})
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    window.goto(page.as_uri())
    too_wide = "[...document.querySelectorAll('.wide')].filter(one => one.scrollWidth > one.clientWidth).length"
    assert window.evaluate(too_wide) == 0
    window.close()


def test_the_class_page_lays_out_only_some_of_thousands_until_they_are_searched_for(
    browser: Any, tmp_path: Path
) -> None:
    def entry(student: str) -> Entry:
        return Entry(student, "toy", SubmissionResult(student=student, lab="toy", digest="d", isolation=Isolation.FULL))

    entries = [entry(f"s{number:04d}") for number in range(1200)]
    page = write_class_page(tmp_path / "toy.html", entries, datetime.date(2026, 11, 22))
    window = browser.new_page(viewport={"width": 390, "height": 800})  # where each row is a card
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    window.goto(page.as_uri())
    laid_out = "[...document.querySelectorAll('#students tbody tr')].filter(row => row.offsetHeight).length"
    assert (window.inner_text("#shown"), window.evaluate(laid_out)) == ("500 of 1200 shown", 500)
    window.click("#students th:nth-child(1) button")
    window.click("#students th:nth-child(1) button")
    assert window.locator("#students tbody tr").first.inner_text().startswith("s1199")
    assert window.evaluate(laid_out) == 500
    window.fill("#search", "s000")
    assert (window.inner_text("#shown"), window.evaluate(laid_out)) == ("10 shown", 10)
    window.fill("#search", "")
    window.click("#all")
    assert (window.inner_text("#shown"), window.evaluate(laid_out)) == ("1200 shown", 1200)
    window.close()


def test_all_pages_can_be_read_by_everybody_on_a_phone_and_on_paper(graded: Graded, browser: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page = graded.root / "build" / "report" / "toy.html"
    entries, day = class_entries(graded.root, toy.LAB), datetime.date(2026, 11, 22)
    write_class_page(page, entries, day)
    appeal = Appeal("bob", toy.LAB, "check_talker", "2026-11-22", "It said hello.", "gradebook/appeals/toy.appeal.json")
    term = write_term_page(page.with_name("term.html"), "ROS 2", entries, [toy.LAB], {toy.LAB: 2.0}, [appeal], day, {})
    assert "weight 2" in term.read_text() and "autograder replay gradebook" in term.read_text()
    window = browser.new_page(viewport={"width": 390, "height": 800})
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    outside: list[str] = []
    window.on("request", lambda request: None if request.url.startswith("file:") else outside.append(request.url))
    for path in (page, term, graded.root / "build" / "feedback" / "bob" / "toy" / "toy.html"):
        window.goto(path.as_uri())
        assert window.evaluate("document.documentElement.scrollWidth <= innerWidth")
        found = axe.Axe().run(window, options={"preload": False}).response["violations"]
        assert [f"{rule['id']}: {rule['nodes'][0]['html'][:150]}" for rule in found] == []
    window.goto(page.as_uri())
    window.fill("#search", "müller")
    assert window.inner_text("#shown") == "1 shown"
    window.fill("#search", "")
    window.click("#students th:nth-child(2) button")
    first = "#students tbody tr:first-child td:first-child a"
    assert window.inner_text(first) == "cem"
    window.goto(page.as_uri())
    window.emulate_media(media="print")
    window.set_viewport_size({"width": 1030, "height": 700})  # a sheet of A4 across, within its margins
    assert window.evaluate("document.documentElement.scrollWidth <= innerWidth")
    window.close()
    assert outside == []
