"""Packages: built by colcon in the sandbox, run from where they are installed, and explained where they are not."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tarfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from ros_packages import INTERFACES, SENSORS, changed, package

from autograder.checks import build, current
from autograder.core.results import CheckResult, Isolation, Status
from autograder.course.lab import Cell
from autograder.grading.builds import with_interfaces
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_workers
from autograder.reasons import Group, all_kinds
from autograder.sandbox import build as sandbox_build
from autograder.sandbox.build import BuildRun
from autograder.sandbox.grading_sandbox import SandboxRun
from autograder.sandbox.isolation import preflight


def without(files: Mapping[str, str], file: str) -> dict[str, str]:
    return {name: text for name, text in files.items() if name != file}


FORGES = """import io, os, tarfile
forged = io.BytesIO()
with tarfile.open(fileobj=forged, mode="w") as tar:
    tar.addfile(tarfile.TarInfo("NAME/share/forged"))
for process in filter(str.isdigit, os.listdir("/proc")):
    try:
        with open(f"/proc/{process}/cmdline") as line:
            builds = "build_packages.py" in line.read()
        if builds or process == "1":
            os.write(os.open(f"/proc/{process}/fd/1", os.O_WRONLY), forged.getvalue())
    except OSError:
        pass
"""
MAKES_FILES = """import os
os.mkdir("many")
for number in range(60_000):
    os.close(os.open(f"many/{number}", os.O_CREAT | os.O_WRONLY))
"""

EXPECT = "expect_built()"
RUNS = 'expect_executable("speed_sensor")'
DEPENDS = 'expect_depends("std_msgs", to_build=("std_msgs",))'
CASES: dict[str, tuple[dict[str, str], str, str, str]] = {
    # name: (files, expectation, code, words of the reason)
    "forges_the_result": (
        {**SENSORS, "setup.py": FORGES + SENSORS["setup.py"]},
        'expect_installed("share/forged")',
        "not-installed",
        "installs no `share/forged`",
    ),
    "makes_files": (
        {**SENSORS, "setup.py": MAKES_FILES + SENSORS["setup.py"]},
        EXPECT,
        "build-files",
        "30,000 files",
    ),
    "not_xml": (changed(SENSORS, "package.xml", "</package>", ""), EXPECT, "package-xml", "package.xml"),
    "no_license": (
        changed(SENSORS, "package.xml", "<license>Apache-2.0</license>", ""),
        EXPECT,
        "package-xml",
        "license",
    ),
    "other_name": (changed(SENSORS, "package.xml", "<name>NAME", "<name>other"), EXPECT, "package-name", "`other`"),
    "no_build_type": (
        changed(SENSORS, "package.xml", "<build_type>ament_python</build_type>", ""),
        EXPECT,
        "build-type",
        "no build type",
    ),
    "type_alone": (
        {"package.xml": SENSORS["package.xml"].replace("<build_type>ament_python</build_type>", "")},
        'expect_depends("rclpy")',
        "build-type",
        "no build type, and the package has no `CMakeLists.txt` and no `setup.py`",
    ),
    "no_cmake": (
        without(INTERFACES, "CMakeLists.txt"),
        EXPECT,
        "build-type",
        "no `CMakeLists.txt`. Run the cell that begins with `%%file src/no_cmake/CMakeLists.txt`, or write it.",
    ),
    "no_setup": (without(SENSORS, "setup.py"), 'expect_depends("rclpy")', "build-type", "has no `setup.py`"),
    "two_types": (
        changed(SENSORS, "package.xml", "<export>", "<export><build_type>ament_cmake</build_type>"),
        'expect_depends("rclpy")',
        "build-type",
        "`ament_cmake` and `ament_python`",
    ),
    "unused_cmake": (
        {**SENSORS, "CMakeLists.txt": ""},
        'expect_depends("std_msgs")',
        "package-depend",
        "does not name `std_msgs`",
    ),
    "no_marker": (without(SENSORS, "resource/NAME"), EXPECT, "package-file", "resource/"),
    "no_module_folder": (
        changed(SENSORS, "setup.py", 'packages=["NAME"]', 'packages=["nme"]'),
        EXPECT,
        "package-file",
        "`nme`",
    ),
    "error_in_setup": (
        changed(SENSORS, "setup.py", 'version="0.1.0",', "version=VERSION,"),
        EXPECT,
        "setup-py",
        "VERSION",
    ),
    "no_setup_cfg": (without(SENSORS, "setup.cfg"), RUNS, "executable-place", "`bin`"),
    "other_section": (
        changed(SENSORS, "setup.cfg", "[install]", "[installation]"),
        RUNS,
        "executable-place",
        "below `[install]`",
    ),
    "other_folder": (
        changed(SENSORS, "setup.cfg", "install_scripts=$base/lib/NAME", "install_scripts=$base/lib/other"),
        RUNS,
        "executable-place",
        "installed in `lib/other`",
    ),
    "no_dollar": (
        changed(SENSORS, "setup.cfg", "install_scripts=$base", "install_scripts=base"),
        RUNS,
        "executable-place",
        "another place",
    ),
    "no_colon": (
        changed(SENSORS, "setup.py", "speed_sensor = NAME.sensor:main", "speed_sensor = NAME.sensor.main"),
        RUNS,
        "entry-point-target",
        "no `:`",
    ),
    "no_packages": (
        changed(SENSORS, "setup.py", '    packages=["NAME"],\n', ""),
        EXPECT,
        "setup-py",
        "does not name the Python package",
    ),
    "pattern": (
        changed(SENSORS, "setup.py", '["launch/car.launch.yaml"]', '["launch/*.yaml"]'),
        EXPECT,
        "package-file",
        "from glob import glob",
    ),
    "folder": (
        changed(SENSORS, "setup.py", '["launch/car.launch.yaml"]', '["launch"]'),
        EXPECT,
        "package-file",
        'no file of that name. If it is a folder, its files have to be named: `glob("launch/*")`',
    ),
    "no_comma": (
        changed(SENSORS, "setup.py", ":main", ":main lamp = NAME.sensor:main"),
        EXPECT,
        "setup-py",
        "arguments setuptools accepts",
    ),
    "misspelt_entry": (
        changed(SENSORS, "setup.py", "speed_sensor =", "speed_senser ="),
        RUNS,
        "entry-point",
        "speed_senser",
    ),
    "lost_module": (
        changed(SENSORS, "setup.py", ".sensor:main", ".sensors:main"),
        RUNS,
        "entry-point-target",
        "These modules are installed: `lost_module.sensor`",
    ),
    "module_with_py": (
        changed(SENSORS, "setup.py", ".sensor:main", ".sensor.py:main"),
        RUNS,
        "entry-point-target",
        "named without `.py`: `module_with_py.sensor:main`",
    ),
    "module_without_folder": (
        changed(SENSORS, "setup.py", "NAME.sensor:main", "sensor:main"),
        RUNS,
        "entry-point-target",
        "it is `module_without_folder.sensor:main`",
    ),
    "other_function": (
        changed(SENSORS, "setup.py", ":main", ":rclpy"),
        'expect_executable("speed_sensor", target="other_function.sensor:main")',
        "entry-point-target",
        "not to `other_function.sensor:main`",
    ),
    "script_alone": (
        {
            **changed(SENSORS, "setup.py", 'entry_points={"console_', 'scripts=["speed_sensor"], entry_points={"gui_'),
            "speed_sensor": "#!/usr/bin/env python3\n",
        },
        RUNS,
        "entry-point",
        "`lib/script_alone/speed_sensor` is installed, but not by an entry point",
    ),
    "lost_function": (changed(SENSORS, "setup.py", ":main", ":run"), RUNS, "entry-point-target", "`run`"),
    "launch_left_out": (
        changed(SENSORS, "setup.py", '("share/NAME/launch", ["launch/car.launch.yaml"]),', ""),
        'expect_installed("share/launch_left_out/launch/car.launch.yaml")',
        "not-installed",
        "car.launch.yaml",
    ),
    "not_needed": (SENSORS, 'expect_depends("rclpy", "std_msgs")', "package-depend", "`std_msgs`"),
    "imported": (SENSORS, 'expect_depends("rclpy")', "package-depend", "`sensor.py` imports it."),
    "to_build": (
        changed(INTERFACES, "package.xml", "<buildtool_depend>rosidl_default_generators</buildtool_depend>", ""),
        'expect_depends("std_msgs", to_build=("std_msgs", "rosidl_default_generators"))',
        "package-depend",
        "to build it. For that it names: `ament_cmake`, `std_msgs`. It needs `<buildtool_depend>",
    ),
    "neither": (
        changed(INTERFACES, "package.xml", "<depend>std_msgs</depend>", ""),
        DEPENDS,
        "package-depend",
        "It needs `<depend>std_msgs</depend>`.",
    ),
    "at_run_alone": (
        changed(INTERFACES, "package.xml", "<depend>std_msgs</depend>", "<exec_depend>std_msgs</exec_depend>"),
        DEPENDS,
        "package-depend",
        "It needs `<build_depend>std_msgs</build_depend>`.",
    ),
    "to_build_alone": (
        changed(INTERFACES, "package.xml", "<depend>std_msgs</depend>", "<build_depend>std_msgs</build_depend>"),
        DEPENDS,
        "package-depend",
        "It needs `<exec_depend>std_msgs</exec_depend>`.",
    ),
    "marker_left_out": (
        changed(SENSORS, "setup.py", '("share/ament_index/resource_index/packages", ["resource/NAME"]),', ""),
        'expect_installed("share/ament_index/resource_index/packages/marker_left_out")',
        "not-installed",
        "setup.py does not install",
    ),
    "float": (changed(INTERFACES, "msg/Thing.msg", "float32", "float"), EXPECT, "interface-line", "float x"),
    "msg_in_type": (
        changed(INTERFACES, "msg/Things.msg", "std_msgs/Header", "std_msgs/msg/Header"),
        EXPECT,
        "interface-line",
        "is not accepted: 'std_msgs/msg/Header'.",
    ),
    "blank_first": (
        changed(INTERFACES, "msg/Thing.msg", "float32", "  float32"),
        EXPECT,
        "interface-line",
        "begins with a blank",
    ),
    "capital": (changed(INTERFACES, "msg/Thing.msg", "label", "Label"), EXPECT, "interface-line", "string Label"),
    "one_part": (changed(INTERFACES, "srv/Count.srv", "---\n", ""), EXPECT, "interface-parts", "---"),
    "no_such_file": (
        changed(INTERFACES, "CMakeLists.txt", "msg/Thing.msg", "msg/Thin.msg"),
        EXPECT,
        "interface-file",
        "Thin",
    ),
    "header_alone": (
        changed(INTERFACES, "msg/Things.msg", "std_msgs/", ""),
        EXPECT,
        "interface-type",
        "A message of another package is written with that package",
    ),
    "message_left_out": (
        changed(INTERFACES, "CMakeLists.txt", '  "msg/Thing.msg"\n', ""),
        EXPECT,
        "interface-type",
        "names no `msg/Thing.msg`",
    ),
    "no_dependency": (
        changed(INTERFACES, "CMakeLists.txt", "  DEPENDENCIES std_msgs)", ")"),
        EXPECT,
        "interface-dependency",
        "Is `std_msgs` the right name of a package? If so, name it in the last line there: `DEPENDENCIES std_msgs`.",
    ),
    "not_found": (
        changed(INTERFACES, "CMakeLists.txt", "find_package(std_msgs REQUIRED)\n", ""),
        EXPECT,
        "cmake-package",
        "Is `std_msgs` the right name of a package? If so, put `find_package(std_msgs REQUIRED)`",
    ),
    "no_generators": (
        changed(INTERFACES, "CMakeLists.txt", "find_package(rosidl_default_generators REQUIRED)\n", ""),
        EXPECT,
        "cmake-package",
        "rosidl_generate_interfaces",
    ),
    "no_group": (
        changed(INTERFACES, "package.xml", "<member_of_group>rosidl_interface_packages</member_of_group>", ""),
        EXPECT,
        "interface-group",
        "package of interfaces",
    ),
    "no_project_name": (
        changed(INTERFACES, "CMakeLists.txt", "rosidl_generate_interfaces(NAME", "rosidl_generate_interfaces(${NAM}"),
        EXPECT,
        "cmake",
        "line 6",
    ),
    "typo_at_the_end": (
        changed(INTERFACES, "CMakeLists.txt", "ament_package()", "ament_pakage()"),
        EXPECT,
        "cmake-package",
        "`ament_pakage`: it is misspelt, or",
    ),
    "typo_in_cmake": (changed(INTERFACES, "CMakeLists.txt", "project(", "projekt("), EXPECT, "cmake", "line 2"),
}

ALIKE = (
    "no_license",
    "no_packages",
    "no_dollar",
    "no_colon",
    "no_comma",
    "header_alone",
    "msg_in_type",
    "other_folder",
    "other_function",
    "lost_function",
    "capital",
    "no_generators",
    "typo_at_the_end",
    "typo_in_cmake",
)
"""Cases whose code another one has, too."""

GOOD_SENSORS = {
    **changed(SENSORS, "setup.py", '["speed_sensor =', '["lamp = NAME:main", "speed_sensor ='),
    "NAME/__init__.py": "def main():\n    print('on')\n",
}
SET_UP = "from autograder.checks import Program, build, launch, launch_file\nfrom std_msgs.msg import Int64, String\n"
GOOD = {
    "sensors": """with build("good_sensors") as package:
    package.expect_built()
    package.expect_executable("speed_sensor")
    package.expect_executable("lamp", target="good_sensors:main")
    package.expect_installed("share/good_sensors/package.xml")
with launch(Program("speed_sensor", package="good_sensors"), listen=[("/speed", Int64)]) as ros:
    ros.node("/sensor").expect()
    ros.topic("/speed", Int64).expect_messages(at_least=3)
with launch_file("car.launch.yaml", package="good_sensors") as ros:
    ros.node("/front").expect()
ros.score(1)""",
    "interfaces": """with build("good_interfaces") as package:
    package.expect_interface("msg/Things", {"header": "std_msgs/Header", "things": "Thing[]"})
    package.expect_interface("srv/Count", {"label": "string"}, {"count": "int32"})
with launch("counter", packages=["good_interfaces"], listen=[("/counted", String)]) as ros:
    ros.topic("/counted", String).expect_messages(at_least=1, where=lambda m: m.data == "2 of car")
ros.score(1)""",
    "float for int": """with launch("halves", packages=["good_interfaces"], listen=[("/counted", String)]) as ros:
    ros.topic("/counted", String).expect_messages(at_least=1, where=lambda m: m.data == "2 of car", within=60)
ros.score(1)""",
    "fields": """with build("good_interfaces") as package:
    package.expect_interface("msg/Thing", {"label": "string", "x": "float64"})
package.score(1)""",
    "not there": 'with build("nothing") as package:\n    package.expect_built()\npackage.score(1)',
}
COUNTER = """import rclpy
from good_interfaces.msg import Thing, Things
from good_interfaces.srv import Count
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("counter")
publisher = node.create_publisher(String, "counted", 10)


def count(request, response):
    things = Things(things=[Thing(label="car"), Thing(label="car"), Thing(label="tree")])
    response.count = sum(thing.label == request.label for thing in things.things)
    return response


node.create_service(Count, "count", count)
client = node.create_client(Count, "count")
client.wait_for_service()


def ask():
    answer = client.call_async(Count.Request(label="car"))
    answer.add_done_callback(lambda done: publisher.publish(String(data=f"{done.result().count} of car")))


node.create_timer(0.2, ask)
rclpy.spin(node)
"""
HOSTILE = {
    "looks_around": """import os, socket, sys
got = []
for name, do in {
    "network": lambda: socket.create_connection(("127.0.0.1", 22), 1),
    "datagram": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).connect(("192.0.2.1", 9)),
    "sources": lambda: open("/home/student/written", "w"),
    "answers": lambda: os.listdir("/home/student/../../ROOT/solutions"),
    "kit": lambda: os.listdir("ROOT/autograder"),
    "namespace": lambda: os.unshare(0x10000000) if hasattr(os, "unshare") else int("x"),
}.items():
    try:
        do()
    except Exception:
        continue
    got.append(name)
print("GOT", got, file=sys.stderr)
""",
    "forks": "import os\nwhile True:\n    os.fork()\n",
    "fills_memory": "hoard = []\nwhile True:\n    hoard.append(bytearray(1 << 24))\n",
    "fills_disk": "f = open('/tmp/x', 'wb')\nwhile True:\n    f.write(bytes(1 << 20))\n",
    "prints": "while True:\n    print('x' * 1000)\n",
    "false_archive": """import os, sys, tarfile, io
for descriptor in range(1, 20):
    try:
        with tarfile.open(fileobj=os.fdopen(os.dup(descriptor), "wb"), mode="w|") as tar:
            for name in ("false_archive/../../written", "/tmp/written", "false_archive/share/x"):
                info = tarfile.TarInfo(name)
                info.size = 1
                tar.addfile(info, io.BytesIO(b"x"))
    except Exception:
        pass
""",
}
"""By name, a setup.py."""
HOSTILE_CHECK = """with build("NAME") as package:
    package.expect_built()
import os, re
from autograder.checks import outcomes
written = [name for name in os.listdir("/tmp") if name == "written"]
outcomes.passed(f"WRITTEN {written} {re.findall('GOT .*', package.log)[:1]}")
package.score(1)"""


@pytest.fixture(scope="module")
def found(request: pytest.FixtureRequest) -> dict[str, CheckResult]:
    """What each case came to; all of them in one submission, since no package knows of another."""
    files = {"counter.py": COUNTER}
    checks = {}
    for name, (case, expectation, _, _) in CASES.items():
        if name in ALIKE and not request.config.getoption("complete"):
            continue
        files |= package(name, case)
        checks[name] = f'with build("{name}") as package:\n    package.{expectation}\npackage.score(1)'
    files |= package("good_sensors", GOOD_SENSORS) | package("good_interfaces", INTERFACES)
    for name, setup in HOSTILE.items():
        files |= package(name, {**SENSORS, "setup.py": setup.replace("ROOT", str(ROOT))})
        checks[name] = HOSTILE_CHECK.replace("NAME", name)
    files["halves.py"] = COUNTER.replace("sum(", "0.5 * sum(").replace("counter", "halves")
    checks |= GOOD
    cells = [Cell(grade_id=name, points=1, source=source) for name, source in checks.items()]
    what: dict[str, Any] = {"files": files, "cells": [Cell(grade_id="set_up", source=SET_UP), *cells]}
    isolation = Isolation.FULL if preflight().full else Isolation.NONE
    job = Job(student="ann", lab="lab", digest="0", isolation=isolation, seed=1, **what)
    return {check.grade_id: check for check in run_in_workers(job, 2).checks}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.complete) if name in ALIKE else name for name in CASES]
)
def test_a_package_that_is_not_as_it_should_be_is_told_why(found: dict[str, CheckResult], name: str) -> None:
    _, _, code, words = CASES[name]
    if code == "build-files" and not preflight().full:
        pytest.skip(preflight().why_not_full)
    first = next(one for one in found[name].outcomes if one.because)
    assert found[name].points == 0
    assert first.code == code, first
    assert words in f"{first.because} {first.hint}", first


def test_a_package_is_built_and_run_and_launched_from_where_it_is_installed(found: dict[str, CheckResult]) -> None:
    assert found["sensors"].points == 1, found["sensors"]


def test_interfaces_are_built_and_a_program_uses_them(found: dict[str, CheckResult]) -> None:
    assert found["interfaces"].points == 1, found["interfaces"]


def test_a_field_with_a_value_of_another_type_ends_a_program_and_that_is_told(found: dict[str, CheckResult]) -> None:
    first = next(one for one in found["float for int"].outcomes if one.because)
    assert "a field of type `int` holds a value of another type" in first.because, first


def test_a_field_of_another_type_is_named(found: dict[str, CheckResult]) -> None:
    first = found["fields"].outcomes[0]
    assert (first.code, found["fields"].points) == ("interface-fields", 0)
    assert "`x` as `float32`, not as `float64`" in first.because


def test_a_package_that_nobody_wrote_is_said_to_be_missing(found: dict[str, CheckResult]) -> None:
    assert "no package `nothing`" in found["not there"].outcomes[0].because


def test_a_build_is_used_again_for_the_same_files_and_for_no_others() -> None:
    refused = changed(INTERFACES, "package.xml", "</package>", "")  # by colcon, at once and for a reason that is known
    other = {**refused, "msg/Thing.msg": "string label\n"}
    cells = [Cell(grade_id="check", points=1, source='with build("things") as package:\n    package.expect_built()')]

    def built(files: Mapping[str, str]) -> dict[str, Any]:
        what: dict[str, Any] = {"files": package("things", files) | package("unused", files), "cells": cells}
        isolation = Isolation.FULL if preflight().full else Isolation.NONE
        return with_interfaces(Job(student="ann", lab="lab", digest="0", isolation=isolation, seed=1, **what), 1).built

    (first,), (again,), (different,) = (list(built(files).items()) for files in (refused, refused, other))
    assert first[0] == again[0] and first[1] is again[1]
    assert different[0] != first[0] and different[1] is not first[1]


def test_without_a_compiler_nothing_is_decided_and_the_reason_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, text in package("things", INTERFACES).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setenv("PATH", str(tmp_path))
    current.check.configure(tmp_path, Isolation.NONE, 1)
    with build("things") as things, things.part("a part"):
        things.expect_built()
    score = things.score({"a part": 1})
    current.check.configure(tmp_path, Isolation.NONE, 1)
    assert score.result.points is None
    assert [one.status for one in score.result.outcomes] == [Status.UNKNOWN]
    assert "a C compiler" in score.result.outcomes[0].because


def test_every_code_of_a_build_has_a_case() -> None:
    seen = {code for _, _, code, _ in CASES.values()}
    codes = {kind.code for kind in all_kinds().values() if kind.group is Group.BUILDING}
    assert codes - seen <= {"build-failed", "build-time", "build-limit"}


@pytest.mark.skipif(not preflight().full, reason="without full isolation a build is a plain process")
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_build_is_ended_and_reaches_nothing(found: dict[str, CheckResult], name: str) -> None:
    check = found[name]
    assert check.points == 0, check
    told = check.outcomes[-1].title
    assert "WRITTEN []" in told
    assert name != "looks_around" or "GOT []" in told, told
    assert name != "forks" or "limit of processes" in check.outcomes[0].because, check.outcomes[0]


NAPS = """import time
while True:
    until = time.process_time() + 0.01
    while time.process_time() < until:
        pass
    time.sleep(0.15)
"""
"""Takes little of a CPU and never rests for long, so that neither says that it goes on without end."""
BUILDS = """
import os, sys
from pathlib import Path
from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.sandbox import build
build.BUILD_SECONDS = 15.0
os.sched_setaffinity(0, {int(sys.argv[2])})
try:
    print(build.build_packages(Path(sys.argv[1]), ["naps"], Isolation.NONE).over)
except KitError as error:
    print(error.what)
"""


def built_in_short_time(folder: Path, cpu: str) -> str:
    """What is said of a build that has 15 s, and goes on without end."""
    for name, text in package("naps", {**SENSORS, "setup.py": NAPS}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    command = [sys.executable, "-c", BUILDS, str(folder / "src"), cpu]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT).stdout.strip()


def test_a_build_that_hardly_does_anything_has_taken_too_long_and_not_been_kept_from_it(tmp_path: Path) -> None:
    found = built_in_short_time(tmp_path, str(max(os.sched_getaffinity(0))))
    if found != "time" and os.getloadavg()[0] > 8 * len(os.sched_getaffinity(0)):
        pytest.skip("this machine had too much else to do, so the build was kept from it indeed")
    assert found == "time"


def test_a_build_that_others_kept_from_the_cpu_has_not_taken_too_long(tmp_path: Path, crowded_cpu: str) -> None:
    assert "because this machine was too busy" in built_in_short_time(tmp_path, crowded_cpu)


def test_a_build_about_which_nothing_is_known_raises_a_flag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, text in package("sensors", SENSORS).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(sandbox_build._Watched, "had_no_chance", True)
    monkeypatch.setattr(sandbox_build, "BUILD_SECONDS", 0.1)
    current.check.configure(tmp_path, Isolation.NONE, 1)
    with build("sensors") as sensors:
        sensors.expect_built()
    score = sensors.score(1)
    assert score.result.points is None
    assert len(score.result.flags) == 1 and "too busy" in score.result.flags[0]


@pytest.mark.parametrize(
    "setup",
    [
        "import os\nos.kill(os.getpid(), 9)\n",
        "import os\nos.write(2, b'c++: fatal error: Killed signal terminated program cc1plus')\nos._exit(1)\n",
        "import os\nos.write(2, b'cc1: error: /tmp/x.s: No space left on device')\nos._exit(1)\n",
    ],
)
def test_a_build_that_the_system_ends_each_time_costs_nothing_and_raises_a_flag(tmp_path: Path, setup: str) -> None:
    for name, text in package("sensors", {**SENSORS, "setup.py": setup}).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    current.check.configure(tmp_path, Isolation.NONE, 1)
    with build("sensors") as sensors:
        sensors.expect_built()
    score = sensors.score(1)
    assert score.result.points is None and len(score.result.flags) == 1, score.result
    assert "this says nothing about `sensors`" in score.result.outcomes[0].because


def test_a_name_that_no_text_can_say_is_left_out_of_what_was_built() -> None:
    archive = io.BytesIO()
    with tarfile.open(fileobj=archive, mode="w", errors="surrogateescape") as tar:
        for name in ("car/share/odd\udcff", "car/share/plain"):
            tar.addfile(tarfile.TarInfo(name))
    run = sandbox_build._finished(SandboxRun(archive.getvalue(), "", 0, False), sandbox_build._Watched())
    assert list(BuildRun.model_validate_json(run.model_dump_json()).installed) == ["car/share/plain"]
