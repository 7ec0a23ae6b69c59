"""Builds ROS packages of a student's in a sandbox of their own: setup.py and CMake run what a student wrote.

Unlike the node sandbox it lets programs start others (compilers), shows no network, and is gone when the build is over.
What comes out of it is a tar, read here and taken as untrusted: plain files below the names that were asked for.
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
import tarfile
import threading
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, ConfigDict, Field

from autograder.core.processes import cpu_time, descendants, memory
from autograder.core.results import Isolation
from autograder.sandbox.environment import INSIDE, python_environment
from autograder.sandbox.limits import MIB
from autograder.sandbox.outer import OuterRun, exchange
from autograder.sandbox.scratch import Scratch
from autograder.sandbox.walls import bubblewrap, seccomp

BUILD_SECONDS = 400.0
"""Seconds that a build may take. Interfaces take 10 on a quiet machine, and many times that on one that is crowded."""
_INSTALLED = 32 * MIB
"""Bytes of all files together that a build may install."""
_FILES = 3000
_WORK = "/tmp"
_MEMORY = 1536 * MIB
"""Bytes of all processes of a build together; two compilers take 400 MiB."""
_PROCESSES = 64
"""Processes of a build at the same time; about 15 are usual."""
_CPU = 120.0
"""Seconds of CPU of all processes of a build together; interfaces take 13."""
_LOOK = 0.2
"""Seconds between two looks at them."""


class BuildRun(BaseModel):
    """What came of a build."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_bytes="base64", val_json_bytes="base64")

    status: int
    """Of colcon: 0 if every package was built."""
    log: str
    """All that colcon and what it started have printed."""
    timed_out: bool
    installed: dict[str, bytes] = Field(default_factory=dict)
    """Content by path, such as `car_sensors/lib/car_sensors/speed_sensor`."""


def build_packages(source: Path, packages: Sequence[str], isolation: Isolation) -> BuildRun:
    """Build packages with colcon and return what would be in the workspace's `install`.

    Args:
        source: the folder that holds a folder for each package.
        packages: the names of those folders.
        isolation: as for programs. Without isolation, in a student's own notebook, it is a plain process.

    Raises:
        OSError: the sandbox cannot be started.
    """
    if isolation is Isolation.FULL:
        return _finished(_in_sandbox(source, packages))
    with Scratch() as work:
        command = _command(INSIDE, source, str(work), packages)
        environment = {**python_environment(), "TMPDIR": str(work)}
        process = subprocess.Popen(
            command, env=environment, start_new_session=True, cwd=work,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        with _watched(process):
            try:
                return _finished(exchange(process, b"", BUILD_SECONDS))
            finally:
                _end_session(process)


def _in_sandbox(source: Path, packages: Sequence[str]) -> OuterRun:
    rules = bubblewrap.memory_file("filter", seccomp.filter_program())
    options = [*bubblewrap.build_options(source, python_environment()), "--add-seccomp-fd", str(rules)]
    command = _command(Path(bubblewrap.KIT_FOLDER), Path(bubblewrap.STUDENT_FOLDER), _WORK, packages)
    pipe = subprocess.PIPE
    try:
        process = bubblewrap.start_bwrap(options, command, (rules,), stdin=pipe, stdout=pipe, stderr=pipe)
    finally:
        os.close(rules)
    with _watched(process):
        try:
            return exchange(process, b"", BUILD_SECONDS)
        finally:
            process.kill()  # in a PID namespace, everything with it
            process.wait()


@contextlib.contextmanager
def _watched(process: subprocess.Popen[bytes]) -> Iterator[None]:
    """Hold a build to what all its processes may use together, which no limit of a single one does."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_LOOK):
            family = descendants(process.pid)
            if len(family) > _PROCESSES or sum(map(cpu_time, family)) > _CPU or sum(map(memory, family)) > _MEMORY:
                process.kill()
                _end_all(family)

    watcher = threading.Thread(target=watch, name="build", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()


def _end_all(family: Iterable[int]) -> None:
    for pid in family:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)


def _command(kit: Path, source: Path, work: str, packages: Sequence[str]) -> list[str]:
    script = str(kit / "build_packages.py")
    return [sys.executable, "-I", script, str(source), work, sys.prefix, *packages]


def _end_session(process: subprocess.Popen[bytes]) -> None:
    """End a build that may still run, with the compilers that it has started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _finished(run: OuterRun) -> BuildRun:
    try:
        installed = dict(_files(run.stdout))
    except (tarfile.TarError, ValueError, EOFError):
        installed = {}
    return BuildRun(status=run.status, log=run.stderr, timed_out=run.timed_out, installed=installed)


def _files(archive: bytes) -> Iterator[tuple[str, bytes]]:
    """The plain files in a tar whose author nobody trusts.

    Raises:
        ValueError: there are too many, or they are too large.
    """
    size = number = 0
    with tarfile.open(fileobj=io.BytesIO(archive), mode="r:") as tar:
        for member in tar:
            path = PurePosixPath(member.name)
            number, size = number + 1, size + member.size
            if number > _FILES or size > _INSTALLED:
                raise ValueError("too much was installed")
            if not member.isreg() or path.is_absolute() or ".." in path.parts or "\0" in member.name:
                continue
            content = tar.extractfile(member)
            if content is not None:
                yield str(path), content.read()
