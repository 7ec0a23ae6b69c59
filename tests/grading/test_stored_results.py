"""A stored result is taken where running again could say nothing new, and only there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import toy

from autograder.core.results import CheckResult, NodeLog, Picture, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.grading import runner, supervisor
from autograder.grading.class_runner import run_class
from autograder.grading.executors import local
from autograder.grading.job import Job
from autograder.grading.runner import Settings, run_submission
from autograder.grading.store import ResultStore
from autograder.grading.trusted_result import believed, validated


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core cannot become fewer")
def test_as_many_run_at_once_as_the_cores_that_may_be_used_carry() -> None:
    usable = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(usable)})
    try:
        assert Settings().at_once == 5
    finally:
        os.sched_setaffinity(0, usable)


def test_a_result_of_another_seed_is_not_taken(tmp_path: Path) -> None:
    root = toy.make_course(tmp_path / "course")
    lab, submissions = load_lab(root, toy.LAB), {"ann": toy.hand_in(tmp_path, "ann", "{")}

    def graded(seed: int | None) -> SubmissionResult:
        return run_class(submissions, root, lab, Settings(seed=seed), lambda _: None)["ann"]

    first = graded(1)
    assert first.seed == 1
    assert graded(1) == first  # how long it took included
    second = graded(2)
    assert second.seed == 2
    assert graded(None) == second


def test_pictures_and_what_passed_are_in_the_file_and_not_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = toy.make_course(tmp_path / "course")
    lab = load_lab(root, toy.LAB)
    notebook = toy.hand_in(tmp_path, "ann", lab.clean_notebook({"talker": "%%node talker\nhello\n"})["cells"])

    def drawn(job: Job, *_: object) -> SubmissionResult:
        result = toy.judge(job)
        for check in result.checks:
            check.outcomes[0].picture = Picture(svg="<svg/>", alt="what was heard")
            check.logs = [NodeLog(program="talker", text="what was printed")]
        return result

    monkeypatch.setattr(local, "run_in_worker", drawn)
    shown: list[SubmissionResult] = []
    for _ in range(2):  # once run, once taken from the file
        held = run_class({"ann": notebook}, root, lab, Settings(seed=1), shown.append)["ann"]
        passed, failed = held.checks
        assert (passed.status, passed.outcomes) == (Status.PASSED, [])
        assert failed.status is Status.FAILED and "something else" in failed.outcomes[0].because
        assert "svg" not in held.model_dump_json() and "printed" not in held.model_dump_json()
    stored = ResultStore(root).last(toy.LAB, "ann")
    assert shown == [stored, stored] and stored is not None
    assert stored.checks[0].outcomes and stored.checks[0].outcomes[0].picture and stored.checks[0].logs


@pytest.mark.parametrize("points", [-1.0, -0.01, 2.01, float("nan"), float("inf")])
def test_impossible_points_are_not_believed(tmp_path: Path, points: float) -> None:
    cell = load_lab(toy.make_course(tmp_path / "course"), toy.LAB).checks[0]
    told = CheckResult(grade_id=cell.grade_id, title=cell.title, max_points=2.0, points=points, outcomes=[])
    assert believed(cell.model_copy(update={"points": 2.0}), told).status is Status.UNKNOWN
    possible = believed(cell.model_copy(update={"points": 2.0}), told.model_copy(update={"points": 0.0}))
    assert possible.points == 0.0 and not possible.outcomes


@pytest.mark.parametrize(("gives_a_result", "runs"), [(True, [1, 1]), (False, [1, 2])])
def test_only_a_worker_without_a_result_is_asked_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gives_a_result: bool, runs: list[int]
) -> None:
    root = toy.make_course(tmp_path / "course")
    lab = load_lab(root, toy.LAB)
    notebook = toy.hand_in(tmp_path, "ann", lab.clean_notebook({"talker": "%%node talker\ndie\n"})["cells"])
    asked: list[Job] = []

    def worker(job: Job, *_: object) -> SubmissionResult:
        asked.append(job)
        return validated(toy.judge(job), job.checks) if gives_a_result else supervisor.unknown(job, "It died.")

    monkeypatch.setattr(runner, "run_in_workers", worker)
    for expected in runs:
        result = run_submission(notebook, "ann", lab, Settings(), ResultStore(tmp_path))
        assert Status.UNKNOWN in [check.status for check in result.checks]
        assert len(asked) == expected
