"""Builds a package so that a failure is the student's only if it is known to be.

A build also fails where the machine does: its disk or its memory is full, a compiler is being replaced, a process is
killed. The log of such a failure may look like any other, or be empty. So a failure is believed if the tools have said
something of the package's own files that nothing else brings about, or if the build went over one of its limits. Any
other one is put to the test: a package that is known to be good is built in the same way. If that fails, too, nothing
is known of the student's package; otherwise it is built once more, and then its failure stands.
"""

from __future__ import annotations

from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.packages.explain import first_error, not_described, said_of_files
from autograder.sandbox.build import BuildRun, build_packages
from autograder.sandbox.scratch import Scratch

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
    """Build a package of a student's.

    Args:
        sources: the folder that holds the package's folder.
        package: its name.
        isolation: as for programs.

    Raises:
        KitError: it failed, and this machine cannot build a package that is known to be good either.
    """
    run = _run(sources, package, isolation)
    if _known(run, sources / package):
        return run
    trial = _trial(with_interfaces=(sources / package / "CMakeLists.txt").is_file(), isolation=isolation)
    if trial.status != 0:
        raise _cannot_build(package, trial)
    again = _run(sources, package, isolation)
    if again.killed_from_outside:
        raise _cannot_build(package, again)
    return again


def _known(run: BuildRun, folder: Path) -> bool:
    """Whether nobody needs to ask whose failure it is, or whether it is one."""
    if run.status == 0 or run.over or not_described(folder, folder.name) is not None:
        return True
    return said_of_files(run.log) is not None


def _trial(with_interfaces: bool, isolation: Isolation) -> BuildRun:
    with Scratch() as scratch:
        scratch.chmod(0o755)  # the sandbox runs as somebody else
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


def _cannot_build(package: str, run: BuildRun) -> KitError:
    said = first_error(run.log) or f"it ended with status {run.status} and said nothing"
    return KitError(
        f"`{package}` was not built, and it is not known why: this machine does not build packages at the moment"
        f" ({said}).",
        "Run it again; `autograder doctor` says what the machine lacks.",
    )
