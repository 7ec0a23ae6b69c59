"""Of each part that the kit starts for itself, just that fails: a right student loses nothing.

Points are lost only if a check says so of the student. What cannot be found out stays undecided, with the reason, or is
found out at another try.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from broken_machine import graded, job_of, lost, result_of, started
from ros_packages import INTERFACES, SENSORS, changed, package
from side_by_side import USERS, as_user

from autograder.core.results import Isolation, SubmissionResult
from autograder.grading.job import Job
from autograder.sandbox.isolation import preflight

pytestmark = pytest.mark.skipif(not preflight().full, reason=f"no full isolation here: {preflight().why_not_full}")

FILES = {
    **package("sensors", SENSORS),
    **package("interfaces", INTERFACES),
    "talk.py": "import time\nprint('hello', flush=True)\ntime.sleep(2)\n",
}
LAUNCH = """from autograder.checks import launch
with launch("talk") as ros:
    ros.program("talk").expect_exit(status=0, within=60)
ros.score(1)"""
BUILD = """from autograder.checks import build
with build("NAME") as package:
    package.expect_built()
package.score(1)"""
CHECKS = {
    "launch": LAUNCH,
    "python": BUILD.replace("NAME", "sensors"),
    "interfaces": BUILD.replace("NAME", "interfaces"),
}
WAITS = """import signal, threading
replaced = threading.Event()
signal.signal(signal.SIGWINCH, lambda *_: replaced.set())
assert replaced.wait(120)
signal.signal(signal.SIGWINCH, signal.SIG_IGN)
"""
"""The head of a check that begins when this process is told that the files have been replaced."""
SITE = sysconfig.get_path("purelib")
SHARE = str(Path(sysconfig.get_path("data")) / "share")


def right_student(*checks: str) -> Job:
    return job_of(FILES, {name: CHECKS[name] for name in checks})


def compiler() -> str:
    """The program that compiles, below the `cc` that everybody calls."""
    asked = ["cc", "-print-prog-name=cc1"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()


def replaced(path: str) -> list[str]:
    """Options of a machine on which a program does nothing but fail."""
    return ["--ro-bind", "/bin/false", str(Path(path).resolve())]


LACKS: dict[str, tuple[str, Callable[[], list[str]]]] = {
    # what is broken: (the check that cannot be decided, how)
    "colcon": ("python", lambda: ["--tmpfs", f"{SITE}/colcon_core"]),
    "setuptools": ("python", lambda: ["--tmpfs", f"{SITE}/setuptools"]),
    "cmake": ("interfaces", lambda: replaced(shutil.which("cmake") or "")),
    "compiler": ("interfaces", lambda: replaced(compiler())),
    "make": ("interfaces", lambda: replaced(shutil.which("make") or "")),
    "generators": ("interfaces", lambda: ["--tmpfs", f"{SHARE}/rosidl_default_generators"]),
}


@pytest.mark.parametrize("part", LACKS)
def test_what_a_build_needs_is_broken_and_nothing_is_held_against_the_package(part: str) -> None:
    check, options = LACKS[part]
    result = graded(right_student("launch", check), options())
    assert points(result) == {"launch": 1.0, check: None}, result
    because = result.checks[1].first_failure
    assert because is not None and "machine" in because.because, because


def test_a_wrong_package_is_still_wrong_if_the_tools_say_nothing_of_its_files() -> None:
    wrong = changed(SENSORS, "setup.py", 'version="0.1.0",', "version=VERSION,")
    result = graded(job_of(package("sensors", wrong), {"python": CHECKS["python"]}))
    assert points(result) == {"python": 0.0}
    assert "VERSION" in result.checks[0].outcomes[0].because


def test_files_of_etc_that_are_replaced_while_a_submission_is_graded_cost_nothing(tmp_path: Path) -> None:
    etc = tmp_path / "etc"
    shutil.copytree("/etc", etc, symlinks=True, ignore=lambda _, names: [name for name in names if "shadow" in name])
    checks = {"wait": WAITS + LAUNCH, "python": CHECKS["python"], "launch": LAUNCH}
    job = job_of(FILES, checks)
    process = started(job, ["--bind", str(etc), "/etc"])

    def replace(worker: psutil.Process) -> None:
        for name in REPLACED:
            (etc / name).unlink(missing_ok=True)
        with contextlib.suppress(psutil.Error):
            while process.poll() is None:  # a signal that comes before somebody waits for it is ignored
                worker.send_signal(signal.SIGWINCH)
                time.sleep(0.05)

    with at_once(process, "worker", replace) as seen:
        result = result_of(process, job)
    assert seen
    assert points(result) == {"wait": 1.0, "python": 1.0, "launch": 1.0}, result


def test_where_a_process_may_open_too_few_files_nothing_is_held_against_the_program() -> None:
    result = graded(right_student("launch"), words=["prlimit", "--nofile=40"])
    assert points(result) == {"launch": None}, result


SLEEPERS = """import threading, time
for _ in range(180):
    threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
print("all started", flush=True)
time.sleep(600)"""
MANY_THREADS = """import threading, time
for _ in range(100):
    threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
time.sleep(60)
"""
NO_ROOT = pytest.mark.skipif(os.getuid() != 0, reason="only root becomes another user, and has no such limit itself")


@NO_ROOT
def test_what_else_a_user_runs_takes_no_threads_from_the_programs_of_a_launch() -> None:
    """With a browser open the kernel would allow no more, if it counted what runs outside of the launch."""
    node = "import rclpy\nrclpy.init()\nrclpy.create_node('talk')\nprint('made')\n"
    job = job_of({"talk.py": node}, {"launch": LAUNCH}, Isolation.REDUCED)
    sleepers = subprocess.Popen([*as_user(USERS[0]), sys.executable, "-c", SLEEPERS], stdout=subprocess.PIPE, text=True)
    try:
        assert sleepers.stdout is not None and sleepers.stdout.readline()
        result = graded(job, words=as_user(USERS[0]))
    finally:
        sleepers.kill()
        sleepers.communicate()
    assert points(result) == {"launch": 1.0}, result


@NO_ROOT
def test_where_the_machine_allows_too_few_threads_nothing_is_held_against_the_program() -> None:
    job = job_of({"talk.py": MANY_THREADS}, {"launch": LAUNCH}, Isolation.NONE)
    result = graded(job, words=[*as_user(USERS[0]), "prlimit", "--nproc=120"])
    assert points(result) == {"launch": None}, result
    assert "allows no more threads" in result.checks[0].outcomes[0].because


def test_a_program_that_only_says_so_fails() -> None:
    says = 'raise RuntimeError("can\'t start new thread")\n'
    result = graded(job_of({"talk.py": says}, {"launch": LAUNCH}))
    assert points(result) == {"launch": 0.0}, result


REPLACED = ("ld.so.cache", "nsswitch.conf", "localtime", "passwd", "hosts")
KILLED = {
    # which process: (its name, or a word of its command line; the check)
    "fork server": ("autograder.sandbox.fork_server", "launch"),
    "worker": ("worker", "launch"),
    "launcher": ("launcher.py", "launch"),
    "build": ("build_packages.py", "python"),
    "colcon": ("colcon", "python"),
    "builder": ("builder", "interfaces"),
    "cmake": ("cmake", "interfaces"),
    "compiler": ("cc1", "interfaces"),
}
LONG = {("cmake", True), ("compiler", False), ("compiler", True), ("builder", True), ("colcon", True)}


@pytest.mark.parametrize(
    ("part", "always"),
    [
        pytest.param(part, always, marks=pytest.mark.complete if (part, always) in LONG else ())
        for part in KILLED
        for always in (False, True)
    ],
)
def test_a_part_is_killed_and_the_student_loses_nothing(part: str, always: bool) -> None:
    word, check = KILLED[part]
    job = right_student(check)
    process = started(job)
    with at_once(process, word, lambda one: one.kill(), always) as killed:
        result = result_of(process, job)
    assert killed, "it never ran"
    assert lost(result) == {}, result
    if not always:
        assert points(result) == {check: 1.0}, result


def points(result: SubmissionResult) -> dict[str, float | None]:
    return {check.grade_id: check.points for check in result.checks}


@contextlib.contextmanager
def at_once(
    process: subprocess.Popen[str], word: str, do: Callable[[psutil.Process], object], always: bool = False
) -> Iterator[list[int]]:
    """Do something with a descendant of a process as soon as there is one of a name, once or with each of them.

    Gives a list that grows by their numbers.
    """
    seen: list[int] = []
    over = threading.Event()

    def look() -> None:
        while not over.wait(0.02) and (always or not seen):
            with contextlib.suppress(psutil.Error):
                for one in psutil.Process(process.pid).children(recursive=True):
                    if one.pid not in seen and _is(one, word):
                        do(one)
                        seen.append(one.pid)
                        if not always:
                            return

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        yield seen
    finally:
        over.set()
        watcher.join()


def _is(process: psutil.Process, word: str) -> bool:
    """Whether a process is meant by a word: bubblewrap, which has the words of what it starts, is not."""
    with contextlib.suppress(psutil.Error):
        name = process.name()
        return name != "bwrap" and (name == word or any(part.endswith(word) for part in process.cmdline()))
    return False
