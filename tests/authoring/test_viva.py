"""`autograder viva`: sheets with questions about a student's own run, of real submissions in the sandbox."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import sample_class

from autograder.core.results import CheckResult, Isolation, NodeLog, Outcome, Part, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.grading.store import ResultStore
from autograder.submission.reader import read_submission


def _course(tmp_path: Path, lab_name: str, checks: dict[str, tuple[str, ...]]) -> Path:
    """Return a course with one graded student, who has full points in some checks with these parts."""
    root = tmp_path / "course"
    root.mkdir()
    (root / "solutions").symlink_to(sample_class.ROOT / "solutions")
    lab = load_lab(root, lab_name)
    notebook = CoursePaths(root).submitted_notebook("solution", lab_name)
    sample_class.build_student(lab, "solution", tmp_path)
    notebook.parent.mkdir(parents=True)
    notebook.write_bytes((tmp_path / "solution" / f"{lab_name}.ipynb").read_bytes())
    found = [
        CheckResult(
            grade_id=check, max_points=len(parts), points=len(parts),
            outcomes=[Outcome(status=Status.PASSED, title="It runs")],
            parts=[Part(title=part, max_points=1, points=1) for part in parts],
            logs=[NodeLog(program="any", text="")],
        )
        for check, parts in checks.items()
    ]  # fmt: skip
    digest = read_submission(notebook, lab).digest
    result = SubmissionResult(
        student="solution", lab=lab_name, digest=digest, isolation=Isolation.NONE, seed=7, checks=found
    )
    ResultStore(root).save(result)
    return root


def _viva(root: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = "import sys; sys.argv[0] = 'autograder'; from autograder.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", command, "viva", *words],
        cwd=root, env=os.environ | {"PYTHONPATH": str(sample_class.ROOT)}, capture_output=True, text=True, timeout=3600,
    )  # fmt: skip


def test_a_sheet_has_questions_with_pictures_and_an_answer_to_each(tmp_path: Path) -> None:
    parts = ("the heartbeat goes on", "the period of beat", "the period of slow")
    root = _course(tmp_path, "lab2_executors", {"check_heartbeat": parts})
    done = _viva(root, "--sample", "1")
    assert done.returncode == 0, done.stderr
    page = CoursePaths(root).viva_page("lab2_executors", "solution")
    assert done.stdout.split() == [str(page)]
    text = page.read_text(encoding="utf-8")
    questions = text.count('<section class="question"')
    answers = re.findall(r"<li><b>(.+?)</b>", text.partition('<section class="answers">')[2])
    assert 3 <= questions == len(answers) <= 4
    assert text.count("<img ") >= 3, "a question about a change of a line has no picture"
    assert "http" not in text.replace("http-equiv", ""), "the sheet works without a network"


def test_somebody_without_a_result_is_named(tmp_path: Path) -> None:
    root = _course(tmp_path, "lab2_executors", {"check_heartbeat": ()})
    for words, said in (((), "Nobody was named"), (("nobody",), "no result of 'nobody'")):
        done = _viva(root, *words)
        assert done.returncode == 2
        assert said in done.stderr
