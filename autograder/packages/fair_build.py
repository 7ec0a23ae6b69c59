"""Builds a package so that a failure counts against the student only if the package is known to have caused it.

A build also fails because of the machine: its disk or its memory is full, a compiler is being replaced, or a process is
killed. The log of such a failure may look like any other log, or be empty. Therefore a failure is accepted at once only
if the tools reported a mistake in the package's own files that has no other cause, or if the build went over one of its
limits. After any other failure, a package that is known to be good is built in the same way. If that fails, too,
nothing is known about the student's package. Otherwise the student's package is built once more, and a second failure
counts, unless it looks like that of a machine without enough memory or disk space.
"""

from __future__ import annotations

import re
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.packages.explain import first_error, not_described, said_of_files
from autograder.sandbox.build import BuildRun, build_packages
from autograder.sandbox.scratch import Scratch

_BY_THE_SYSTEM = re.compile(
    r"Killed signal terminated program \w+|died with <Signals.SIGKILL: 9>|\bError 137\b|exited with code (?:-9|137)\b"
    r"|No space left on device|Cannot allocate memory"
)
"""What tools print if the system kills a process because memory is short, or refuses memory or disk space. A build file
can print these words, too, so a person has to look at it."""
_NAME = "known_good"
_PACKAGE_XML = f"""<?xml version="1.0"?>
<package format="3">
  <name>{_NAME}</name>
  <version>0.1.0</version>
  <description>A package that is known to be good.</description>
  <maintainer email="nobody@example.org">nobody</maintainer>
  <license>Apache-2.0</license>
  %s
</package>
"""
_PYTHON = {
    "package.xml": _PACKAGE_XML % "<export><build_type>ament_python</build_type></export>",
    "setup.py": f"""from setuptools import setup

setup(
    name="{_NAME}",
    version="0.1.0",
    packages=["{_NAME}"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/{_NAME}"]),
        ("share/{_NAME}", ["package.xml"]),
    ],
)
""",
    f"resource/{_NAME}": "",
    f"{_NAME}/__init__.py": "",
}
_INTERFACES = {
    "package.xml": _PACKAGE_XML
    % """<buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>""",
    "CMakeLists.txt": f"""cmake_minimum_required(VERSION 3.8)
project({_NAME})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces({_NAME} "msg/Number.msg")
ament_package()
""",
    "msg/Number.msg": "int32 data\n",
}


def build(sources: Path, package: str, isolation: Isolation) -> BuildRun:
    """Build one of the student's packages.

    Args:
        sources: the folder that contains the package's folder.
        package: the package's name.
        isolation: the isolation of the build, as for programs.

    Raises:
        KitError: it failed because of this machine: a package that is known to be good cannot be built either, or the
            system ended the build or had no room for it.
    """
    run = _run(sources, package, isolation)
    if _known(run, sources / package):
        return run
    trial = _trial(with_interfaces=(sources / package / "CMakeLists.txt").is_file(), isolation=isolation)
    if trial.status != 0:
        raise _cannot_build(
            package, f"A package that is known to be good could not be built here either ({_end(trial)})"
        )
    again = _run(sources, package, isolation)
    if again.killed_from_outside or (not _known(again, sources / package) and _BY_THE_SYSTEM.search(again.log)):
        raise _cannot_build(package, f"The system ended what builds it, or had no room for it ({_end(again)})")
    return again


def _known(run: BuildRun, folder: Path) -> bool:
    """Whether the build succeeded, or failed in a way for which only the package can be the cause."""
    if run.status == 0 or run.over or not_described(folder, folder.name) is not None:
        return True
    return said_of_files(run.log) is not None


def _trial(with_interfaces: bool, isolation: Isolation) -> BuildRun:
    with Scratch() as scratch:
        scratch.chmod(0o755)  # the sandbox runs as another user
        for path, text in (_INTERFACES if with_interfaces else _PYTHON).items():
            place = scratch / _NAME / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text, encoding="utf-8")
        return _run(scratch, _NAME, isolation)


def _run(sources: Path, package: str, isolation: Isolation) -> BuildRun:
    try:
        return build_packages(sources, [package], isolation)
    except OSError as error:
        raise KitError(f"The build of `{package}` cannot be started: {error}.", "Run `autograder doctor`.") from error


def _end(run: BuildRun) -> str:
    """Return what a build that failed printed as its error, or how it ended."""
    by_the_system = _BY_THE_SYSTEM.search(run.log)
    said = by_the_system[0] if by_the_system else first_error(run.log)
    return said or f"it ended with status {run.status} and said nothing"


def _cannot_build(package: str, why: str) -> KitError:
    return KitError(
        f"`{package}` could not be built. {why}, so this says nothing about `{package}`.",
        "Run it again; `autograder doctor` says what the machine lacks.",
    )
