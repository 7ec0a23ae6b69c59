"""The programs of one launch: they are started, read and ended together, and share common limits.

A program that prints without end is read no faster than a terminal would read it. Then it has to wait when it prints,
as in a terminal, and neither the program nor the reading takes the CPUs from others.

There are limits for memory, processes and disk space. There is none for CPU time, because how fast a program uses it
also depends on the machine. A program that computes all the time continues with the lowest priority (`Priority`).
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.processes import Process, descendants, memory, pid_of
from autograder.sandbox.limits import Limits
from autograder.sandbox.loop import Loop
from autograder.sandbox.running_program import RunningProgram

_PIECE = 1 << 16
"""The bytes that are read at once."""
_MOST_PIECES = 64
"""The number of reads from one pipe before it is the turn of other pipes, which is enough for more than `_AT_ONCE`."""
_AT_ONCE = 1 << 18
"""The bytes of one pipe that may be read between two looks at the launch, however short the time between them is."""
_A_SECOND = 10 * _AT_ONCE
"""The bytes of one pipe that may be read in a second, which is as much as a long book. The limit is per second because
the time between two looks at a launch depends on the machine."""
_LONGEST = 10.0
"""The most seconds between two looks that count."""


class ProgramPipes:
    """Reads the output of the programs of one group in the sandbox's thread.

    Args:
        loop: the loop of the sandbox's thread.
        changed: a condition that is held and notified whenever the state of a program changes.
    """

    def __init__(self, loop: Loop, changed: threading.Condition) -> None:
        """Begin without programs."""
        self._loop = loop
        self._changed = changed
        self._looked = time.monotonic()
        self._room = _AT_ONCE
        """The bytes of a pipe that may be read until the next look, computed from the time between the last two."""
        self._read: dict[int, int] = {}
        """The bytes that were read from each pipe since the last look."""
        self._paused: dict[int, Callable[[], None]] = {}
        """For each pipe from which no more may be read until the next look: the function that reads it."""

    def open(self, program: RunningProgram) -> list[int]:
        """Create a program's pipes and read them from now on. Return their write ends, which the caller closes."""
        ends = [os.pipe2(os.O_CLOEXEC) for _ in range(3)]
        for ours, _ in ends:
            os.set_blocking(ours, False)
        for _, theirs in ends[1:]:
            os.set_blocking(theirs, False)  # the probe never waits, but drops data that does not fit
        takers = (program._take_output, program._take_events, program._take_stacks)
        program.readers = [ours for ours, _ in ends]

        def watch() -> None:
            for (ours, _), taker in zip(ends, takers, strict=True):
                self._loop.when_readable(ours, self._reader(program, ours, taker))

        self._loop.do(watch)
        return [theirs for _, theirs in ends]

    def catch_up(self, program: RunningProgram) -> None:
        """Read what is in a running program's pipes now.

        This is needed because a response may come over DDS before the notes that the program wrote earlier are read.
        """
        if program.readers:
            self._loop.do(lambda: self._drain(program))

    def go_on(self) -> None:
        """Continue to read pipes with more data than may be read at once; call this only in the sandbox's thread."""
        now = time.monotonic()
        self._room = max(_AT_ONCE, int(_A_SECOND * min(now - self._looked, _LONGEST)))
        self._looked = now
        self._read.clear()
        for descriptor, read in self._paused.items():
            self._loop.when_readable(descriptor, read)
        self._paused.clear()

    def take_rest(self, program: RunningProgram) -> None:
        """Read the rest of the pipes of a program that has ended; call this only in the sandbox's thread."""
        self.go_on()
        self._drain(program)

    def _drain(self, program: RunningProgram) -> None:
        for descriptor in list(program.readers):
            for _ in range(_MOST_PIECES):
                before = program._written + program._noted
                if descriptor not in program.readers:
                    break
                self._loop.read_now(descriptor)
                if program._written + program._noted == before:
                    break

    def close(self, program: RunningProgram) -> None:
        """Close a program's pipes that are still open; call this only in the sandbox's thread."""
        for descriptor in list(program.readers):
            self._close(program, descriptor)

    def _reader(self, program: RunningProgram, descriptor: int, taker: Callable[[bytes], None]) -> Callable[[], None]:
        def read() -> None:
            if descriptor not in program.readers:
                return  # an earlier callback in the same round has closed it
            data = b""
            with contextlib.suppress(BlockingIOError):
                data = os.read(descriptor, _PIECE)
                if not data:
                    self._close(program, descriptor)
                    return
            if data:
                self._read[descriptor] = self._read.get(descriptor, 0) + len(data)
                if self._read[descriptor] >= self._room:
                    self._loop.forget(descriptor)
                    self._paused[descriptor] = read
                with self._changed:
                    taker(data)
                    self._changed.notify_all()

        return read

    def _close(self, program: RunningProgram, descriptor: int) -> None:
        if descriptor in program.readers:
            program.readers.remove(descriptor)
            if self._paused.pop(descriptor, None) is None:
                self._loop.forget(descriptor)
            self._read.pop(descriptor, None)
            os.close(descriptor)


def enforce_limits(first: int, base: int, programs: Sequence[RunningProgram], limits: Limits) -> bool:
    """Measure what a launch uses, and end the program that uses most if that is too much.

    Args:
        first: the first process of the launch. All others descend from it, because orphans become its children.
        base: the bytes of memory that the first process had before it started anything; forks share them.
        programs: the running programs.
        limits: the limits of all programs together.

    Returns:
        False if the first process itself uses too much, so that the whole launch has to end.
    """
    family = descendants(first)
    own = memory(first) - base
    if own > limits.memory:
        return False
    sizes = {pid: max(0, memory(pid) - base) for pid in family}
    if own + sum(sizes.values()) > limits.memory:
        _end_biggest(programs, family, sizes, "memory limit")
    if sum(process.threads for process in family.values()) >= limits.processes - 8:
        _end_biggest(programs, family, {pid: process.threads for pid, process in family.items()}, "process limit")
    return True


def _end_biggest(
    programs: Sequence[RunningProgram], family: dict[int, Process], sizes: dict[int, int], why: str
) -> None:
    """End the program whose processes use most, and all processes that no longer belong to a program."""
    owned: dict[int, list[int]] = {}
    roots = {program.pid for program in programs}
    for pid in family:
        owner = pid
        while owner in family and owner not in roots:
            owner = family[owner].session if family[owner].session in roots else family[owner].parent
        owned.setdefault(owner if owner in roots else 0, []).append(pid)
    ending = owned.pop(0, [])
    if owned:
        worst = max(owned, key=lambda owner: sum(sizes[pid] for pid in owned[owner]))
        ending += owned[worst]
        next(program for program in programs if program.pid == worst)._kill(why)
    for pid in ending:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)


_ANSWER_WITHIN = 30.0
"""The seconds to wait for an answer of a first process."""
_ENDED_WITHIN = 30.0
"""The seconds that the kernel may take to end killed processes."""
_SET_BY_THE_SANDBOX = ("FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_LOG_DIR", "HOME", "TMPDIR", "LD_LIBRARY_PATH")
"""The variables that a caller cannot set for a program, because they depend on where the program runs."""


class GroupLost(Exception):
    """The group's first process has ended, or has never started."""


class RunningPrograms:
    """The group of the programs of one launch. `NodeSandbox.group` creates it; `end` or leaving a `with` block ends it.

    With full isolation, the launch has its own PID namespace: when the first process has ended, the kernel has ended
    everything in the namespace, no matter which process started it.
    """

    def __init__(
        self, folder: Path, inside: str, variables: Mapping[str, str], limits: Limits, loop: Loop,
        channel: socket.socket,
    ) -> None:  # fmt: skip
        """Begin to listen to the first process, which may not have started yet.

        Args:
            folder: the folder of the programs.
            inside: the path at which the programs see this folder.
            variables: the environment of every program.
            limits: the limits of the whole group.
            loop: the loop of the sandbox's thread.
            channel: the socket to the first process.
        """
        self.folder = folder
        self.changed = threading.Condition()
        self._inside = inside
        self._variables = dict(variables)
        self._limits = limits
        self._loop = loop
        self._channel = channel
        self._pipes = ProgramPipes(loop, self.changed)
        self._programs: dict[int, RunningProgram] = {}
        self._started = 0
        self._first = -1
        """A pidfd of the first process."""
        self.pid = -1
        """The ID of the first process as this process sees it."""
        self._base = 0
        """The bytes of memory that the first process had before it started anything."""
        self._ready = False
        self._broken = ""
        self._over = False
        channel.setblocking(False)
        loop.do(lambda: loop.when_readable(channel.fileno(), self._on_channel))

    def __enter__(self) -> RunningPrograms:
        """Return the group."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all programs of the group."""
        self.end()

    # Methods for callers.

    def wait_ready(self, timeout: float) -> None:
        """Wait until the first process is ready.

        Raises:
            GroupLost: it did not become ready; the message says why.
        """
        with self.changed:
            self.changed.wait_for(lambda: (self._ready and self.pid > 0) or self._over, timeout)
            if not self._ready or self._over:
                raise GroupLost(self._broken or "no answer")

    def start(
        self, program: str, args: Sequence[str] = (), env: Mapping[str, str] | None = None, cores: int = 2,
        *, file: str = "", prefixes: Sequence[str] = (), assume_success: bool = False,
    ) -> RunningProgram:  # fmt: skip
        """Start a program of the folder as a new process.

        Args:
            program: the name of the program.
            args: the arguments, `sys.argv[1:]`.
            env: variables in addition to those of every program, such as ROS_DOMAIN_ID.
            cores: the number of CPUs that the program sees.
            file: the path of the program in the folder; by default `program`.py.
            prefixes: the paths in the folder of installed ROS packages, whose modules the program can import.
            assume_success: whether a lifecycle callback that returns no TransitionCallbackReturn succeeds.

        Raises:
            FileNotFoundError: the folder has no such program.
            KitError: the sandbox cannot start the program.
        """
        file = file or f"{program}.py"
        if not (self.folder / file).is_file():
            raise FileNotFoundError(file)
        started = RunningProgram(program, self._limits, self.changed, self._pipes.catch_up)
        try:
            variables = {**(env or {}), **self._packages(prefixes)}
            known = self._request(started, file, list(args), variables, cores, assume_success)
        except OSError:
            known = False
        if not known:
            raise KitError(f"The sandbox does not start {program}.py.", "Run `autograder doctor`.")
        return started

    def end(self) -> None:
        """End everything that was started, and check that it has ended. This can be called twice.

        Raises:
            KitError: something has not ended.
        """
        self._loop.do(self._end)

    @property
    def over(self) -> bool:
        """Whether the group has ended."""
        return self._over

    def running(self) -> bool:
        """Whether there are programs to watch."""
        return not self._over and bool(self._programs)

    def watch(self) -> None:
        """Enforce the limits of the group on its programs; call this only in the sandbox's thread."""
        with self.changed:
            programs = [program for program in self._programs.values() if program.pid > 0]
            if self._over or not programs:
                return
            self._pipes.go_on()
            for program in programs:
                program.priority.look(program.pid)
            if not enforce_limits(self.pid, self._base, programs, self._limits):
                signal.pidfd_send_signal(self._first, signal.SIGKILL)
            self.changed.notify_all()

    # Methods that start a program.

    def _packages(self, prefixes: Sequence[str]) -> dict[str, str]:
        """Return the variable by which ROS and the launcher find installed packages."""
        return {"AMENT_PREFIX_PATH": ":".join(f"{self._inside}/{one}" for one in prefixes)} if prefixes else {}

    def _request(
        self, program: RunningProgram, file: str, args: list[str], env: dict[str, str], cores: int, assume_success: bool
    ) -> bool:
        usable = sorted(os.sched_getaffinity(0))
        with self.changed:
            self._started += 1
            number = self._started
            self._programs[number] = program
        request = {
            "id": number,
            "path": f"{self._inside}/{file}",
            "folder": self._inside,
            "args": args,
            "env": {**self._variables, **env, **{name: self._variables[name] for name in _SET_BY_THE_SANDBOX}},
            # The choice is random, because with the same two CPUs for all programs, the other CPUs would be idle.
            "cpus": sorted(random.sample(usable, min(cores, len(usable)))),
            "cores": cores,
            "assume_success": assume_success,
        }
        theirs = self._pipes.open(program)
        try:
            socket.send_fds(self._channel, [json.dumps(request).encode()], theirs)
        finally:
            for descriptor in theirs:
                os.close(descriptor)
        with self.changed:
            self.changed.wait_for(lambda: program.pid >= 0 or not program.running() or self._over, _ANSWER_WITHIN)
            return program.pid >= 0 or not program.running()

    # Methods that run in the sandbox's thread.

    def _on_channel(self) -> None:
        """Receive one answer of the first process. An invalid answer ends the group."""
        try:
            packet, handles, _, _ = socket.recv_fds(self._channel, 1 << 16, 1)
        except BlockingIOError:
            return
        except OSError:
            packet, handles = b"", []
        try:
            if packet:
                self._take_answer(json.loads(packet), handles)
            else:
                self._end()
        except (ValueError, LookupError, TypeError, AttributeError):
            self._end()

    def _take_answer(self, answer: dict[str, object], handles: list[int]) -> None:
        with self.changed:
            if "first" in answer:
                self._first = handles[0]
                self.pid = pid_of(self._first)
                self._base = memory(self.pid)
            elif "ready" in answer:
                self._ready = True
            elif "broken" in answer:
                self._broken = str(answer["broken"])
            elif "started" in answer:
                self._programs[int(str(answer["started"]))]._started(handles[0])
            elif "failed" in answer:
                self._forget(int(str(answer["failed"])), 1)
            elif "ended" in answer:
                self._forget(int(str(answer["ended"])), int(str(answer["status"])))
            self.changed.notify_all()

    def _forget(self, number: int, status: int) -> None:
        program = self._programs.pop(number, None)
        if program is not None:
            self._pipes.take_rest(program)
            program._ended(status)
            self._pipes.close(program)

    def _end(self) -> None:
        if self._over:
            return
        self._over = True
        try:
            self._kill()
        finally:
            with self.changed:
                self._take_last_answers()
                for number in list(self._programs):
                    self._forget(number, -signal.SIGKILL)
                self.changed.notify_all()
            self._loop.forget(self._channel.fileno())
            self._channel.close()
            if self._first >= 0:
                os.close(self._first)
                self._first = -1

    def _kill(self) -> None:
        """End the first process, and wait until it and all programs are gone."""
        self._channel.shutdown(socket.SHUT_WR)  # this ends a first process whose pidfd has not arrived yet
        handles = [handle for handle in (self._first, *(one._handle for one in self._programs.values())) if handle >= 0]
        for handle in handles:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(handle, signal.SIGKILL)
        poll = select.poll()
        deadline = time.monotonic() + _ENDED_WITHIN
        for handle in handles:
            poll.register(handle, select.POLLIN)
            # The first process of a PID namespace has ended only when everything in the namespace has.
            if not poll.poll(1000 * max(0.0, deadline - time.monotonic())):
                raise KitError("Programs that were killed do not end.", "Look at the machine's process list.")
            poll.unregister(handle)

    def _take_last_answers(self) -> None:
        """Receive what the first process reported before its end, such as how programs ended by themselves."""
        while True:
            try:
                packet, handles, _, _ = socket.recv_fds(self._channel, 1 << 16, 1)
            except OSError:
                return
            if not packet:
                return
            with contextlib.suppress(ValueError, LookupError, TypeError, AttributeError):
                self._take_answer(json.loads(packet), handles)
