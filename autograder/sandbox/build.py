"""Builds a student's ROS packages in a separate sandbox, because setup.py and CMake run what the student wrote.

Unlike the node sandbox, it lets programs start other programs (compilers), has no network, and ends with the build. Its
output is a tar that is treated as untrusted: only regular files with harmless names are taken from it.
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
"""The seconds that a build may take. Interfaces take 6 s on an idle machine, and many times as long on a busy one.

A build that takes longer fails, unless other processes withheld the CPUs from it for the share `_WITHHELD` of that
time.
"""
_WITHHELD = 0.5
_INSTALLED = 32 * MIB
"""The bytes of all files together that a build may install."""
_FILES = 3000
_WORK = "/tmp"
_MEMORY = 1536 * MIB
"""The bytes of memory of all processes of a build together; two compilers take 400 MiB."""
_PROCESSES = 64
"""The number of processes of a build at the same time; about 15 are usual."""
_CPU = 300.0
"""The seconds of CPU time of all processes of a build together. Interfaces take 10, or 40 on a machine that is four
times slower."""
_IDLE = 60.0
"""The total seconds in which no process of a build wants to compute. A build that is idle for longer waits for
something that does not happen."""
_LOOK = 0.2
"""The seconds between two looks at the processes."""


class BuildRun(BaseModel):
    """The result of a build."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_bytes="base64", val_json_bytes="base64")

    status: int
    """The exit status of colcon, which is 0 if every package was built."""
    log: str
    """Everything that colcon and the programs that it started have printed."""
    over: str = ""
    """The resource of which the build used too much, so that it was ended: `time`, `processes`, `memory` or
    `output`."""
    installed: dict[str, bytes] = Field(default_factory=dict)
    """The contents of the installed files by path, such as `car_sensors/lib/car_sensors/speed_sensor`."""

    @property
    def killed_from_outside(self) -> bool:
        """Whether a signal that the kit did not send ended the sandbox itself. Nothing inside it can do that."""
        return self.status < 0 and not self.over


def build_packages(source: Path, packages: Sequence[str], isolation: Isolation) -> BuildRun:
    """Build packages with colcon and return the files that it would install in the workspace's `install`.

    Args:
        source: the folder that contains a folder for each package.
        packages: the names of those folders.
        isolation: the isolation, as for programs. Only full isolation uses a sandbox; otherwise, as in a student's own
            notebook, the build is an ordinary process.

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
            process.kill()  # this ends everything in its PID namespace
            process.wait()


@dataclass
class _Watched:
    """What is known about a build that is running or has ended."""

    over: list[str] = field(default_factory=list)
    """The resources of which it used too much; they are added before the build is ended."""
    withheld: Withheld = field(default_factory=Withheld)
    """The time for which other processes withheld the CPUs from it."""

    @property
    def had_no_chance(self) -> bool:
        """Whether the build has not ended in time because other processes withheld the CPUs from it."""
        return self.withheld.from_one(0.0) >= _WITHHELD * BUILD_SECONDS


@contextlib.contextmanager
def _watched(process: subprocess.Popen[bytes]) -> Iterator[_Watched]:
    """Enforce the limits for all processes of a build together, which limits of single processes cannot do.

    Only time that the build itself is responsible for counts: the time in which it computes, and the time in which it
    waits although it could compute.
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
    """End a build that may still be running, together with the compilers that it has started."""
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
    """Whether the name is valid for a file here and can be written in a result as UTF-8; Linux accepts any bytes."""
    return "\0" not in name and name.encode("utf-8", "replace").decode("utf-8") == name


def _files(archive: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield the regular files in an untrusted tar, each as its path and content.

    Raises:
        ValueError: there are too many files, or they are too large.
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
