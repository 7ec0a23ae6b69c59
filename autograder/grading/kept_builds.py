"""Builds that this user's earlier runs have made, so that the same files are not built again.

A build runs in a sandbox that contains nothing but the files, and this process, which never runs a student's code,
stores its result under a digest of exactly these files and of what they were built with. A build can neither read nor
write what is stored, and decides nothing but the result for its own files. The folder is closed to all other users.
Builds without full isolation are not stored, because a student's code could then write here.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import shutil
import stat
import sys
from pathlib import Path

from pydantic import ValidationError

from autograder.core.files import write_beside
from autograder.course.lab import kit_digest
from autograder.sandbox.build import BuildRun

KEPT = 32
"""The number of builds that are kept, in memory and on the disk. A build of four interfaces has about 1 MiB."""


def stored(sources: str) -> BuildRun | None:
    """Return the stored build of the files with this digest; None if there is none that can be used."""
    folder = _folder()
    if folder is None:
        return None
    path = folder / _name(sources)
    try:
        found = BuildRun.model_validate_json(path.read_bytes())
        os.utime(path)  # those that have not been used for longest are removed first
    except (OSError, ValidationError):
        return None
    return found


def store(sources: str, run: BuildRun) -> None:
    """Store a build that succeeded. If nothing can be written, later runs build again."""
    folder = _folder()
    if folder is None or run.status != 0 or run.over:
        return
    with contextlib.suppress(OSError):
        write_beside(folder / _name(sources), run.model_dump_json())
        by_age = sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in by_age[:-KEPT]:
            path.unlink(missing_ok=True)


def _name(sources: str) -> str:
    return f"{hashlib.sha256(f'{sources} {_built_with()}'.encode()).hexdigest()}.json"


@functools.cache
def _built_with() -> str:
    """Return what else decides the result of a build: the kit, this environment, its packages, and the compilers."""
    places = [path for name in ("cc", "c++", "cmake", "make") if (path := shutil.which(name))]
    tools = [(str(Path(path).resolve()), (state := Path(path).stat()).st_size, state.st_mtime_ns) for path in places]
    packages = sorted(path.name for folder in sys.path for path in Path(folder).glob("*.dist-info"))
    return repr((kit_digest(), sys.version, sys.prefix, tools, packages))


def _folder() -> Path | None:
    """Return the folder of the stored builds, in the user's cache; None if it is not this user's alone."""
    try:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(home) / "autograder" / "builds"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
    except (OSError, RuntimeError):
        return None
    alone = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
    return folder if alone else None
