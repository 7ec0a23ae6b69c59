"""nbgrader's exchange, both ways and with nbgrader's own commands: what is released arrives, and so does feedback."""

from __future__ import annotations

import json
import os
import pwd
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
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


EXCHANGE = """
get_config().CourseDirectory.course_id = "ros2"  # noqa: F821
get_config().Exchange.root = {!r}  # noqa: F821
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to somebody else")
def test_collect_takes_neither_the_work_of_another_account_nor_a_link(tmp_path: Path) -> None:
    """Everybody may put a folder with any name into the exchange: here two accounts that every machine has."""
    root, inbound = toy.make_course(tmp_path / "course"), tmp_path / "exchange" / "ros2" / "inbound"
    inbound.parent.parent.mkdir()
    inbound.parent.parent.chmod(0o777)
    settings = TEMPLATE.read_text(encoding="utf-8") + EXCHANGE.format(str(tmp_path / "exchange"))
    (root / "nbgrader_config.py").write_text(settings, encoding="utf-8")
    trust(root)
    forged = "daemon+toy+2026-12-24 10:00:00 UTC+b"
    for owner, name, work in (
        ("daemon", "daemon+toy+2026-11-20 10:00:00 UTC+a", "own"),
        ("bin", "bin+toy+2026-11-20 10:00:00 UTC+a", "own"),
        ("bin", forged, "forged"),
        ("bin", "sys+toy+2026-12-24 10:00:00 UTC+c", "forged"),
        ("bin", "bin+toy+soon+e", "forged"),
    ):
        (inbound / name).mkdir(parents=True)
        (inbound / name / "toy.ipynb").write_text(work)
        (inbound / name / "timestamp.txt").write_text("2026-11-20 10:00:00 UTC")
        shutil.chown(inbound / name, owner)
    (inbound / "bin+toy+2026-11-20 10:00:00 UTC+a" / "other.ipynb").symlink_to(root / "solutions/toy/toy.ipynb")
    (inbound / "sys+toy+2026-12-25 10:00:00 UTC+d").symlink_to(root / "solutions/toy")
    os.chown(inbound / "sys+toy+2026-12-25 10:00:00 UTC+d", *(pwd.getpwnam("bin")[2:4]), follow_symlinks=False)

    told = nbgrader(root, "collect", "toy")
    assert f"'{forged}' is left out: it belongs to the account 'bin'." in told and "other.ipynb in bin+toy" in told
    assert "'bin+toy+soon+e' is left out: its name has no date that can be read." in told
    submitted = root / "build" / "submitted"
    assert {path.relative_to(submitted).as_posix() for path in submitted.glob("*/toy/*")} == {
        f"{name}/toy/{file}" for name in ("daemon", "bin") for file in ("toy.ipynb", "timestamp.txt")
    }
    assert {path.read_text() for path in submitted.glob("*/toy/toy.ipynb")} == {"own"}


def test_a_lab_goes_out_and_feedback_comes_back_through_the_exchange(tmp_path: Path) -> None:
    root, student = toy.make_course(tmp_path / "course"), tmp_path / "ann"
    student.mkdir()
    (tmp_path / "exchange").mkdir(mode=0o777)
    (tmp_path / "exchange").chmod(0o777)
    settings = EXCHANGE.format(str(tmp_path / "exchange"))
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
