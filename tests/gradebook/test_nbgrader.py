"""Grades in nbgrader: the stored result decides, nothing is executed, nobody earns or loses points by luck."""

from __future__ import annotations

import contextlib
import copy
import html.parser
import json
import os
import shutil
import sqlite3
import subprocess
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

import pytest
import toy
from places import ROOT

from autograder.authoring.release import release
from autograder.core.results import Isolation
from autograder.course.cells import grade_id_of
from autograder.course.lab import Lab, load_lab
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.grades import read_grades, write_grades
from autograder.gradebook.own_courses import TEMPLATE, prepare_nbgrader, trust
from autograder.gradebook.recorder import Recorder
from autograder.gradebook.release import register
from autograder.gradebook.settings import settings_of
from autograder.grading import runner
from autograder.grading.executors import local
from autograder.grading.runner import Settings
from autograder.grading.store import ResultStore
from autograder.grading.trusted_result import validated

LIVE = (
    "<img src=x onerror=alert(1)> <ScRiPt>alert(2)</sCrIpT> <a href='javascript:alert(3)'>a</a>"
    " [b](javascript:alert(4)) [c](JaVaScRiPt&colon;alert(5)) [d](java&#9;script:alert(6)) [e]( javascript:alert(7))"
    " ![f](http://example.org/track.png) <svg/onload=alert(8)> <javascript:alert(9)> [g](data:text/html,alert(10))\n\n"
    "</textarea><iframe srcdoc='<script>alert(11)</script>'></iframe>\n\n"
    "```\n</code></pre><img src=x onerror=alert(12)>\n```\n\n    <script>alert(13)</script>\n\n"
    "`<img onerror=alert(14)>`\n\n[h]: javascript:alert(15)\n[i]:\n  java&Tab;script:alert(16)\n\n[h] [i]\n\n"
    "[fine](https://docs.ros.org) 1 < 2 <3"
)


class Course:
    """A course in a folder of its own whose worker is `toy.judge`."""

    def __init__(self, root: Path) -> None:
        self.root = toy.make_course(root)
        self.lab: Lab = load_lab(self.root, toy.LAB)

    def cells(self, talker: str = "print('hello')", why: str = "Because.") -> list[dict[str, Any]]:
        sources = {"talker": f"%%node talker\n{talker}", "answers": "%%file answers.yaml\nanswer: 42", "why": why}
        cells: list[dict[str, Any]] = self.lab.clean_notebook(sources)["cells"]
        return cells

    def hand_in(self, student: str, cells: list[dict[str, Any]] | str) -> Path:
        path = self.root / "build" / "submitted" / student / toy.LAB / f"{toy.LAB}.ipynb"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(cells if isinstance(cells, str) else json.dumps(toy.notebook(cells)), encoding="utf-8")
        return path

    def run(self, student: str) -> None:
        path = self.root / "build" / "submitted" / student / toy.LAB / f"{toy.LAB}.ipynb"
        runner.run_submission(path, student, self.lab, Settings(), ResultStore(self.root))

    def grade(self, *students: str, force: bool = False) -> list[str]:
        """Run and record; return whom nbgrader was asked to record."""
        for student in students:
            self.run(student)
        before = {student: self._stamp(student) for student in students}
        self.record(*students, force=force)
        return [student for student in students if self._stamp(student) != before[student]]

    def record(self, *students: str, force: bool = False) -> None:
        recorder = Recorder(self.root, self.lab, force)
        recorder.begin()
        for student in students:
            recorder.record(student)
        assert recorder.failures == {}

    def _stamp(self, student: str) -> float:
        path = self.root / "build" / "autograded" / student / toy.LAB / f"{toy.LAB}.ipynb"
        return path.stat().st_mtime_ns if path.exists() else 0.0

    def grades(self, student: str) -> dict[str, tuple[float | None, bool]]:
        """Automatic score and whether it waits for a person, by grade_id."""
        prepare_nbgrader()
        from nbgrader.api import Gradebook

        with Gradebook(f"sqlite:///{self.root / 'gradebook' / 'gradebook.db'}") as gradebook:
            notebook = gradebook.find_submission_notebook(toy.LAB, toy.LAB, student)
            return {grade.name: (grade.auto_score, grade.needs_manual_grade) for grade in notebook.grades}

    def autograded(self, student: str) -> str:
        return (self.root / "build" / "autograded" / student / toy.LAB / f"{toy.LAB}.ipynb").read_text()

    def feedback(self, student: str) -> str:
        return (self.root / "build" / "feedback" / student / toy.LAB / f"{toy.LAB}.html").read_text()


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """One course for the module, for a fresh gradebook takes seconds."""
    patch = pytest.MonkeyPatch()
    patch.setattr(runner, "run_in_workers", lambda job, *_: validated(toy.judge(job), job.checks))
    yield Course(tmp_path_factory.mktemp("nbgrader") / "course")
    patch.undo()


class Tags(html.parser.HTMLParser):
    """Collects what a browser would act on."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.live: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            # A browser drops control characters and spaces before it looks for the scheme.
            link = "".join(character for character in value or "" if character > " ").lower()
            scheme = link.split(":")[0] if name in ("href", "action", "formaction") else ""
            if (
                (name.startswith("on") and "alert" in link)
                or scheme in ("javascript", "data", "vbscript")
                or (name == "src" and "example" in link)
            ):
                self.live.append(f"{tag} {name}={value}")
        if tag in ("iframe", "svg", "object", "embed", "base", "form"):
            self.live.append(tag)

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script" and "alert(" in data:
            self.live.append(f"script {data}")


def test_points_come_from_the_result(course: Course) -> None:
    course.hand_in("solved", course.cells())
    course.hand_in("wrong", course.cells(talker="print('no')"))
    course.hand_in("blank", list(course.lab.released))
    course.grade("solved", "wrong", "blank")
    assert course.grades("solved") == {"check_talker": (3, False), "check_answers": (2, False), "why": (None, True)}
    assert course.grades("wrong") == {"check_talker": (0, False), "check_answers": (2, False), "why": (None, True)}
    assert course.grades("blank") == {"check_talker": (0, False), "check_answers": (0, False), "why": (0, False)}


def test_no_verdict_means_manual_grading(course: Course) -> None:
    course.hand_in("died", course.cells(talker="die"))
    course.grade("died")
    assert course.grades("died")["check_talker"] == (None, True)
    rows = write_grades(course.root).read_text().splitlines()
    assert rows[0] == "student,lab,score,max_score,waiting" and "died,toy,,9,2" in rows
    assert "your instructor decides" in course.feedback("died")


def test_markers_in_an_answer_are_only_words(course: Course) -> None:
    talker = "### BEGIN HIDDEN TESTS\n### BEGIN MARK SCHEME\n### BEGIN SOLUTION\nprint('no')  # mine"
    course.hand_in("marker", course.cells(talker=talker, why="BEGIN HIDDEN TESTS is what I looked for."))
    course.grade("marker")
    page = course.feedback("marker")
    assert "# mine" in page and "what I looked for" in page


def test_the_hook_before_grading_leaves_a_foreign_working_folder_alone(
    course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepare_nbgrader()
    from autograder.gradebook.nbgrader_commands import before_autograde

    (tmp_path / "build").mkdir()
    monkeypatch.chdir(tmp_path)
    register(course.root, toy.LAB)
    before_autograde(course.root, assignment=toy.LAB, student="ann", notebooks=[])
    assert list((tmp_path / "build").iterdir()) == []


def test_a_result_that_lost_a_check_means_manual_grading(course: Course) -> None:
    course.hand_in("lost", course.cells())
    course.run("lost")
    path = ResultStore(course.root).path(toy.LAB, "lost")
    result = json.loads(path.read_text())
    del result["checks"][0]
    result["checks"][0]["max_points"] = 1000
    result["checks"][0]["points"] = 1000
    path.write_text(json.dumps(result))
    course.record("lost")
    assert course.grades("lost") == {"check_talker": (None, True), "check_answers": (None, True), "why": (None, True)}


def test_broken_submissions_wait_for_a_person_with_their_reason_and_stop_nobody(course: Course) -> None:
    course.hand_in("broken", "{")
    course.hand_in("empty", "")
    course.hand_in("fine", course.cells())
    course.grade("broken", "empty", "fine")
    for student, reason, grade in (("broken", "not valid JSON", (None, True)), ("empty", "handed in", (0, False))):
        assert course.grades(student) == {"check_talker": grade, "check_answers": grade, "why": (0, False)}
        assert reason in course.feedback(student)
    assert course.grades("fine")["check_talker"] == (3, False)


def test_attacks_on_the_notebook_change_nothing(course: Course) -> None:
    def by_id(cells: list[dict[str, Any]], grade_id: str) -> dict[str, Any]:
        return next(cell for cell in cells if grade_id_of(cell) == grade_id)

    def skip(cells: list[dict[str, Any]]) -> None:
        for cell in cells:
            cell["metadata"]["tags"] = ["skip-execution"]

    def flip(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "check_talker")["metadata"]["nbgrader"].update(solution=True, locked=False)
        by_id(cells, "check_talker")["source"] = "3"

    def manual(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "why")["metadata"]["nbgrader"].update(solution=False, points=100)
        by_id(cells, "talker")["metadata"]["nbgrader"].update(grade=True, points=100)

    def duplicate(cells: list[dict[str, Any]]) -> None:
        cells.append(copy.deepcopy(by_id(cells, "check_talker")) | {"source": "3"})

    def forge(cells: list[dict[str, Any]]) -> None:
        cells.append(toy.cell("code", "3", 99, grade_id="bonus", grade=True, locked=True, points=100))

    def delete(cells: list[dict[str, Any]]) -> None:
        cells.remove(by_id(cells, "check_talker"))
        cells.remove(by_id(cells, "why"))

    def outputs(cells: list[dict[str, Any]]) -> None:
        by_id(cells, "check_talker")["outputs"] = [
            {"output_type": "execute_result", "data": {"text/plain": "3"}, "metadata": {}, "execution_count": 1}
        ]

    attacks = (skip, flip, manual, duplicate, forge, delete, outputs)
    for attack in attacks:
        cells = course.cells(talker="print('no')")
        attack(cells)
        path = course.hand_in(attack.__name__, cells)
        (path.parent / "ipykernel_launcher.py").write_text("open('/tmp/planted', 'w')")
    course.grade(*(attack.__name__ for attack in attacks))
    for attack in attacks:
        grades = course.grades(attack.__name__)
        assert grades["check_talker"] == (0, False), attack.__name__
        assert grades["check_answers"] == (2, False), attack.__name__
        assert grades.keys() == {"check_talker", "check_answers", "why"}
        folder = course.root / "build" / "autograded" / attack.__name__ / toy.LAB
        assert [path.name for path in folder.iterdir()] == ["toy.ipynb"], attack.__name__
        assert "skip-execution" not in course.autograded(attack.__name__)


def test_nothing_of_a_students_is_live_in_feedback_or_formgrader(course: Course) -> None:
    talker = "print('no')  # <img src=x onerror=alert(20)></script><script>alert(21)</script>"
    cells = course.cells(talker=talker, why=LIVE)
    cells.append(toy.cell("code", "1", 98, grade_id="<img src=x onerror=alert(22)>", grade=True, locked=True, points=1))
    cells.append(toy.cell("code", "1", 97, grade_id="\r\r[j](javascript:alert(23))\r\r", grade=True, points=1))
    course.hand_in("live", cells)
    course.grade("live")
    assert Tags("<img src=x onerror=alert(1)><script>alert(2)</script>").live == [
        "img onerror=alert(1)", "script alert(2)"
    ]  # fmt: skip
    page = course.feedback("live")
    assert Tags(page).live == [] and "https://docs.ros.org" in page and "alert(1)" in page
    from nbconvert.exporters import HTMLExporter
    from nbgrader.server_extensions.formgrader import handlers
    from traitlets.config import Config

    from autograder.gradebook.config import configure

    # As formgrader makes its exporter.
    config = Config()
    configure(config, course.root)
    config.HTMLExporter.template_name = "formgrade"
    config.HTMLExporter.extra_template_basedirs = [handlers.template_path]
    path = course.root / "build" / "autograded" / "live" / toy.LAB / "toy.ipynb"
    resources = {"nbgrader": {"assignment": toy.LAB, "notebook": toy.LAB, "student": "live"}, "unique_key": "x"}
    markdown = [cell for cell in json.loads(path.read_text())["cells"] if grade_id_of(cell) == "why"]
    assert "1 < 2 <3" in "".join(markdown[0]["source"])
    names = ("submission_id", "notebook_id", "first_name", "last_name", "base_url", "mathjax_url")
    resources |= dict.fromkeys((*names, "assignment_id", "filename", "prev", "next"), "0") | {"index": 0, "total": 1}
    page, _ = HTMLExporter(config=config).from_filename(str(path), resources=resources)
    assert page.count("Because") == 1 and "alert(1)" in page, "once: the course's own answer"
    assert Tags(page).live == []


def test_feedback_shows_no_hidden_check(course: Course) -> None:
    course.hand_in("curious", course.cells(talker="print('no')"))
    course.grade("curious")
    page = course.feedback("curious")
    assert "A hidden check failed" in page and "Read on." in page and "It says something else" in page
    for secret in ("secret", "BEGIN HIDDEN"):
        assert secret not in page
    assert "aria-label" in page and "border-left" in page


def test_unchanged_submissions_are_not_recorded_again(course: Course) -> None:
    course.hand_in("same", course.cells())
    course.hand_in("other", course.cells())
    assert course.grade("same", "other") == ["same", "other"]
    assert course.grade("same", "other") == []
    course.hand_in("other", course.cells(talker="print('no')"))
    assert course.grade("same", "other") == ["other"]
    assert course.grade("same", force=True) == ["same"]


def by_hand(course: Course, student: str, **points: float) -> None:
    """Give points as formgrader does."""
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{course.root / 'gradebook' / 'gradebook.db'}") as gradebook:
        for name, given in points.items():
            grade = gradebook.find_grade(name, toy.LAB, toy.LAB, student)
            grade.manual_score, grade.needs_manual_grade = given, False
        gradebook.db.commit()


def test_a_manual_grade_stays_and_reaches_the_feedback(course: Course) -> None:
    course.hand_in("manual", course.cells(talker="die"))
    course.grade("manual")
    by_hand(course, "manual", check_talker=1.5, why=4)
    course.grade("manual")
    assert "7.5 of 9 points" in course.feedback("manual")
    course.grade("manual", force=True)
    assert "manual,toy,7.5,9,0\n" in write_grades(course.root).read_text()


LATE = """
import nbgrader.plugins


class PerHour(nbgrader.plugins.BasePlugin):
    def late_submission_penalty(self, student_id, score, total_seconds_late):
        return 0.5 * (total_seconds_late // 3600)


get_config().AssignLatePenalties.plugin_class = PerHour
"""


def test_a_courses_configuration_leaves_the_kit_where_python_finds_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "nbgrader_config.py").write_text(TEMPLATE.read_text(encoding="utf-8") + LATE, encoding="utf-8")
    trust(tmp_path)
    monkeypatch.setattr(sys, "path", [str(ROOT), *(folder for folder in sys.path if folder != str(ROOT))])
    monkeypatch.chdir(ROOT)
    settings_of(tmp_path)
    assert PathFinder.find_spec("autograder") is not None


def test_who_is_late_has_the_same_score_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "run_in_worker", lambda job, *_: validated(toy.judge(job), job.checks))
    late = Course(tmp_path / "course")
    template = TEMPLATE.read_text(encoding="utf-8")
    (late.root / "nbgrader_config.py").write_text(template + LATE, encoding="utf-8")
    trust(late.root)
    for student, hour in (("ann", "11:59"), ("bob", "14:10")):
        notebook = toy.hand_in(tmp_path / "class", student, late.cells())
        notebook.with_name("timestamp.txt").write_text(f"2026-11-02 {hour}:00.5 UTC\n", encoding="utf-8")
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    address = f"sqlite:///{late.root / 'gradebook' / 'gradebook.db'}"
    (late.root / "gradebook").mkdir()
    with Gradebook(address) as gradebook:
        gradebook.add_assignment(toy.LAB, duedate="2026-11-02 12:00 UTC")
    run = grade_class(late.root, toy.LAB, tmp_path / "class", Settings(isolation=Isolation.NONE))
    assert run.unrecorded == {} and run.collected.refused == []
    assert run.grades.read_text().splitlines()[1:] == ["ann,toy,5,9,1", "bob,toy,4,9,1"]
    assert "5 of 9 points so far" in late.feedback("ann") and "4 of 9 points so far" in late.feedback("bob")
    assert "after 1 point off for handing in late" in late.feedback("bob")
    with Gradebook(address) as gradebook:
        submission = gradebook.find_submission(toy.LAB, "bob")
        assert submission.score - submission.late_submission_penalty == 4.0
    (tmp_path / "class" / "bob" / "timestamp.txt").write_text("2026-11-02T12:00:00Z", encoding="utf-8")
    again = grade_class(late.root, toy.LAB, tmp_path / "class", Settings(isolation=Isolation.NONE))
    assert again.grades.read_text().splitlines()[2] == "bob,toy,5,9,1"
    assert "5 of 9 points" in late.feedback("bob")


def test_points_by_hand_stay_and_ask_to_be_looked_at_where_what_they_judged_has_changed(course: Course) -> None:
    def waiting() -> int:
        return next(
            len(one.waiting) + len(one.stale) for one in read_grades(course.root, toy.LAB) if one.student == "again"
        )

    course.hand_in("again", course.cells(talker="print('no')"))
    course.grade("again")
    by_hand(course, "again", why=3, check_talker=1.5)
    for _ in range(2):
        course.grade("again", force=True)
        assert waiting() == 0
    course.hand_in("again", course.cells(talker="print('no')", why="Because of something else."))
    course.grade("again")
    assert course.grades("again")["why"] == (None, True) and course.grades("again")["check_talker"] == (0, False)
    by_hand(course, "again", why=4)
    course.hand_in("again", course.cells(why="Because of something else."))
    course.grade("again")
    assert course.grades("again") == {"check_talker": (3, True), "check_answers": (2, False), "why": (None, False)}
    assert waiting() == 1 and "again,toy,7.5,9,1\n" in write_grades(course.root).read_text()


def test_a_renamed_check_keeps_its_grades_and_a_removed_one_stays_in_a_copy(course: Course, tmp_path: Path) -> None:
    shutil.copytree(course.root / "solutions", tmp_path / "course" / "solutions")
    own = Course.__new__(Course)
    own.root, own.lab = tmp_path / "course", load_lab(tmp_path / "course", toy.LAB)
    own.hand_in("ann", own.cells())
    own.grade("ann")
    by_hand(own, "ann", check_talker=1, why=3)
    path = own.root / "solutions" / toy.LAB / "toy.ipynb"
    path.write_text(path.read_text().replace("check_talker", "check_speaker"))
    own.lab = load_lab(own.root, toy.LAB)
    told = register(own.root, toy.LAB)
    assert len(told) == 1 and "check_talker is called check_speaker now and keeps its grades" in told[0]
    own.grade("ann")
    assert own.grades("ann") == {"check_speaker": (3, False), "check_answers": (2, False), "why": (None, False)}
    assert "ann,toy,6,9,0\n" in write_grades(own.root).read_text()
    notebook = json.loads(path.read_text())
    notebook["cells"] = [cell for cell in notebook["cells"] if grade_id_of(cell) != "check_speaker"]
    more = toy.cell("markdown", "And why not?", 40, grade_id="why_not", grade=True, solution=True, points=1)
    path.write_text(json.dumps(notebook | {"cells": [*notebook["cells"], more]}))
    own.lab = load_lab(own.root, toy.LAB)
    told = register(own.root, toy.LAB)
    assert "check_speaker is no longer graded, with the points by hand of 1 student;" in told[0]
    own.grade("ann")
    assert own.grades("ann") == {"check_answers": (2, False), "why": (None, False), "why_not": (0, False)}
    copies = sorted((own.root / "gradebook" / "backups").glob("*.db"))
    assert len(copies) == 2 and register(own.root, toy.LAB) == []
    # A copy that is put back gets what it lacks.
    (own.root / "gradebook" / "gradebook.db").write_bytes(copies[0].read_bytes())
    own.grade("ann")
    assert own.grades("ann").keys() == {"check_answers", "why", "why_not"}
    assert "ann,toy,5,7,0\n" in write_grades(own.root).read_text()


def test_a_gradebook_moves_to_where_clean_does_not_reach_and_gets_the_newest_form(
    course: Course, tmp_path: Path
) -> None:
    root = tmp_path / "course"
    shutil.copytree(course.root / "solutions", root / "solutions")
    (root / "build").mkdir()
    course.hand_in("moved", course.cells())
    course.grade("moved")
    earlier = root / "build" / "gradebook.db"
    shutil.copy(course.root / "gradebook" / "gradebook.db", earlier)
    with contextlib.closing(sqlite3.connect(earlier)) as old:  # as nbgrader 0.6 made it
        old.executescript(
            "CREATE TABLE a AS SELECT id, name, duedate FROM assignment; DROP TABLE assignment;"
            "ALTER TABLE a RENAME TO assignment; DROP TABLE course; DROP TABLE autograder_recorded;"
            "UPDATE alembic_version SET version_num = '282d30a0218e'"
        )
    register(root, toy.LAB)
    assert not earlier.exists()
    assert [
        path.name.endswith("_before_nbgrader_upgrade.db") for path in (root / "gradebook" / "backups").iterdir()
    ] == [True]
    assert {one.student for one in read_grades(root)} == {one.student for one in read_grades(course.root)}


def test_releasing_twice_gives_the_same_files(course: Course) -> None:
    folder = release(course.root, toy.LAB)
    path = folder / "toy.ipynb"
    first = path.read_bytes()
    cells = json.loads(first)["cells"]
    source = course.root / "solutions" / toy.LAB / "toy.ipynb"
    noisy = json.loads(source.read_text())
    for number, cell in enumerate(noisy["cells"]):
        cell["id"] = f"noise{number}"
        if cell["cell_type"] == "code":
            cell.update(execution_count=7, outputs=[{"output_type": "stream", "name": "stdout", "text": "x"}])
    before = source.read_text()
    source.write_text(json.dumps(noisy))
    try:
        release(course.root, toy.LAB)
    finally:
        source.write_text(before)
    assert path.read_bytes() == first
    assert b"secret" not in first and b"hello" not in first and b"answer: 42" not in first
    # What students receive is what the reader takes for a blank submission.
    assert [cell["source"] for cell in cells] == [cell["source"].rstrip("\n") for cell in course.lab.released] or [
        "".join(cell["source"]) for cell in cells
    ] == [cell["source"] for cell in course.lab.released]
    assert sorted(path.name for path in folder.iterdir()) == ["toy.ipynb"]


def nbgrader(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "PATH": "/usr/bin:/bin",
        "JUPYTER_CONFIG_DIR": str(root / "none"),
    }
    environment.pop("TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR", None)
    return subprocess.run(
        [sys.executable, "-m", "nbgrader", *arguments],
        cwd=root, env=environment, capture_output=True, text=True, timeout=300,
    )  # fmt: skip


def test_nbgraders_own_commands_give_the_same_grades(course: Course, tmp_path: Path) -> None:
    root = tmp_path / "a course"
    own = Course(root)
    shutil.copy(ROOT / "nbgrader_config.py", root)
    own.hand_in("ann", own.cells(why=LIVE))
    own.hand_in("broken", "{")
    for student in ("ann", "broken"):
        own.run(student)
    done = nbgrader(root, "autograde", toy.LAB)
    assert done.returncode == 0, done.stderr
    assert own.grades("ann") == {"check_talker": (3, False), "check_answers": (2, False), "why": (None, True)}
    assert own.grades("broken")["check_talker"] == (None, True)
    done = nbgrader(root, "generate_feedback", toy.LAB)
    assert done.returncode == 0, done.stderr
    assert "A hidden check passed" in own.feedback("ann") and Tags(own.feedback("ann")).live == []


def test_nbgrader_refuses_stock_execution(course: Course, tmp_path: Path) -> None:
    root = tmp_path / "course"
    own = Course(root)
    own.hand_in("ann", own.cells())
    own.run("ann")
    shutil.copy(ROOT / "nbgrader_config.py", root)
    stages = '--Autograde.autograde_preprocessors=["nbgrader.preprocessors.Execute"]'
    done = nbgrader(root, "autograde", toy.LAB, stages)
    assert done.returncode != 0 and not (root / "build" / "autograded").exists()
    broken = (
        (root / "nbgrader_config.py")
        .read_text()
        .replace("autograder.gradebook.nbgrader_commands", "autograder.nowhere")
    )
    (root / "nbgrader_config.py").write_text(broken)
    done = nbgrader(root, "autograde", toy.LAB)
    assert done.returncode != 0 and "Nothing was executed" in done.stderr
    assert not (root / "build" / "autograded").exists()
