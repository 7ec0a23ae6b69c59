"""Another executor of jobs is a class, a line that makes it known, and a setting of the course's."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

import pytest
import toy

from autograder.core.errors import KitError
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.grading.class_runner import run_class
from autograder.grading.executors import EXECUTORS, Local
from autograder.grading.job import Job
from autograder.grading.runner import Settings

SETTINGS = Settings(isolation=Isolation.NONE, seed=1)
FAR = """
import sys
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker
print(run_in_worker(Job.model_validate_json(sys.stdin.read())).model_dump_json())
"""


class Elsewhere:
    """Runs each job in another Python, in another folder, which gets nothing but the job."""

    def __init__(self, address: str, at_once: int) -> None:
        self.folder = address

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        for job in jobs:
            started(job.student)
            ran = subprocess.run(
                [sys.executable, "-c", FAR], input=job.model_dump_json(), capture_output=True, text=True, check=True,
                cwd=self.folder,
            )  # fmt: skip
            yield SubmissionResult.model_validate_json(ran.stdout)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return load_lab(toy.make_course(tmp_path / "course"), toy.LAB)


def handed_in(lab: Lab, folder: Path) -> dict[str, Path]:
    answers = {"ann": {"talker": "%%node talker\nprint('hello')\n", "answers": "%%file answers.yaml\nanswer: 42"},
               "bob": {"talker": "%%node talker\n1 / 0\n"}}  # fmt: skip
    found = {who: toy.hand_in(folder, who, lab.clean_notebook(cells)["cells"]) for who, cells in answers.items()}
    return found | {"dan": toy.hand_in(folder, "dan", "{")}


def test_another_executor_finds_what_the_kits_own_finds(
    lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course, notebooks = tmp_path / "course", handed_in(lab, tmp_path / "class")
    here = run_class(notebooks, course, lab, Settings(Isolation.NONE, seed=1, force=True), lambda _: None)
    monkeypatch.setitem(EXECUTORS, "elsewhere", Elsewhere)
    (course / "course.toml").write_text(f'executor = "elsewhere://{tmp_path}"\n')
    seen: list[str] = []
    there = run_class(
        notebooks, course, lab, Settings(Isolation.NONE, seed=1, force=True), lambda one: seen.append(one.student)
    )
    assert sorted(seen) == ["ann", "bob", "dan"]
    assert [there[who].points for who in there] == [here[who].points for who in here] == [5.0, 0.0, 0.0]
    assert [[check.outcomes for check in there[who].checks] for who in there] == [
        [check.outcomes for check in here[who].checks] for who in here
    ]


def test_an_executor_that_there_is_not_is_refused(lab: Lab, tmp_path: Path) -> None:
    (tmp_path / "course" / "course.toml").write_text('executor = "dusk"\n')
    with pytest.raises(KitError, match="There is no executor 'dusk'"):
        run_class({}, tmp_path / "course", lab, SETTINGS, lambda _: None)


def test_a_job_that_cannot_be_run_costs_no_other_its_result(lab: Lab, tmp_path: Path) -> None:
    good, bad = (
        Job(student=who, lab=lab.name, digest="", isolation=Isolation.NONE, seed=1, files=files, cells=list(lab.cells))
        for who, files in (("ann", {"answers.yaml": "answer: 42\n"}), ("bob", {"talker.py": "\udce4"}))
    )
    results = {result.student: result for result in Local(2).run([good, bad], lambda _: None)}
    assert results["ann"].points == 2.0
    assert all(check.points is None for check in results["bob"].checks)
