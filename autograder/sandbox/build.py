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
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, ConfigDict, Field

from autograder.core.cpu_use import Withheld
from autograder.core.errors import KitError
from autograder.core.processes import cpu_time, descendants, memory, wants_cpu
from autograder.core.results import Isolation
from autograder.sandbox.environment import INSIDE, python_environment
from autograder.sandbox.grading_sandbox import OUTPUT_LIMIT, SandboxRun, exchange
from autograder.sandbox.limits import MIB
from autograder.sandbox.scratch import Scratch
from autograder.sandbox.walls import bubblewrap, seccomp

BUILD_SECONDS = 800.0
"""Seconds that a build may take at all. Interfaces take 10 on a quiet machine, and many times that on a crowded one.

One that takes longer has taken too long, unless others kept it from the CPUs for `_WITHHELD` of that time.
"""
_WITHHELD = 0.5
_INSTALLED = 32 * MIB
"""Bytes of all files together that a build may install."""
_FILES = 3000
_WORK = "/tmp"
_MEMORY = 1536 * MIB
"""Bytes of all processes of a build together; two compilers take 400 MiB."""
_PROCESSES = 64
"""Processes of a build at the same time; about 15 are usual."""
_CPU = 300.0
"""Seconds of CPU of all processes of a build together; interfaces take 13, and 50 on a machine four times slower."""
_IDLE = 60.0
"""Seconds, in all, in which nothing of a build wants to compute: it waits for something that does not come."""
_LOOK = 0.2
"""Seconds between two looks at them."""


class BuildRun(BaseModel):
    """What came of a build."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_bytes="base64", val_json_bytes="base64")

    status: int
    """Of colcon: 0 if every package was built."""
    log: str
    """All that colcon and what it started have printed."""
    over: str = ""
    """What it took too much of, and was ended for: `time` of its own, `processes`, `memory` or `output`."""
    installed: dict[str, bytes] = Field(default_factory=dict)
    """Content by path, such as `car_sensors/lib/car_sensors/speed_sensor`."""

    @property
    def killed_from_outside(self) -> bool:
        """Whether a signal that the kit did not send ended the sandbox itself, which nothing inside it can do."""
        return self.status < 0 and not self.over


def build_packages(source: Path, packages: Sequence[str], isolation: Isolation) -> BuildRun:
    """Build packages with colcon and return what would be in the workspace's `install`.

    Args:
        source: the folder that holds a folder for each package.
        packages: the names of those folders.
        isolation: as for programs. Without isolation, in a student's own notebook, it is a plain process.

    Raises:
        OSError: the sandbox cannot be started.
        KitError: the machine had too little time for the build.
    """
    if isolation is Isolation.FULL:
        return _in_sandbox(source, packages)
    with Scratch() as work:
        command = _command(INSIDE, source, str(work), packages)
        environment = {**python_environment(), "TMPDIR": str(work)}
        process = subprocess.Popen(
            command, env=environment, start_new_session=True, cwd=work,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        with _watched(process) as watched:
            try:
                return _finished(exchange(process, b"", BUILD_SECONDS), watched)
            finally:
                _end_session(process)


def _in_sandbox(source: Path, packages: Sequence[str]) -> BuildRun:
    rules = bubblewrap.memory_file("filter", seccomp.filter_program())
    options = [*bubblewrap.build_options(source, python_environment()), "--add-seccomp-fd", str(rules)]
    command = _command(Path(bubblewrap.KIT_FOLDER), Path(bubblewrap.STUDENT_FOLDER), _WORK, packages)
    pipe = subprocess.PIPE
    try:
        process = bubblewrap.start_bwrap(options, command, (rules,), stdin=pipe, stdout=pipe, stderr=pipe)
    finally:
        os.close(rules)
    with _watched(process) as watched:
        try:
            return _finished(exchange(process, b"", BUILD_SECONDS), watched)
        finally:
            process.kill()  # in a PID namespace, everything with it
            process.wait()


@dataclass
class _Watched:
    """What is known of a build that runs, or has run."""

    over: list[str] = field(default_factory=list)
    """What it took too much of, filled before it is ended."""
    withheld: Withheld = field(default_factory=Withheld)
    """The time for which others kept it from the CPUs."""

    @property
    def had_no_chance(self) -> bool:
        """Whether it is the others' fault that it has not ended in time."""
        return self.withheld.from_one(0.0) >= _WITHHELD * BUILD_SECONDS


@contextlib.contextmanager
def _watched(process: subprocess.Popen[bytes]) -> Iterator[_Watched]:
    """Hold a build to what all its processes may use together, which no limit of a single one does.

    Of time only its own counts: what it computes, and what it waits for while nobody keeps it from computing.
    """
    ended = threading.Event()
    watched = _Watched()

    def watch() -> None:
        over = watched.over
        idle = used_before = 0.0
        while not ended.wait(_LOOK):
            watched.withheld.measure()
            family = descendants(process.pid)
            used = sum(map(cpu_time, family))
            idle += _LOOK * (used == used_before and not any(map(wants_cpu, family)))
            used_before = used
            if used > _CPU or idle > _IDLE:
                over.append("time")
            if len(family) > _PROCESSES:
                over.append("processes")
            if sum(map(memory, family)) > _MEMORY:
                over.append("memory")
            if over:
                process.kill()
                _end_all(family)

    watcher = threading.Thread(target=watch, name="build", daemon=True)
    watcher.start()
    try:
        yield watched
    finally:
        ended.set()
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


def _finished(run: SandboxRun, watched: _Watched) -> BuildRun:
    too_much = [*watched.over, *["output"] * (len(run.stdout) > OUTPUT_LIMIT)]
    if run.timed_out and not too_much:
        if watched.had_no_chance:
            raise KitError(
                f"The package was not built within {BUILD_SECONDS:.0f} s, because this machine was too busy.",
                "Run it again when the machine has less to do.",
            )
        too_much.append("time")
    try:
        installed = dict(_files(run.stdout))
    except (tarfile.TarError, ValueError, EOFError):
        installed = {}
    return BuildRun(status=run.status, log=run.stderr, over="".join(too_much[:1]), installed=installed)


def _is_name(name: str) -> bool:
    """Whether a file can have this name here, and a result can say it: Linux takes any bytes, and UTF-8 does not."""
    return "\0" not in name and name.encode("utf-8", "replace").decode("utf-8") == name


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
            if not member.isreg() or path.is_absolute() or ".." in path.parts or not _is_name(member.name):
                continue
            content = tar.extractfile(member)
            if content is not None:
                yield str(path), content.read()
