"""Every reason has a program for which it must speak, and a near miss for which it must not.

The programs are real ones. Several run in one launch, each is asked about on its own, and the answer is awaited: a
reason that is established comes as soon as there is enough to see, and a near miss is asked when it has done its work.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from diagnosis_cases import CASES, Case

import autograder.diagnosis
from autograder.checks import Program, current, launch
from autograder.core.results import Isolation
from autograder.diagnosis import Scene
from autograder.diagnosis.inside import read
from autograder.reasons import Group, Reason, all_kinds

TOGETHER = 8
"""Programs in one launch."""

ELSEWHERE = {
    "program-missing": "test_checks.py",
    "nothing-started": "test_launch_files.py",
    "no-node": "test_checks.py",
    "not-on-graph": "test_worker_limits.py",
    "one-name-for-all": "test_classes.py",
    "duplicate-node": "test_classes.py",
}
"""Reasons about launches as a whole: where they are tested."""


@pytest.fixture(scope="module")
def answers(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, tuple[Reason | None, str]]]:
    """What is said in the end about each program that a selected test asks for, and what it printed."""
    folder = tmp_path_factory.mktemp("programs")
    calls = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    names = [name for name in CASES if {"name": name} in calls]
    for name in names:
        (folder / f"{name}.py").write_text(CASES[name].source(name))
    current.check.configure(folder, Isolation.NONE, 7)
    found: dict[str, tuple[Reason | None, str]] = {}
    for start in range(0, len(names), TOGETHER):
        batch = names[start : start + TOGETHER]
        with launch(*batch) as ros:
            programs = {node.program: program for node, program in ros._running.programs}

            def scene_of(name: str) -> Scene:
                return Scene(ros._running.observer, [programs[name]], [], folder, [[]])  # noqa: B023

            def answered(name: str) -> bool:
                case, scene = CASES[name], scene_of(name)
                (it,) = scene.insides
                if case.never and case.says in ("", "silent") and not case.ready(it):
                    return False
                said = case.ask(scene, name)
                found[name] = (said, programs[name].output() if said is None else "")  # noqa: B023
                # Some reasons first say what goes on, and then what came of it.
                return (said.code if said else "") == case.says and (said is None or _told(case, said))

            for name in batch:
                ros.wait(lambda: answered(name), 120.0)  # noqa: B023
    yield found
    current.check.close()


def _told(case: Case, said: Reason) -> bool:
    return case.because in f"{said.because} {said.hint}"


@pytest.mark.parametrize("name", CASES)
def test_a_reason_is_given_where_it_was_seen_and_only_there(
    name: str, answers: dict[str, tuple[Reason | None, str]]
) -> None:
    case, (said, output) = CASES[name], answers[name]
    assert (said.code if said else "") == case.says, (said, output)
    assert said is None or _told(case, said), said
    assert said is None or said.code not in case.never


def test_every_reason_of_the_diagnosis_has_both_kinds_of_programs() -> None:
    groups = list(Group)[: list(Group).index(Group.ENDS)]
    codes = {kind.code for kind in all_kinds().values() if kind.group in groups}
    spoken = {case.says for case in CASES.values()}
    missed = {code for case in CASES.values() for code in case.never}
    assert len(codes) > 80
    assert codes - spoken - ELSEWHERE.keys() == set()
    assert codes - missed - ELSEWHERE.keys() == set()


def test_what_a_probe_does_not_write_is_ignored_and_a_probe_that_failed_is_not_believed() -> None:
    forged = [
        {},
        {"e": "thing"},
        {"e": "thing", "id": 1, "kind": []},
        {"e": 7},
        {"e": "spin"},
        {"e": "call", "what": "x"},
    ]
    assert [event.e for event in read([*forged, {"e": "attached"}])] == ["attached"]
    failed = {"e": "probe_failed", "what": "_prepare_node: AttributeError"}
    assert [event.e for event in read([failed, {"e": "attached", "more": 1}])] == ["probe_failed", "attached"]


LATE = """\
import sys, threading
import rclpy
rclpy.init()
if "__ns:=/late" in sys.argv:
    threading.Event().wait()
rclpy.spin(rclpy.create_node("twin"))
"""


def test_where_a_program_runs_twice_the_node_of_one_is_not_the_misplaced_node_of_the_other(tmp_path: Path) -> None:
    (tmp_path / "twin.py").write_text(LATE)
    current.check.configure(tmp_path, Isolation.NONE, 7)
    with launch(Program("twin", namespace="/first"), Program("twin", namespace="/late"), Program("twin")) as ros:
        ros.wait(lambda: {"/first/twin", "/twin"} <= set(ros.graph.nodes()), 120.0)
        ros.wait(lambda: all(inside.attached for inside in ros._running.scene().insides), 120.0)
        scene = ros._running.scene()
        late, astray = [autograder.diagnosis.why_no_node(scene, f"/{where}/twin") for where in ("late", "astray")]
    current.check.close()
    assert late.code == "no-node" and "runs, but" in late.because
    assert astray.code == "namespace" and "namespace: `/twin`." in astray.because


SIDES = """\
import sys
import rclpy
rclpy.init()
rclpy.spin(rclpy.create_node(sys.argv[1]))
"""


def test_a_node_that_lies_a_namespace_too_deep_is_found_beside_another_run_of_its_program(tmp_path: Path) -> None:
    (tmp_path / "camera.py").write_text(SIDES)
    current.check.configure(tmp_path, Isolation.NONE, 7)
    right = Program("camera", namespace="/car", arguments_of_its_own=("right",))
    left = Program("camera", namespace="/car/car", arguments_of_its_own=("left",))  # two `push_ros_namespace`
    with launch(right, left) as ros:
        ros.wait(lambda: {"/car/right", "/car/car/left"} <= set(ros.graph.nodes()), 120.0)
        ros.wait(lambda: all(inside.nodes for inside in ros._running.scene().insides), 120.0)
        found = autograder.diagnosis.why_no_node(ros._running.scene(), "/car/left")
    current.check.close()
    assert found.code == "namespace" and "another namespace: `/car/car/left`." in found.because
    assert "something adds `/car` to that" in found.hint


SILENT = """\
import rclpy
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("gate")
async def never(request, response):
    await rclpy.task.Future()
node.create_service(Trigger, "open", never)
rclpy.spin(node)
"""
ONCE = """\
import rclpy
rclpy.init()
rclpy.spin_once(rclpy.create_node("once"), timeout_sec=0.1)
"""


def test_a_program_that_has_ended_is_not_why_the_service_of_another_one_does_not_answer(tmp_path: Path) -> None:
    (tmp_path / "gate.py").write_text(SILENT)
    (tmp_path / "once.py").write_text(ONCE)
    current.check.configure(tmp_path, Isolation.NONE, 7)
    with launch("once", "gate") as ros:
        ros.wait(lambda: not ros.program("once").running(), 120.0)
        ros.wait(lambda: "/open" in ros._running.observer.services(), 120.0)
        ros.wait(lambda: any("/gate" in inside.nodes for inside in ros._running.scene().insides), 120.0)
        found = autograder.diagnosis.why_no_answer(ros._running.scene(), "/open")
    current.check.close()
    assert found.code == "no-answer" and "/open" in found.because
