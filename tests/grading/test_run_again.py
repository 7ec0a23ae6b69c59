"""What others take from a check's programs costs no points: the check is run again before it is decided."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

import pytest
import toy

from autograder.core.results import CheckResult, Isolation, NodeLog, Outcome, Status, SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.grading import executors, trusted_result
from autograder.grading.class_runner import run_class
from autograder.grading.job import Cell, Job
from autograder.grading.runner import Settings
from autograder.grading.trusted_result import TOO_BUSY, lacks_a_result
from autograder.sandbox.isolation import preflight

COMPUTES_FIRST = """
import time
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(String, "/talk", 10)
while not publisher.get_subscription_count():
    time.sleep(0.01)
until = time.thread_time() + 0.3
while time.thread_time() < until:
    pass
node.create_timer(0.1, lambda: publisher.publish(String(data="hello")))
rclpy.spin(node)
"""
"""Needs 0.3 s of a CPU once somebody listens: 5 s of its time where sixteen others want it, and a check waits for 3."""
CHECK = """
with launch("p") as ros:
    ros.node("/talker").expect(within=60)
    ros.topic("/talk", String).expect_messages(within=1)
ros.score(1)
"""
GRADE = """
import os, sys
os.sched_setaffinity(0, {int(sys.argv[1])})
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_workers
print(run_in_workers(Job.model_validate_json(sys.stdin.read()), 1).model_dump_json())
"""


def test_a_program_that_others_kept_from_the_cpu_gets_its_points(crowded_cpu: str) -> None:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    cells = [
        Cell(grade_id="set_up", source="from autograder.checks import launch\nfrom std_msgs.msg import String"),
        Cell(grade_id="check", points=1, source=CHECK),
    ]
    what = {"files": {"p.py": COMPUTES_FIRST}, "cells": cells, "isolation": Isolation.FULL}
    job = Job(student="ann", lab="toy", digest="0", seed=1, **what)
    command = [sys.executable, "-c", GRADE, crowded_cpu]
    ran = subprocess.run(command, input=job.model_dump_json(), capture_output=True, text=True, check=True)
    (check,) = SubmissionResult.model_validate(json.loads(ran.stdout)).checks
    assert check.points == 1, check
    assert check.run_again


Asked = tuple[str, list[str], bool]
"""A student, the checks that are to be run, and whether they are to run alone."""


class Machine:
    """An executor that gives what it is told to, and notes what it was asked to run at once."""

    def __init__(
        self, first: dict[str, float], again: dict[str, float], alone: dict[str, float], code: str = "silent"
    ) -> None:
        self.starved, self.asked = {"first": first, "again": again, "alone": alone}, list[list[Asked]]()
        self.codes = {"first": "silent", "again": code, "alone": "silent"}

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        self.asked.append([(job.student, [cell.grade_id for cell in job.checks], job.alone) for job in jobs])
        for job in jobs:
            run = "alone" if job.alone else "first" if len(job.checks) > 1 else "again"
            yield job.result(
                [failing(cell, self.starved[run].get(job.student, 0.0), run, self.codes[run]) for cell in job.checks]
            )


def failing(cell: Cell, starved: float, run: str, code: str) -> CheckResult:
    """A check that lost its points in a time of which so many seconds were withheld; of the table none ever are."""
    starved *= cell.grade_id == "check_talker"
    outcome = Outcome(status=Status.FAILED, title="a message comes", code=code, observed=run)
    return CheckResult(
        grade_id=cell.grade_id,
        max_points=cell.points or 0.0,
        points=0.0,
        starved=starved,
        outcomes=[outcome],
        flags=["odd in both", f"odd {run}"],
        logs=[NodeLog(program="p", text=run)],
    )


def test_a_class_runs_what_was_starved_again_at_its_end_and_what_is_still_open_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = load_lab(toy.make_course(tmp_path / "course"), toy.LAB)
    machine = Machine({"ann": 2.0, "bob": 3.0, "cat": 1.0}, {"bob": 1.5, "cat": 2.5}, {"bob": 1.5})
    monkeypatch.setattr(executors, "chosen", lambda *_: machine)
    class_ = {who: toy.hand_in(tmp_path, who, lab.clean_notebook({})["cells"]) for who in ("ann", "bob", "cat", "eve")}
    shown: list[SubmissionResult] = []
    results = run_class(class_, tmp_path / "course", lab, Settings(Isolation.NONE, seed=1), shown.append)
    assert machine.asked == [
        [(who, ["check_talker", "check_answers"], False) for who in ("ann", "bob", "cat", "eve")],
        [(who, ["check_talker"], False) for who in ("ann", "bob", "cat")],
        [("bob", ["check_talker"], True)],
        [("cat", ["check_talker"], True)],
    ]
    assert [result.student for result in shown] == ["eve", "ann", "bob", "cat"]  # each once, when it is settled
    points = {who: [check.points for check in result.checks] for who, result in results.items()}
    assert points == {"ann": [0.0, 0.0], "bob": [None, 0.0], "cat": [0.0, 0.0], "eve": [0.0, 0.0]}
    assert [check.run_again for check in results["ann"].checks] == [True, False]
    failure = results["bob"].checks[0].first_failure
    assert (
        failure is not None and failure.code == TOO_BUSY.code and "when the machine has less to do" in failure.because
    )
    for result, *runs in ((shown[1], "first", "again"), *((one, "first", "again", "alone") for one in shown[2:])):
        check = result.checks[0]  # a person may look at all runs
        assert check.flags == ["odd in both", *(f"odd {run}" for run in runs)]
        assert [log.text for log in check.logs] == runs[-1:]
        assert (check.outcomes[-1].code, check.outcomes[-1].observed) == ("silent", runs[-1])
    assert lacks_a_result(results["bob"]) and not lacks_a_result(results["ann"])  # a later run grades bob again


def test_what_lost_nothing_is_not_run_again() -> None:
    check = CheckResult(grade_id="check", max_points=2, points=2, starved=9.0)
    assert not trusted_result.is_open(check)
    assert trusted_result.is_open(check.model_copy(update={"points": 1.0}))
    assert trusted_result.is_open(check.model_copy(update={"points": None}))
    assert not trusted_result.is_open(check.model_copy(update={"points": 0.0, "starved": 0.0}))


def test_a_check_that_fails_for_another_reason_the_second_time_runs_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = load_lab(toy.make_course(tmp_path / "course"), toy.LAB)
    machine = Machine({"ann": 2.0, "bob": 3.0}, {}, {}, code="late")
    monkeypatch.setattr(executors, "chosen", lambda *_: machine)
    class_ = {who: toy.hand_in(tmp_path, who, lab.clean_notebook({})["cells"]) for who in ("ann", "bob")}
    results = run_class(class_, tmp_path / "course", lab, Settings(Isolation.NONE, seed=1), lambda _: None)
    assert machine.asked[2:] == [[("ann", ["check_talker"], True)], [("bob", ["check_talker"], True)]]
    assert [result.checks[0].starved for result in results.values()] == [0.0, 0.0]  # the last run decides


def test_a_single_check_that_was_starved_runs_again_alone_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = load_lab(toy.make_course(tmp_path / "course"), toy.LAB)
    machine = Machine({"bob": 3.0}, {}, {})
    monkeypatch.setattr(executors, "chosen", lambda *_: machine)
    class_ = {who: toy.hand_in(tmp_path, who, lab.clean_notebook({})["cells"]) for who in ("ann", "bob")}
    run_class(class_, tmp_path / "course", lab, Settings(Isolation.NONE, seed=1), lambda _: None)
    assert machine.asked[1:] == [[("bob", ["check_talker"], True)]]  # it waits longer then, and costs the class no more


def test_an_interruption_while_checks_are_run_again_loses_no_first_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = load_lab(toy.make_course(tmp_path / "course"), toy.LAB)
    machine = Machine({"ann": 2.0, "bob": 3.0}, {}, {})
    monkeypatch.setattr(executors, "chosen", lambda *_: machine)
    class_ = {who: toy.hand_in(tmp_path, who, lab.clean_notebook({})["cells"]) for who in ("ann", "bob", "eve")}

    def interrupted(result: SubmissionResult) -> None:
        if result.student == "ann":
            raise KeyboardInterrupt

    settings = Settings(Isolation.NONE)
    with pytest.raises(KeyboardInterrupt):
        run_class(class_, tmp_path / "course", lab, settings, interrupted)
    machine.asked.clear()
    results = run_class(class_, tmp_path / "course", lab, settings, lambda _: None)
    assert [asked for asked in machine.asked if asked] == [[("bob", ["check_talker"], True)]]
    assert [check.run_again for check in results["bob"].checks] == [True, False]
    assert not list(CoursePaths(tmp_path / "course").to_run_again.rglob("*.json"))
