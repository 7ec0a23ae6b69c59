"""Checkouts of this tree that tests set up with make."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from autograder.setup.bootstrap import pin

MAKE = shutil.which("make") or "make"


SYSTEM_PATH = "/usr/local/bin:/usr/bin:/bin"


BASE_PYTHON = str(Path(sys.base_prefix, "bin", f"python{sys.version_info.major}.{sys.version_info.minor}"))


# The environment that runs these tests must not leak into the checkouts that they make.
ENVIRON = {
    name: value
    for name, value in os.environ.items()
    if not name.startswith(("MAKE", "MFLAGS", "ROS_", "_ROS_", "AMENT_", "LD_LIBRARY_PATH", "PYTHON", "VIRTUAL_ENV"))
} | {"PATH": os.pathsep.join([str(Path(BASE_PYTHON).parent), SYSTEM_PATH])}


def write_lock(folder: Path, lock: str, *packages: str) -> None:
    (folder / lock).write_text("".join(pin("requirements.lock", package) for package in packages))


def make(folder: Path, *arguments: str, path: str | None = None, **environ: str) -> subprocess.CompletedProcess[str]:
    """Run make from another folder, as a person would type it."""
    return subprocess.run(
        [MAKE, "-C", str(folder), *arguments],
        cwd="/",
        env=ENVIRON | environ | ({} if path is None else {"PATH": path}),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
