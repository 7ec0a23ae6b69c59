"""Finds out by a trial which isolation this machine offers, and refuses to grade with less than was requested."""

from __future__ import annotations

import functools
import os
import platform
import sys
from dataclasses import dataclass
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.sandbox.grading_sandbox import run_in_sandbox
from autograder.sandbox.walls import bubblewrap, landlock

_TIME_LIMIT = 60.0


@dataclass(frozen=True)
class Preflight:
    """The isolation that this machine offers, and why it does not offer more."""

    full: bool
    reduced: bool
    why_not_full: str = ""
    do: str = ""
    """What the user can do to get full isolation."""


@functools.cache
def preflight() -> Preflight:
    """Try a program in the two nested sandboxes, exactly as grading does.

    This takes about half a second, but only once.
    """
    why = _why_not_full()
    return Preflight(full=not why, reduced=_reduced(), why_not_full=why, do=_remedy(why) if why else "")


def choose(wanted: Isolation) -> Isolation:
    """Return `wanted` if this machine offers it. The isolation is never weakened silently.

    Raises:
        KitError: the machine does not offer it. The message says what to do, and which weaker isolation is available.
    """
    if wanted is Isolation.NONE:
        return wanted
    found = preflight()
    if wanted is Isolation.FULL and not found.full:
        weaker = "--isolation reduced" if found.reduced else "--isolation none"
        raise KitError(
            f"Students' programs cannot be isolated on this machine: {found.why_not_full}",
            f"{found.do} Or accept less, at your own risk: {weaker} (it is recorded in every result).",
        )
    if wanted is Isolation.REDUCED and not found.reduced:
        raise KitError(
            "This kernel offers no Landlock of version 6 or later, which reduced isolation needs.",
            "Use Linux 6.12 or later, full isolation, or, at your own risk, --isolation none.",
        )
    return wanted


def most() -> tuple[Isolation, str]:
    """Return the strongest isolation that this machine offers, and why it is not full.

    This is for users who run their own programs.
    """
    found = preflight()
    if found.full:
        return Isolation.FULL, ""
    return (Isolation.REDUCED if found.reduced else Isolation.NONE), found.why_not_full.rstrip(".")


def _why_not_full() -> str:
    if not sys.platform.startswith("linux") or platform.machine() != "x86_64":
        return f"it is {sys.platform} on {platform.machine()}, not Linux on x86_64"
    if not bubblewrap.bwrap():
        return "bubblewrap is missing from the virtual environment"
    try:
        run = run_in_sandbox(["autograder.sandbox.preflight"], b"", Isolation.FULL, _TIME_LIMIT)
    except OSError as error:
        return f"bubblewrap does not start ({error})"
    if run.status == 0 and run.stdout.strip() == b"isolated":
        return ""
    said = run.stderr.strip().splitlines()
    return said[-1] if said else f"the trial ended with status {run.status}"


def _reduced() -> bool:
    return platform.machine() == "x86_64" and landlock.version() >= landlock.NEEDED_VERSION


def _remedy(why: str) -> str:
    if "virtual environment" in why:
        return "Delete .venv and set up again."
    if _setting("kernel/apparmor_restrict_unprivileged_userns") == "1":
        return "Run `sudo sysctl -w kernel.apparmor_restrict_unprivileged_userns=0`."
    if _setting("kernel/unprivileged_userns_clone") == "0":
        return "Run `sudo sysctl -w kernel.unprivileged_userns_clone=1`."
    if _setting("user/max_user_namespaces") == "0":
        return "Run `sudo sysctl -w user.max_user_namespaces=10000`."
    if Path("/.dockerenv").exists() or Path("/run/.containerenv").exists():
        return (
            "Start the container with user namespaces allowed "
            "(Docker: --security-opt seccomp=unconfined --security-opt systempaths=unconfined)."
        )
    if os.getuid() == 0 and "Permission denied" in why:
        return "Make the virtual environment readable for all (`chmod -R go+rX .venv`), or run as an ordinary user."
    return "Allow unprivileged user namespaces on this machine."


def _setting(name: str) -> str:
    try:
        return (Path("/proc/sys") / name).read_text().strip()
    except OSError:
        return ""
