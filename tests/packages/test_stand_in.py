"""The lab's own package of interfaces stands in for a wrong one, in checks of other answers and nowhere else."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from ros_packages import INTERFACES, changed, package

from autograder.core.results import CheckResult, Isolation
from autograder.course.lab import Cell, load_lab
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_workers
from autograder.sandbox.isolation import preflight

COUNTER = """import rclpy
from good_interfaces.srv import Count
from std_msgs.msg import Int64

rclpy.init()
node = rclpy.create_node("counter")
publisher = node.create_publisher(Int64, "count", 10)
node.create_timer(0.2, lambda: publisher.publish(Int64(data=Count.Response(count=7).count)))
rclpy.spin(node)
"""
FIELDS = 'package.expect_interface("srv/Count", {"label": "string"}, {"count": "int32"})'
RUNS = """with launch("counter", packages=["good_interfaces"], listen=[("/count", Int64)]) as ros:
    ros.topic("/count", Int64).expect_messages(at_least=1, where=lambda m: m.data == 7)
ros.score(1)"""
CHECKS = {
    "the nodes": f"""with build("good_interfaces") as package:
    with package.or_reference():
        {FIELDS}
{RUNS}""",
    "the package": f'with build("good_interfaces") as package:\n    {FIELDS}\npackage.score(1)',
    "the nodes with this package": RUNS,
}
"""The second and the third run after the first, in the same folder."""
WRONG = {
    "another name of a field": changed(INTERFACES, "srv/Count.srv", "int32 count", "int32 number"),
    "not built": changed(INTERFACES, "package.xml", "</package>", ""),
}


def results(files: Mapping[str, str], reference: Mapping[str, str], counter: str = COUNTER) -> dict[str, CheckResult]:
    set_up = "from autograder.checks import build, launch\nfrom std_msgs.msg import Int64\n"
    cells = [Cell(grade_id=name, points=1, source=source) for name, source in CHECKS.items()]
    what: dict[str, Any] = {
        "files": {"counter.py": counter, **package("good_interfaces", files)},
        "reference": reference,
        "cells": [Cell(grade_id="set_up", source=set_up), *cells],
    }
    isolation = Isolation.FULL if preflight().full else Isolation.NONE
    job = Job(student="ann", lab="lab", digest="0", isolation=isolation, seed=1, **what)
    return {check.grade_id: check for check in run_in_workers(job, 1).checks}


@pytest.mark.parametrize("files", WRONG.values(), ids=WRONG)
def test_a_right_package_stands_in_for_a_wrong_one_in_the_check_that_asks_for_it_only(files: dict[str, str]) -> None:
    found = results(files, package("good_interfaces", INTERFACES))
    assert {name: check.points for name, check in found.items()} == {
        "the nodes": 1,
        "the package": 0,
        "the nodes with this package": 0,
    }, found
    told = [one for one in found["the nodes"].outcomes if "stands in" in one.title]
    assert [one.observed for one in told] == [found["the package"].outcomes[0].because]


def test_a_program_that_uses_a_wrong_name_is_told_that_it_ran_with_a_right_package() -> None:
    own = COUNTER.replace("Response(count=7).count", "Response(number=7).number")
    first = results(WRONG["another name of a field"], package("good_interfaces", INTERFACES), own)[
        "the nodes"
    ].first_failure
    assert first is not None and "number" in first.because, first
    assert "ran with a right `good_interfaces`" in first.because and "no field `count`" in first.because, first


def test_without_a_reference_the_wrong_package_is_the_reason() -> None:
    found = results(WRONG["another name of a field"], {})
    assert [check.points for check in found.values()] == [0, 0, 0]
    assert found["the nodes"].first_failure == found["the package"].first_failure


def test_a_right_package_is_used_itself() -> None:
    lab = package("good_interfaces", changed(INTERFACES, "srv/Count.srv", "int32 count", "int32 of_the_lab"))
    found = results(INTERFACES, lab)
    assert [check.points for check in found.values()] == [1, 1, 1], found
    assert not any("stands in" in one.title for one in found["the nodes"].outcomes)


def test_only_the_instructors_copy_of_a_lab_knows_the_reference(tmp_path: Path) -> None:
    names = load_lab(ROOT, "lab7_interfaces").reference
    assert {Path(name).parts[1] for name in names} == {"car_interfaces"}
    assert "float32 confidence" in names["src/car_interfaces/msg/DetectedObject.msg"]
    shutil.copytree(ROOT / "labs" / "lab7_interfaces", tmp_path / "labs" / "lab7_interfaces")
    assert load_lab(tmp_path, "lab7_interfaces").reference == {}
