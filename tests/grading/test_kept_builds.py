"""Builds that are kept for later runs: used for the same files only, and out of reach of what is built."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ros_packages import package

from autograder.core.results import Isolation
from autograder.course.lab import Cell
from autograder.grading import builds
from autograder.grading.job import Job
from autograder.grading.own_runs import run_recorded
from autograder.sandbox.build import BuildRun
from autograder.sandbox.isolation import preflight

pytestmark = pytest.mark.skipif(not preflight().full, reason="without full isolation no build is kept")

PACKAGE_XML = """<?xml version="1.0"?>
<package format="3">
  <name>things</name>
  <version>0.1.0</version>
  <description>A package that installs one file.</description>
  <maintainer email="nobody@example.org">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>cmake</buildtool_depend>
  <export><build_type>cmake</build_type></export>
</package>
"""
CMAKE = """cmake_minimum_required(VERSION 3.8)
project(things NONE)
add_custom_target(nothing ALL)
install(FILES package.xml DESTINATION share/things)
"""


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(builds, "_kept", type(builds._kept)())
    return tmp_path / "autograder" / "builds"


def built(cmake: str = CMAKE) -> BuildRun:
    """Build the package as a new process does, which remembers nothing."""
    builds._kept.clear()
    files = package("things", {"package.xml": PACKAGE_XML, "CMakeLists.txt": cmake})
    cells = [Cell(grade_id="check", points=1, source='with build("things") as package: pass')]
    job = Job(student="ann", lab="lab", digest="0", isolation=Isolation.FULL, seed=1, files=files, cells=cells)
    (run,) = builds.with_interfaces(job, 1).built.values()
    return run


def mark(store: Path) -> None:
    """Write into each stored build that it was stored, to tell it from one that is made anew."""
    for path in store.iterdir():
        path.write_text(json.dumps({**json.loads(path.read_text()), "log": "stored"}))


def test_a_stored_build_is_used_again_for_the_same_files_and_for_no_others(store: Path) -> None:
    first = built()
    assert first.status == 0 and "things/share/things/package.xml" in first.installed
    mark(store)
    again, other = built(), built(CMAKE + "# one more line\n")
    assert (again.log, again.installed) == ("stored", first.installed)
    assert other.status == 0 and other.log != "stored"


def test_a_build_that_failed_is_not_stored(store: Path) -> None:
    assert built("message(FATAL_ERROR no)\n").status != 0
    assert list(store.iterdir()) == []


@pytest.mark.parametrize("damage", ["others may write", "half a file"])
def test_a_store_that_cannot_be_relied_on_is_not_used(store: Path, damage: str) -> None:
    built()
    mark(store)
    if damage == "half a file":
        for path in store.iterdir():
            path.write_text(path.read_text()[:-10])
    else:
        store.chmod(0o777)
    assert built().log != "stored"


def test_what_is_built_can_neither_read_nor_write_the_store(store: Path) -> None:
    built()
    mark(store)
    kept = {path.name: path.read_text() for path in store.iterdir()}
    tries = f"""
file(GLOB seen "{store}/*")
message(STATUS "it sees: [${{seen}}]")
execute_process(COMMAND sh -c "mkdir -p {store}; for f in {" ".join(kept)} new.json; do echo forged > {store}/$f; done")
"""
    run = built(CMAKE + tries)
    assert run.status == 0 and "it sees: []" in run.log
    now = {path.name: path.read_text() for path in store.iterdir()}
    assert now.keys() >= kept.keys() and {name: now[name] for name in kept} == kept
    assert len(now) == len(kept) + 1 and "new.json" not in now


def test_a_run_that_is_recorded_for_questions_is_built_as_at_grading(store: Path) -> None:
    """A worker cannot reach the store."""
    files = package("things", {"package.xml": PACKAGE_XML, "CMakeLists.txt": CMAKE})
    source = 'from autograder.checks import build\nwith build("things") as package:\n    package.expect_built()'
    cells = [Cell(grade_id="check", points=1, source=source)]
    job = Job(student="ann", lab="lab", digest="0", isolation=Isolation.FULL, seed=1, files=files, cells=cells)
    (check,), _ = run_recorded(job, ["check"])
    assert check.grade_id == "check" and len(list(store.iterdir())) == 1


def test_packages_that_no_check_names_are_not_built_and_give_no_time() -> None:
    """Each of them could take a quarter of an hour, before the first check begins."""
    names = ["a", "import", *(f"p{number}" for number in range(5))]
    files = {f"src/{name}/{file}": "" for name in names for file in ("package.xml", "CMakeLists.txt")}
    cells = [
        Cell(grade_id="set_up", source="import rclpy  # a comment about 'things' that a student's package may be"),
        Cell(
            grade_id="check",
            points=1,
            source="with build('p0') as package:\n    pass\nfrom p1.msg import A\n'p2', 'p3'",
        ),
    ]
    job = Job(student="ann", lab="lab", digest="0", isolation=Isolation.NONE, seed=1, files=files, cells=cells)
    assert [name for name, _ in job.interfaces] == ["p0", "p1", "p2"]
    assert job.build_seconds == 3 * builds.BUILD_SECONDS
    assert job.model_copy(update={"cells": cells[:1]}).build_seconds == 0.0
