"""A stored result is taken where running again could say nothing new, and only there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import toy

from autograder.core.results import Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.grading import runner, supervisor
from autograder.grading.class_runner import run_class
from autograder.grading.job import Job
from autograder.grading.runner import Settings, run_submission
from autograder.grading.store import ResultStore
from autograder.grading.validation import validated


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
