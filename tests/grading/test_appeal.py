"""An appeal against a verdict: one file from a student, which an instructor replays, answers, and keeps as a sample."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import toy
import yaml
from typer.testing import CliRunner, Result

from autograder.cli.main import app
from autograder.core.errors import KitError
from autograder.core.history import told
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.grades import read_grades, read_history
from autograder.grading.appeal import MOST_BYTES, read_appeal
from autograder.grading.messages import timeline_of
from autograder.grading.runner import Settings
from autograder.graph.recording import BagMessage

SENTENCE = "My talker ends as it should."


class Course:
    """A toy course in which the talkers of ann and bob got no points, although the check itself would pass them."""

    def __init__(self, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("autograder.grading.executors.local.run_in_worker", lambda job, *_: toy.judge(job))
        self.root, self.class_ = toy.make_course(place / "course"), place / "class"
        self.paths = CoursePaths(self.root)
        self.hand_in("ann", "print('no')")
        self.hand_in("bob", "print('not')")
        grade_class(self.root, toy.LAB, self.class_, Settings(Isolation.NONE, canaries=False))
        self.file = place / "mail" / "ann.appeal.json"

    def hand_in(self, student: str, talker: str) -> Path:
        answers = {"talker": f"%%node talker\n{talker}", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
        return toy.hand_in(self.class_, student, load_lab(self.root, toy.LAB).clean_notebook(answers)["cells"])

    def run(self, *arguments: object) -> Result:
        done = CliRunner().invoke(app, [*map(str, arguments), "--course", str(self.root)], env={"COLUMNS": "160"})
        if isinstance(done.exception, KitError):  # `main` makes sentences of these
            done.stderr_bytes = f"{done.exception.what} {done.exception.do}".encode()
        return done

    def appeal(self, notebook: Path) -> dict[str, Any]:
        done = self.run("appeal", notebook, "check_talker", SENTENCE, "-o", self.file)
        assert done.exit_code == 0, done.output
        made: dict[str, Any] = json.loads(self.file.read_text())
        return made


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    return Course(tmp_path, monkeypatch)


def test_an_appeal_is_replayed_granted_and_becomes_a_sample_student(course: Course) -> None:
    made = course.appeal(course.class_ / "ann" / "toy.ipynb")
    assert made["seen"]["points"] == 3 and made["student"] == "ann" and "'no'" in made["notebook"]
    shown = course.run("replay", course.file, "--times", 2)
    assert shown.exit_code == 0 and SENTENCE in shown.output and "student   ann\n" in shown.output
    assert "Run 1, with the same values" in shown.output and "Run 2, with other values" in shown.output
    assert shown.output.count("✓ passed  The talker  3 of 3 points") == 2
    term = course.run("term")
    page = course.paths.term_page.read_text()
    assert term.exit_code == 0 and SENTENCE in page and "autograder replay" in page

    refused = course.run("replay", course.file, "--times", 0, "--grant")
    assert "needs a reason" in str(refused.stderr_bytes)
    reason = "The check waited too short for you."
    for _ in range(2):  # the second time changes nothing
        done = course.run("replay", course.file, "--times", 0, "--grant", "--reason", reason, "--sample", "slow_talker")
        assert done.exit_code == 0, done.output
    taken = course.run("replay", course.file, "--times", 0, "--sample", "slow_talker")
    assert "There is a sample student slow_talker already." in str(taken.stderr_bytes)
    assert {one.student: one.earned for one in read_grades(course.root)} == {"ann": 5, "bob": 2}
    feedback = course.paths.feedback_page("ann", toy.LAB).read_text()
    assert SENTENCE in feedback and f"<b>Answer (granted):</b> {reason}" in feedback and "5 of 9 points" in feedback
    events = told(read_history(course.root, toy.LAB)["ann"], "check_talker")
    assert [change.why for event in events for change in event.changes] == [
        "graded for the first time", "overruled by hand"
    ]  # fmt: skip
    assert len(events) == 2, "the points and the answer are one entry"
    assert events[-1].what == f"Appeal about check_talker granted: {reason}"
    folder = course.root / "tests" / "classes" / toy.LAB / "slow_talker"
    assert yaml.safe_load((folder / "expected.yaml").read_text())["base"] == "solution"
    assert (folder / "cells" / "talker.py").read_text() == "%%node talker\nprint('no')\n"
    assert not (folder / "cells" / "answers.yaml").exists() and "ann" not in (folder / "expected.yaml").read_text()
    course.run("term")
    assert SENTENCE not in course.paths.term_page.read_text()


def test_appeals_of_one_check_have_different_file_names(course: Course, monkeypatch: pytest.MonkeyPatch) -> None:
    for student in ("ann", "bob"):
        monkeypatch.chdir(course.class_ / student)  # a student's kit calls this folder the same for everybody
        said = course.run("appeal", "toy.ipynb", "check_talker", SENTENCE, "--name", "toy").output
        assert "toy_check_talker_" in said
    names = [path.name for path in course.class_.glob("*/*.appeal.json")]
    assert len(names) == 2 and len(set(names)) == 2


def test_a_refused_appeal_reaches_the_page_and_leaves_the_points(course: Course) -> None:
    course.appeal(course.class_ / "ann" / "toy.ipynb")
    done = course.run("replay", course.file, "--times", 0, "--refuse", "--reason", "It said nothing.")
    assert done.exit_code == 0, done.output
    feedback = course.paths.feedback_page("ann", toy.LAB).read_text()
    assert "<b>Answer (refused):</b> It said nothing." in feedback and "2 of 9 points" in feedback


def test_the_answers_say_whose_it_is_and_not_the_name_in_the_file(course: Course) -> None:
    made = course.appeal(course.class_ / "ann" / "toy.ipynb")
    course.file.write_text(json.dumps(made | {"student": "bob"}))
    shown = course.run("replay", course.file, "--times", 0).output
    assert "student   ann\n" in shown and "--times 0 --refuse --reason 'SENTENCE' (or --grant)" in shown
    notebook = made["notebook"].replace("print('no')", "print('hello')")  # what would have been right
    course.file.write_text(json.dumps(made | {"notebook": notebook}))
    done = course.run("replay", course.file, "--times", 0, "--grant", "--reason", "So.")
    assert done.exit_code and "nobody handed in these answers; the file says 'ann'" in done.output
    assert "Nobody in the class handed in the answers" in str(done.stderr_bytes)
    assert {one.student: one.earned for one in read_grades(course.root)} == {"ann": 2, "bob": 2}


def test_the_messages_of_a_run_are_drawn_with_a_row_for_each_topic() -> None:
    came = [("/late", 3), ("/early", 2), ("/early", 1)]
    messages = [
        BagMessage(grade_id="check", topic=topic, type="std_msgs/msg/Int64", stamp=second * 10**9, data="")
        for topic, second in came
    ]
    picture = timeline_of("The talker", messages)
    assert "The talker" in picture.svg and picture.alt.index("/early") < picture.alt.index("/late")


def deep(made: dict[str, Any]) -> dict[str, Any]:
    return made | {"notebook": "[" * 100_000}


HOSTILE: list[Callable[[dict[str, Any]], dict[str, Any]]] = [
    deep,
    lambda made: made | {"lab": "../../etc/passwd"},
    lambda made: made | {"sentence": "x" * 100_000},
    lambda made: made | {"seed": -1},
    lambda made: made | {"seed": "1e999"},
    lambda made: made | {"more": 1},
    lambda made: made | {"messages": [made["seen"]]},
    lambda made: made | {"seen": {"points": "NaN"}},
    lambda made: made | {"notebook": "{"},
    lambda made: made | {"notebook": " " * MOST_BYTES},
    lambda made: {"form": 2},
]


def test_a_hostile_file_is_a_sentence(course: Course, tmp_path: Path) -> None:
    made = course.appeal(course.class_ / "ann" / "toy.ipynb")
    for number, change in enumerate(HOSTILE):
        path = tmp_path / f"{number}.appeal.json"
        path.write_text(json.dumps(change(made)))
        with pytest.raises(KitError, match=r"not an appeal that this version|larger than"):
            read_appeal(path)
    (tmp_path / "link.appeal.json").symlink_to(course.file)
    with pytest.raises(KitError, match="links are not followed"):
        read_appeal(tmp_path / "link.appeal.json")
    course.file.write_text(json.dumps(made | {"sentence": "Look\x1b[2J\u202ehere"}))
    assert "\x1b" not in read_appeal(course.file).sentence and "\u202e" not in read_appeal(course.file).sentence
    picture = {"svg": "<svg onload='alert(1)'/>", "alt": "x"}
    made["seen"]["outcomes"][0]["picture"] = picture
    course.file.write_text(json.dumps(made))
    assert "onload" not in read_appeal(course.file).model_dump_json()
