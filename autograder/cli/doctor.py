"""The command `autograder doctor`, which reports what this machine offers and how to fix what is missing."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from autograder.core.errors import KitError
from autograder.core.version import VERSION
from autograder.course.paths import course_root
from autograder.notebook.hub import is_on_hub
from autograder.sandbox.environment import profile_environment
from autograder.setup.environment import digest, read_marker
from autograder.setup.interpreter import NEWEST, OLDEST
from autograder.setup.places import ROOT, VENV
from autograder.setup.refusals import SetUpError, refuse_foreign_ros

GIB = 1 << 30
NEEDED_SPACE = 2 * GIB
"""The bytes needed for the results and feedback of a class, and for files that running programs of students write."""
ROS_TIME_LIMIT = 30.0
"""Seconds that importing rclpy and receiving one message may take. Usually it takes about one second."""

# Only a message that arrives proves that rclpy, its middleware and this machine's loopback interface work together.
TRY_ROS = """
import json, importlib.metadata, rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String
found = {"place": rclpy.__file__, "middleware": rclpy.get_rmw_implementation_identifier(), "version": ""}
try:
    found["version"] = importlib.metadata.version("ros-jazzy-rclpy")
except importlib.metadata.PackageNotFoundError:
    pass
rclpy.init()
node = rclpy.create_node("doctor", start_parameter_services=False, enable_rosout=False)
received = []
node.create_subscription(String, "doctor", received.append, 10)
publisher = node.create_publisher(String, "doctor", 10)
node.create_timer(0.05, lambda: publisher.publish(String(data="well")))
executor = SingleThreadedExecutor()
executor.add_node(node)
while not received:
    executor.spin_once(timeout_sec=1.0)
executor.shutdown()
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps(found))
"""

TRY_PROBE = "import json; from autograder.sandbox.inside.probe import attach; print(json.dumps(attach.prepare()))"
"""A program that runs in a separate process, because the probe wraps functions of rclpy."""


IN_CHECKOUT = (ROOT / "Makefile").is_file()
"""Whether the kit runs from a checkout. If not, it was installed from its wheel, and there are no `make` commands."""
ANEW = "make distclean setup" if IN_CHECKOUT else "install the kit again in a new environment"


@dataclass(frozen=True)
class Finding:
    """The result of one test of the machine."""

    name: str
    good: bool
    found: str
    do: str = ""
    """What to do to fix it or, if `good`, to improve something."""


def run(as_json: bool, course: Path | None = None) -> int:
    """Run all tests and print their findings. Return 0 if the machine can grade, and 2 if something is missing.

    Args:
        as_json: print JSON.
        course: the course in whose folder results are written; None means the course around the working folder.

    Raises:
        KitError: there is no such course.
    """
    place = _writes_to(course)

    def space() -> Finding:
        return free_space(place)

    looks = (python, environment, foreign_ros, ros, probe, isolation, cores, compiler, space)
    findings: list[Finding] = []
    for look in looks:
        try:
            findings.append(look())
        except Exception as error:  # the command must finish, especially on a broken machine
            findings.append(Finding(look.__name__, False, f"{type(error).__name__}: {error}", "This is unexpected."))
    healthy = all(finding.good for finding in findings)
    if as_json:
        print(json.dumps({"healthy": healthy, "findings": [asdict(finding) for finding in findings]}, indent=1))
    else:
        show(findings, healthy)
    return 0 if healthy else 2


def show(findings: list[Finding], healthy: bool) -> None:
    """Print the findings as a table, and below it what to do."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 120
    table = Table(show_header=False, box=None, padding=(0, 1))
    for finding in findings:
        mark = Text("✓", "blue") if finding.good else Text("✗ lack", "bold red")
        table.add_row(mark, Text(finding.name, "bold"), Text(finding.found))
    console.print(table)
    for finding in findings:
        if finding.do:
            console.print(Text.assemble("\n", (finding.name, "bold"), ": ", finding.do))
    console.print()
    console.print("This machine can grade." if healthy else "This machine cannot grade yet.")


def python() -> Finding:
    """Check whether there are ROS wheels for this Python."""
    version = platform.python_version()
    good = OLDEST <= sys.version_info[:2] <= NEWEST
    how = "make setup PYTHON=/path/to/python3.12" if IN_CHECKOUT else "install the kit into an environment that has one"
    do = "" if good else f"Use Python 3.11 to 3.14: {how}"
    return Finding("Python", good, f"{version}  {sys.executable}", do)


def environment() -> Finding:
    """Check whether `.venv` is complete and agrees with the lock."""
    name = "environment"
    if Path(sys.prefix).resolve() != VENV:
        return Finding(
            name, True, f"{sys.prefix} ({'not the .venv of the checkout' if IN_CHECKOUT else 'kit ' + VERSION})"
        )
    state = read_marker()
    if not state:
        return Finding(name, False, f"{VENV} is incomplete, or was moved", "Run: make setup")
    old = [lock for lock, made_of in state["locks"].items() if made_of != digest(lock)]
    if old:
        return Finding(name, False, f"{VENV} is older than {' and '.join(old)}", "Run: make setup")
    return Finding(name, True, f"{VENV} agrees with {' and '.join(state['locks'])}")


def foreign_ros() -> Finding:
    """Check whether another ROS distribution is sourced in this shell."""
    try:
        refuse_foreign_ros(os.environ)
    except SetUpError as error:
        return Finding("other ROS", False, error.what, error.do)
    return Finding("other ROS", True, "none is sourced in this shell")


def ros() -> Finding:
    """Check whether rclpy works: import it, and send one message from a publisher to a subscription."""
    name = "ROS 2"
    try:
        process = subprocess.run(
            [sys.executable, "-P", "-c", TRY_ROS],
            env={**os.environ, **profile_environment(), "ROS_DOMAIN_ID": "101"},
            capture_output=True,
            text=True,
            timeout=ROS_TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding(
            name,
            False,
            f"no message arrived in {ROS_TIME_LIMIT:g} s",
            "Check that no firewall blocks UDP on 127.0.0.1.",
        )
    if process.returncode:
        return Finding(name, False, (process.stderr.strip().splitlines() or ["rclpy does not start"])[-1], ANEW)
    found = json.loads(process.stdout.strip().splitlines()[-1])
    place = Path(found["place"])
    if not (place.is_relative_to(sys.prefix) or place.is_relative_to("/opt/ros/jazzy")):
        return Finding(name, False, f"rclpy comes from {place.parent}, not from this environment", ANEW)
    if found["middleware"] != "rmw_fastrtps_cpp":
        return Finding(name, False, f"the middleware is {found['middleware']}", "Run: unset RMW_IMPLEMENTATION")
    where = "this environment" if place.is_relative_to(sys.prefix) else "/opt/ros/jazzy"
    which = f"rclpy {found['version']}".strip()
    return Finding(name, True, f"Jazzy of {where}, {which}, Fast DDS: a message arrived")


def probe() -> Finding:
    """Check whether the probe works, which watches rclpy inside a program in order to explain failed checks.

    The probe uses some private names of rclpy, which a new version may change.
    """
    name = "explanations"
    process = subprocess.run(
        [sys.executable, "-P", "-c", TRY_PROBE],
        env={**os.environ, **profile_environment()},
        capture_output=True,
        text=True,
        timeout=ROS_TIME_LIMIT,
        check=False,
    )
    if process.returncode:
        why = (process.stderr.strip().splitlines() or ["it does not start"])[-1]
        return Finding(name, False, f"the probe cannot attach to rclpy: {why}", "Repair ROS 2 first.")
    moved = json.loads(process.stdout.strip().splitlines()[-1])
    if moved:
        found = f"the probe cannot attach to this rclpy. {moved[0]}"
        found += f" ({len(moved)} such places)" if len(moved) > 1 else ""
        repair = f"Use the locked rclpy ({ANEW}); until then, reports give fewer reasons for failed checks."
        return Finding(name, False, found, repair)
    return Finding(name, True, "the probe attaches to this rclpy")


def isolation() -> Finding:
    """Check how well students' programs can be isolated on this machine."""
    from autograder.sandbox.isolation import preflight

    level = preflight()
    if level.full:
        return Finding("isolation", True, "full: own user, process, IPC and network namespaces")
    found = f"{'reduced' if level.reduced else 'none'}: {level.why_not_full}"
    return Finding("isolation", False, found, level.do)


def cores() -> Finding:
    """Report how many cores this process may use. One core is enough, but slow."""
    count = len(os.sched_getaffinity(0))
    return Finding("cores", True, str(count), "" if count > 1 else "With two or more cores, grading is faster.")


def compiler() -> Finding:
    """Check whether packages with interfaces can be built on this machine. Everything else works without a compiler."""
    from autograder.packages.workspace import INSTALL, missing_tools

    lacking = missing_tools()
    if not lacking:
        return Finding("compiler", True, "C, C++, CMake, make, and Python's headers")
    do = f"Only labs in which interfaces are built need a compiler. {INSTALL}"
    return Finding("compiler", True, f"without {', '.join(lacking)}", do)


def _writes_to(course: Path | None) -> Path:
    """Return the folder in which results are written. The kit of a JupyterHub belongs to nobody who uses it."""
    if course is not None:
        return course_root(course)
    try:
        folder = course_root()
    except KitError:
        return Path.cwd()
    return Path.cwd() if is_on_hub() and not os.access(folder, os.W_OK) else folder


def free_space(folder: Path) -> Finding:
    """Check the free space in the folder in which results are written."""
    free = shutil.disk_usage(folder).free
    do = "" if free >= NEEDED_SPACE else f"Free {NEEDED_SPACE // GIB} GiB; what was built is in {folder / 'build'}."
    if not os.access(folder, os.W_OK):
        return Finding("free space", False, f"{folder} is not writable", "Work in a copy that belongs to you.")
    return Finding("free space", free >= NEEDED_SPACE, f"{free / GIB:.1f} GiB in {folder}", do)
