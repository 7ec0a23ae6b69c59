"""nbgrader's exchange, both ways and with nbgrader's own commands: what is released arrives, and so does feedback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import toy
from places import ROOT

from autograder.course.cells import grade_id_of
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.own_courses import TEMPLATE, trust
from autograder.gradebook.settings import settings_of
from autograder.grading.runner import Settings


def nbgrader(folder: Path, *arguments: str) -> str:
    """Run one of nbgrader's commands, and return what it said."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("JUPYTER_", "TRAITLETS_"))}
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", *arguments],
        cwd=folder, capture_output=True, text=True, timeout=300, check=False,
        env=environment
        | {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "JUPYTER_CONFIG_DIR": str(folder / "none")},
    )  # fmt: skip
    told = done.stdout + done.stderr
    assert done.returncode == 0 and "Traceback" not in told, told
    return told


def test_a_lab_goes_out_and_feedback_comes_back_through_the_exchange(tmp_path: Path) -> None:
    root, student = toy.make_course(tmp_path / "course"), tmp_path / "ann"
    student.mkdir()
    (tmp_path / "exchange").mkdir(mode=0o777)
    (tmp_path / "exchange").chmod(0o777)
    settings = (
        '\nget_config().CourseDirectory.course_id = "ros2"  # noqa: F821\n'
        f"get_config().Exchange.root = {str(tmp_path / 'exchange')!r}  # noqa: F821\n"
    )
    (root / "nbgrader_config.py").write_text(TEMPLATE.read_text(encoding="utf-8") + settings, encoding="utf-8")
    cache = f"get_config().Exchange.cache = {str(tmp_path / 'cache')!r}\n"
    (student / "nbgrader_config.py").write_text(settings + cache, encoding="utf-8")
    trust(root)
    trust(student)
    (root / "solutions" / "toy" / "map.txt").write_text("a file of the lab")

    nbgrader(root, "generate_assignment", "toy", "--force")  # in a fresh course, which has no gradebook yet
    nbgrader(root, "release_assignment", "toy")
    nbgrader(student, "fetch_assignment", "toy")
    notebook = student / "toy" / "toy.ipynb"
    assert (student / "toy" / "map.txt").read_text() == "a file of the lab"
    cells = json.loads(notebook.read_text())["cells"]
    answer = next(cell for cell in cells if grade_id_of(cell) == "answers")
    answer["source"] = "%%file answers.yaml\nanswer: 42"
    notebook.write_text(json.dumps(toy.notebook(cells)))
    (student / "toy" / "ipykernel_launcher.py").write_text("open('planted', 'w')")
    nbgrader(student, "submit", "toy", "--CourseDirectory.student_id=ann")
    assert "Collecting submission: ann toy" in nbgrader(root, "collect", "toy")
    assert not (root / "build" / "submitted" / "ann" / "toy" / "ipykernel_launcher.py").exists()
    toy.hand_in(root / "build" / "submitted" / "bob", "toy", cells)  # who did not use the exchange stops nobody

    nbgrader(root, "autograde", "toy")
    autograded = root / "build" / "autograded" / "ann" / "toy"
    assert {path.name for path in autograded.iterdir()} == {"toy.ipynb", "timestamp.txt", "submission_secret.txt"}
    nbgrader(root, "generate_feedback", "toy")
    nbgrader(root, "release_feedback", "toy")
    nbgrader(student, "fetch_feedback", "toy", "--CourseDirectory.student_id=ann")
    (page,) = student.glob("toy/feedback/*/toy.html")
    assert page.read_bytes() == (root / "build" / "feedback" / "ann" / "toy" / "toy.html").read_bytes()

    # The same once more, taken by the kit's own intake: nothing is run again, and the page is found by the new secret.
    nbgrader(student, "submit", "toy", "--CourseDirectory.student_id=ann")
    settings_of.cache_clear()
    run = grade_class(root, toy.LAB, tmp_path / "exchange" / "ros2" / "inbound", Settings())
    assert run.collected.format == "nbgrader's exchange" and [one.student for one in run.results] == ["ann"]
    nbgrader(root, "release_feedback", "toy")
    nbgrader(student, "fetch_feedback", "toy", "--CourseDirectory.student_id=ann")
    assert len(list(student.glob("toy/feedback/*/toy.html"))) == 2
