"""Executors: how many jobs run at once, and how another executor is made known and chosen."""

from __future__ import annotations

import itertools
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

import pytest
import toy

from autograder.core.cpu_use import idle
from autograder.core.errors import KitError
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Cell, Lab, load_lab
from autograder.grading.class_runner import run_class
from autograder.grading.executors import EXECUTORS, Local, local
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

    def __init__(self, address: str, settings: Settings) -> None:
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
    settings = Settings(Isolation.NONE, seed=1, force=True)
    here: dict[str, SubmissionResult] = {}
    there: dict[str, SubmissionResult] = {}
    run_class(notebooks, course, lab, settings, lambda one: here.update({one.student: one}))
    monkeypatch.setitem(EXECUTORS, "elsewhere", Elsewhere)
    (course / "course.toml").write_text(f'executor = "elsewhere://{tmp_path}"\n')
    run_class(notebooks, course, lab, settings, lambda one: there.update({one.student: one}))
    assert {who: result.points for who, result in there.items()} == {"ann": 5.0, "bob": 0.0, "dan": 0.0}
    for who, result in here.items():
        assert [check.points for check in there[who].checks] == [check.points for check in result.checks]
        assert [check.outcomes for check in there[who].checks] == [check.outcomes for check in result.checks]


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


MEETS = """
import threading, time
from pathlib import Path
here, deadline = Path({folder!r}), time.monotonic() + {seconds}
(here / {me!r}).touch()
while len(list(here.iterdir())) < 2 and time.monotonic() < deadline:
    threading.Event().wait(0.02)
met = len(list(here.iterdir())) > 1
(here / {me!r}).unlink() if {leaves} else None
with answers("answers.yaml") as table:
    table.expect_answer("met", met)
table.score(2)
"""


def two_jobs(lab: Lab, folder: Path, met: bool, seconds: float, leaves: bool) -> list[Job]:
    """Return two jobs that get their points if they run at the same time, or if they do not."""
    folder.mkdir()
    setup = [cell for cell in lab.cells if cell.points is None]
    return [
        Job(
            student=who, lab=lab.name, digest="", isolation=Isolation.NONE, seed=1,
            files={"answers.yaml": f"met: {str(met).lower()}\n"},
            cells=[*setup, Cell(grade_id="check", points=2.0, source=MEETS.format(
                folder=str(folder), me=who, seconds=seconds, leaves=leaves))],
        )
        for who in ("ann", "bob")
    ]  # fmt: skip


def test_a_further_job_runs_while_the_cpus_are_idle(lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "idle", itertools.count(0.0, 1000.0).__next__)  # an idle machine cannot be had here
    jobs = two_jobs(lab, tmp_path / "here", met=True, seconds=120, leaves=False)
    assert [result.points for result in Local(1, further=1).run(jobs, lambda _: None)] == [2.0, 2.0]


@pytest.mark.parametrize("further", [0, 1])
def test_no_further_job_runs_while_the_cpus_are_busy(
    lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, further: int
) -> None:
    monkeypatch.setattr(local, "idle", lambda: 0.0)
    jobs = two_jobs(lab, tmp_path / "here", met=False, seconds=6, leaves=True)
    assert [result.points for result in Local(1, further).run(jobs, lambda _: None)] == [2.0, 2.0]


def of_one_job(lab: Lab, folder: Path, met: bool, seconds: float, leaves: bool) -> Job:
    """Return a job with two checks that start programs; each gets its points if both run at once, or if not."""
    ann, bob = two_jobs(lab, folder, met, seconds, leaves)
    checks = [
        Cell(grade_id=one.student, points=2.0, source=f"with launch():\n    pass\n{one.checks[0].source}")
        for one in (ann, bob)
    ]
    return ann.model_copy(update={"cells": [cell for cell in ann.cells if cell.points is None] + checks})


def test_the_checks_of_the_last_jobs_run_at_the_same_time(lab: Lab, tmp_path: Path) -> None:
    begun: list[str] = []
    (result,) = Local(2).run([of_one_job(lab, tmp_path / "here", met=True, seconds=120, leaves=False)], begun.append)
    assert [(check.grade_id, check.points) for check in result.checks] == [("ann", 2.0), ("bob", 2.0)]
    assert begun == ["ann"]


def test_the_checks_of_an_earlier_job_run_one_after_the_other(lab: Lab, tmp_path: Path) -> None:
    early = of_one_job(lab, tmp_path / "here", met=False, seconds=3, leaves=True)
    late = [early.model_copy(update={"student": f"s{number}", "cells": lab.cells[:1]}) for number in range(2)]
    results = {result.student: result for result in Local(2).run([early, *late], lambda _: None)}
    assert results.keys() == {"ann", "s0", "s1"}
    assert [check.points for check in results["ann"].checks] == [2.0, 2.0]


def test_the_checks_of_a_job_that_is_run_again_alone_run_one_after_the_other(lab: Lab, tmp_path: Path) -> None:
    job = of_one_job(lab, tmp_path / "here", met=False, seconds=3, leaves=True).model_copy(update={"alone": True})
    (result,) = Local(2).run([job], lambda _: None)
    assert [check.points for check in result.checks] == [2.0, 2.0]


def test_jobs_begin_in_their_order(lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "idle", lambda: 0.0)
    first, _ = two_jobs(lab, tmp_path / "here", met=False, seconds=0, leaves=True)
    jobs = [first.model_copy(update={"student": f"s{number}"}) for number in range(6)]
    begun: list[str] = []
    assert len(list(Local(1, further=2).run(jobs, begun.append))) == 6
    assert set(begun[:3]) == {"s0", "s1", "s2"}  # threads that begin at the same moment have no order
    assert begun[3:] == ["s3", "s4", "s5"]


def test_no_job_begins_after_the_end(lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "idle", lambda: 0.0)
    first, _ = two_jobs(lab, tmp_path / "here", met=False, seconds=0, leaves=True)
    begun: list[str] = []
    ran = Local(1, further=4).run(
        [first.model_copy(update={"student": f"s{number}"}) for number in range(6)], begun.append
    )
    next(ran)
    known = len(begun)
    ran.close()
    assert len(begun) <= known + 1  # one may have begun before the end, and four waited


def test_a_quota_leaves_no_cpu_idle(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 0.0 <= idle() <= time.clock_gettime(time.CLOCK_BOOTTIME)
    monkeypatch.setenv("AUTOGRADER_CPUS", "0.5")
    assert idle() == 0.0
