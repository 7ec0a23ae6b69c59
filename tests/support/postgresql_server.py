"""A PostgreSQL server on a socket of its own, which nobody else reaches."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PROGRAMS = max(Path("/usr/lib/postgresql").glob("*/bin"), default=None)
"""Where Debian puts them; None if there is no server on this machine."""


@contextlib.contextmanager
def postgresql() -> Iterator[str]:
    """Start a server, and give the address of an empty gradebook."""
    assert PROGRAMS is not None, "no PostgreSQL server on this machine (Debian: apt-get install postgresql)"
    with tempfile.TemporaryDirectory(prefix="pg-") as name:
        yield from _serve(Path(name), PROGRAMS)


def _serve(folder: Path, programs: Path) -> Iterator[str]:
    user: dict[str, Any] = {}
    if os.getuid() == 0:  # it refuses to run as root
        user = {"user": "nobody"}
        shutil.chown(folder, "nobody")
        folder.chmod(0o755)
    data = folder / "data"

    def run(*command: str | Path) -> None:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False, **user)
        assert done.returncode == 0, done.stdout + done.stderr

    run(programs / "initdb", "-D", data, "-U", "grader", "-A", "trust", "-N", "-E", "UTF8", "--no-locale")
    options = f"-k {folder} -h '' -F"
    run(programs / "pg_ctl", "-D", data, "-w", "-t", "100", "-l", folder / "log", "-o", options, "start")
    try:
        run(programs / "createdb", "-h", folder, "-U", "grader", "gradebook")
        yield f"postgresql+psycopg://grader@/gradebook?host={folder}"
    finally:
        run(programs / "pg_ctl", "-D", data, "-m", "immediate", "stop")
