"""Running Python source in the grading sandbox, as whoever runs the tests and as an ordinary user."""

from __future__ import annotations

import os
import subprocess
import sys

from places import ROOT, TESTS

from autograder.core.results import Isolation
from autograder.sandbox.environment import python_environment
from autograder.sandbox.grading_sandbox import run_in_sandbox
from autograder.sandbox.walls import bubblewrap

ATTACKS = {path.stem: path.read_text() for path in sorted((TESTS / "attacks").glob("*.py"))}
ORDINARY_USER = 12345

RUN_STDIN = ("timeit", "-n1", "-r1", "exec(__import__('sys').stdin.read(), {})")
"""A module that everyone has, and that runs what it reads."""


def in_sandbox(source: str, time_limit: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run Python source in the grading sandbox, through a module that everyone has."""
    run = run_in_sandbox([*RUN_STDIN], source.encode(), Isolation.FULL, time_limit)
    return subprocess.CompletedProcess([], run.status, run.stdout.decode(), run.stderr)


def as_ordinary_user(source: str, time_limit: float = 600.0) -> str:
    """Run Python source outside any sandbox, as a user that owns nothing; return what it prints."""
    if os.getuid() != 0:
        command = [sys.executable, "-c", source]
        return subprocess.run(command, capture_output=True, text=True, timeout=time_limit, cwd=ROOT, check=False).stdout
    environment = {**python_environment(), "PYTHONPATH": str(ROOT), "HOME": "/tmp"}
    become = (
        f"import os,sys;os.setgroups([]);os.setresgid({ORDINARY_USER},{ORDINARY_USER},{ORDINARY_USER});"
        f"os.setresuid({ORDINARY_USER},{ORDINARY_USER},{ORDINARY_USER});"
        f"os.execve(sys.executable,[sys.executable,'-c',sys.stdin.read()],{environment!r})"
    )
    # A world-writable /tmp of its own, since this user may write nowhere else.
    options = bubblewrap.options_for_root()
    place = options.index("--tmpfs")
    options[place:place] = ["--perms", "1777"]
    process = bubblewrap.start_bwrap(
        options, [sys.executable, "-c", become],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    out, error = process.communicate(source.encode(), timeout=time_limit)
    return out.decode() + error.decode()
