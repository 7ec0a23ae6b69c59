"""Submissions are forks of one process: none of them finds anything of another, or of what forked it."""

from __future__ import annotations

import json
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from boxes import RUN_STDIN, in_sandbox
from places import ROOT

from autograder.core.results import Isolation
from autograder.sandbox.forks import KILLED, Fork, ForkServer
from autograder.sandbox.grading_sandbox import Stopped, run_in_sandbox, start_fork_server
from autograder.sandbox.isolation import preflight

pytestmark = pytest.mark.skipif(not preflight().full, reason=f"no full isolation here: {preflight().why_not_full}")

MAKE = """
import json, os, socket, sys
open("/tmp/mine", "w").write("x")
open("/dev/shm/mine", "w").write("x")
here = socket.create_server(("127.0.0.1", 34567))
abstract = socket.socket(socket.AF_UNIX); abstract.bind("\\0mine")
"""
LOOK = """
def refused(action):
    try:
        action()
    except OSError as error:
        return error.errno
    return None
def connect(family, address):
    with socket.socket(family) as one:
        one.connect(address)
print(json.dumps({
    "namespaces": {name: os.readlink("/proc/self/ns/" + name) for name in ("user", "pid", "net", "ipc", "uts", "mnt")},
    "files": sorted(os.listdir("/tmp") + os.listdir("/dev/shm")),
    "processes": sorted(int(name) for name in os.listdir("/proc") if name.isdigit()),
    "descriptors": sorted(int(name) for name in os.listdir("/proc/self/fd")),
    "root": [refused(lambda name=name: open(name + "x", "w")) for name in ("/", "/dev/", "/run/")],
    "mount": refused(lambda: os.mkdir("/proc/1/root/x")),
    "privileges": [line.split()[1] for line in open("/proc/self/status") if line.startswith("Cap")],
}), flush=True)
"""


ABOVE = ROOT.parts[2:3] if ROOT.parts[1] == "tmp" else ()
"""What of /tmp a submission sees where the checkout itself lies there: the folder that Python is below."""


def looked(source: str) -> dict[str, Any]:
    run = in_sandbox(source)
    assert run.returncode == 0, run.stderr
    return without_the_way(run.stdout.splitlines()[0])


def without_the_way(line: str | bytes) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(line)
    found["files"] = [name for name in found["files"] if name not in ABOVE]
    return found


def test_two_submissions_share_no_namespace_no_file_and_no_process() -> None:
    server = ForkServer(start_fork_server)
    # Both stay until both have looked: the kernel gives the number of a namespace again once that is gone.
    forks = [server.fork(["timeit", "-n1", "-r1", MAKE + LOOK + "sys.stdin.read()"]) for _ in range(2)]
    one, other = (without_the_way(fork.stdout.readline()) for fork in forks)
    for fork in forks:
        said(fork)
    assert not set(one["namespaces"].values()) & set(other["namespaces"].values())
    for seen in (one, other):
        assert seen["files"] == ["mine", "mine"]  # its own of both places, though the other one made the same
        # These are the first process, the submission's own, and the spare launcher, which may not have come yet.
        assert set(seen["processes"]) <= {1, 2, 3}
        assert set(seen["privileges"]) == {"0" * 16}


def test_nothing_of_one_submission_is_left_for_the_next() -> None:
    looked(MAKE + LOOK)
    seen = looked(MAKE.splitlines()[1] + LOOK)
    assert seen["files"] == []


def test_a_submission_writes_nowhere_but_in_places_of_its_own_and_holds_no_channel() -> None:
    seen = looked(MAKE.splitlines()[1] + LOOK)
    assert None not in seen["root"] and seen["mount"] is not None
    # One of the last two is the socket to the submission's own spare launcher, the other that of the listing itself.
    assert set(seen["descriptors"]) <= {0, 1, 2, 3, 4}


def test_a_submission_that_is_stopped_leaves_the_others_alone() -> None:
    stop = threading.Event()

    def stopped() -> bool:
        try:
            run_in_sandbox([*RUN_STDIN], b"import time; time.sleep(600)", Isolation.FULL, 600.0, stop)
        except Stopped:
            return True
        return False

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(stopped)
        second = pool.submit(in_sandbox, "import sys, time\nprint('fine')\n")
        assert second.result().stdout.startswith("fine")
        stop.set()
        assert first.result()


def test_where_the_server_was_killed_another_one_serves() -> None:
    servers: list[subprocess.Popen[bytes]] = []

    def start(channel: int, stderr: int) -> subprocess.Popen[bytes]:
        servers.append(start_fork_server(channel, stderr))
        return servers[-1]

    server = ForkServer(start)
    assert said(server.fork(["timeit", "-n1", "-r1", "print('one')"])).startswith("one")
    waiting = server.fork(["timeit", "-n1", "-r1", "print('two', flush=True)\nimport time\ntime.sleep(600)"])
    assert waiting.stdout.read(3) == b"two"
    servers[0].kill()
    assert waiting.wait(120) == KILLED and waiting.begun and waiting.lost
    server.gone()
    assert said(server.fork(["timeit", "-n1", "-r1", "print('three')"])).startswith("three")
    servers[1].kill()


def test_a_server_that_ends_for_want_of_work_loses_no_request() -> None:
    def start(channel: int, stderr: int) -> subprocess.Popen[bytes]:
        return start_fork_server(channel, stderr, idle=0.0)

    server = ForkServer(start)
    for number in range(20):
        assert said(server.fork(["timeit", "-n1", "-r1", f"print({number})"])).startswith(f"{number}\n")


def test_a_server_that_does_not_begin_says_why() -> None:
    def start(channel: int, stderr: int) -> subprocess.Popen[bytes]:
        command = ["sh", "-c", "echo no sandbox here >&2; exit 1"]
        return subprocess.Popen(command, pass_fds=(channel,), stderr=stderr)

    server = ForkServer(start)
    fork = server.fork(["timeit"])
    assert fork.wait(120) == KILLED and fork.lost and not fork.begun
    assert server.gone() == "no sandbox here\n"


def said(fork: Fork) -> str:
    fork.stdin.close()
    text = fork.stdout.read()
    assert fork.wait(120) == 0, fork.stderr.read()
    return bytes(text).decode()
