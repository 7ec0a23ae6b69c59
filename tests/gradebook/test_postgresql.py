"""A gradebook on a PostgreSQL server: a real one, started here, which nobody else reaches."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import toy
from places import ROOT, TESTS
from postgresql_server import PROGRAMS, postgresql

from autograder.course.lab import load_lab
from autograder.gradebook.own_courses import TEMPLATE, trust

GRADER = """
import sys
from pathlib import Path
import toy
from autograder.core.results import Isolation
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.grades import read_grades
from autograder.grading.executors import local
from autograder.grading.runner import Settings
from autograder.grading.trusted_result import validated

local.run_in_worker = lambda job, *_: validated(toy.judge(job), job.checks)
root = Path(sys.argv[1])
run = grade_class(root, toy.LAB, root / "class", Settings(isolation=Isolation.NONE))
print(run.unrecorded, run.told, [(one.student, one.score, len(one.stale)) for one in read_grades(root)])
"""
BY_HAND = """
import sys
from autograder.gradebook.own_courses import prepare_nbgrader
prepare_nbgrader()
from nbgrader.api import Gradebook
with Gradebook(sys.argv[1]) as gradebook:
    grade = gradebook.find_grade("why", "toy", "toy", "ann")
    grade.manual_score, grade.needs_manual_grade = 3, False
    gradebook.db.commit()
"""
HISTORY = """
import sys
from pathlib import Path
import toy
from autograder.core.history import told
from autograder.gradebook.grades import read_history
events = told(read_history(Path(sys.argv[1]), toy.LAB)["ann"])
print([change.why for event in events for change in event.changes if change.cell != "check_speaker"])
"""
RENAME = """
import sys
from pathlib import Path
import toy
from autograder.gradebook.grades import read_grades
from autograder.gradebook.renamed import move_renamed
from autograder.intake.record import keep_class
root = Path(sys.argv[1])
keep_class(root, toy.LAB, {}, {}, {"bob": "rob"})
print(move_renamed(root), [(one.student, one.score) for one in read_grades(root)])
"""


@pytest.fixture
def server() -> Iterator[str]:
    """A server on a socket of its own; gives the address of an empty gradebook."""
    pytest.importorskip("psycopg")
    if PROGRAMS is None:
        pytest.skip("no PostgreSQL server on this machine (Debian: apt-get install postgresql)")
    with postgresql() as address:
        yield address


def python(code: str, *arguments: str | Path) -> str:
    path = os.pathsep.join((str(ROOT), str(TESTS / "support")))
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_class_is_graded_into_a_server_and_again(server: str, tmp_path: Path) -> None:
    root = toy.make_course(tmp_path / "course")
    setting = f"get_config().CourseDirectory.db_url = {server!r}  # noqa: F821\n"
    (root / "nbgrader_config.py").write_text(TEMPLATE.read_text(encoding="utf-8") + setting, encoding="utf-8")
    trust(root)
    lab = load_lab(root, toy.LAB)
    sources = {"talker": "%%node talker\nprint('hello')", "answers": "%%file answers.yaml\nanswer: 42", "why": "So."}
    for student in ("ann", "bob"):
        toy.hand_in(root / "class", student, lab.clean_notebook(sources)["cells"])
    assert python(GRADER, root) == "{} [] [('ann', 5.0, 0), ('bob', 5.0, 0)]"
    python(BY_HAND, server)
    notebook = root / "solutions" / "toy" / "toy.ipynb"
    notebook.write_text(notebook.read_text().replace("check_talker", "check_speaker"))
    toy.hand_in(root / "class", "ann", lab.clean_notebook(sources | {"why": "Something else."})["cells"])
    told = python(GRADER, root)
    assert told.startswith("{} ['toy has other cells than the gradebook: check_talker is called check_speaker now")
    assert told.endswith("[('ann', 8.0, 1), ('bob', 5.0, 0)]")
    assert python(HISTORY, root) == "['graded by hand']"
    assert "ann,toy,8,9,1\nbob,toy,5,9,1\n" in (root / "build" / "grades.csv").read_text()
    assert "8" in (root / "build" / "feedback" / "ann" / "toy" / "toy.html").read_text()
    assert [path.name for path in (root / "gradebook").iterdir()] == ["versions"]
    moved = "['bob is called rob now; the grades and the history of toy have moved.']"
    assert python(RENAME, root) == f"{moved} [('ann', 8.0), ('rob', 5.0)]"
