# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
# ruff: noqa: UP031, UP035
"""Refuse a machine that lacks something. Each refusal says what is missing and what to do about it."""

import os
import platform
import re
import shutil
import sys
from pathlib import Path
from typing import Mapping

from autograder.setup.places import ROOT

ROS_DISTRIBUTION = "jazzy"
ROS_PATHS = ("PYTHONPATH", "AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH")
NO_NETWORK = re.compile(
    r"NewConnectionError|ConnectTimeout|ConnectionError|ReadTimeout|NameResolutionError|Temporary failure in name"
    r"|Network is unreachable|No route to host|Connection refused|ProxyError|dns error|error sending request"
    r"|tcp connect error",
    re.IGNORECASE,
)
NO_SPACE = re.compile(r"No space left on device|Disk quota exceeded", re.IGNORECASE)
FULL_DISK = 16 << 20  # bytes


class SetUpError(Exception):
    """An error of set-up with two sentences for a person: what the problem is, and what to do about it."""

    def __init__(self, what: str, do: str) -> None:
        """Store two sentences: what the problem is, and what to do about it."""
        super().__init__(what)
        self.what = what
        self.do = do


def foreign_ros(environ: Mapping[str, str]) -> str:
    """Return a text that says which variable shows that another ROS distribution is sourced; empty if none does."""
    for name in ROS_PATHS:
        for found in re.finditer(r"/opt/ros/([a-z]+)", environ.get(name, "")):
            if found.group(1) != ROS_DISTRIBUTION:
                return "%s names %s" % (name, found.group(0))
    distribution = environ.get("ROS_DISTRO", ROS_DISTRIBUTION)
    return "" if distribution == ROS_DISTRIBUTION else "ROS_DISTRO is %s" % distribution


def refuse_foreign_ros(environ: Mapping[str, str]) -> None:
    """Raise SetUpError if another ROS distribution is sourced, because its rclpy would be imported instead of ours."""
    where = foreign_ros(environ)
    if where:
        unset = " ".join("-u " + name for name in (*ROS_PATHS, "ROS_DISTRO") if name in environ)
        raise SetUpError(
            "Another ROS distribution is sourced in this shell: %s. This course runs on ROS 2 Jazzy." % where,
            "Open a terminal that does not source it (look for /opt/ros in ~/.bashrc), or run the command once with\n"
            "  env %s make ..." % unset,
        )


def refuse_other_machines() -> None:
    """Raise SetUpError if the ROS 2 wheels do not run here. They need Linux on x86_64 with glibc 2.28 or newer."""
    library, version = platform.libc_ver()
    if not sys.platform.startswith("linux") or platform.machine() not in ("x86_64", "AMD64"):
        found = "this is %s on %s" % (platform.system(), platform.machine())
    elif library != "glibc":
        found = "the C library of this machine is not glibc"
    elif tuple(int(part) for part in version.split(".")[:2]) < (2, 28):
        found = "this machine has glibc %s" % version
    else:
        return
    raise SetUpError(
        "The ROS 2 packages exist for Linux on x86_64 with glibc 2.28 or newer; %s." % found,
        "Use such a machine, WSL 2 on Windows, or the container described in .devcontainer.",
    )


def refuse_closed_folder(folder: Path) -> None:
    """Raise SetUpError if this user is not allowed to write to `folder`."""
    if not os.access(str(folder), os.W_OK):
        raise SetUpError(
            "This user may not write to %s." % folder,
            "Work in a copy that belongs to you, or take the folder over: sudo chown -R \"$USER\" '%s'" % ROOT,
        )


def refuse_full_disk(text: str) -> None:
    """Raise SetUpError if a command failed because the disk is full, according to its output or to the disk itself."""
    if NO_SPACE.search(text) or shutil.disk_usage(str(ROOT)).free < FULL_DISK:  # venv does not print ensurepip's error
        raise SetUpError(
            "There is no space left:\n%s" % tail(text),
            "Free 1.5 GB (df -h shows which disk is full), then run the command again.",
        )


def no_network(text: str) -> SetUpError:
    """Return the error for a package index that cannot be reached."""
    return SetUpError(
        "The packages cannot be downloaded: the Python package index does not answer.\n%s" % tail(text),
        "Connect to the network and try again. Behind a proxy, set HTTPS_PROXY; for a mirror, set PIP_INDEX_URL.",
    )


def tail(text: str) -> str:
    """Return the last lines of a failed command's output, indented."""
    return "\n".join("  " + line for line in text.strip().splitlines()[-12:])
