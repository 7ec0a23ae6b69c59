"""The programs of one launch: started together, read together, held to their common limits, ended together.

A program that writes without end is read no faster than a terminal would read it. Then it has to wait when it prints,
as it would there, and neither it nor the reading takes the machine from others.

Memory, processes and disk have limits. CPU time has none, because how fast a program uses it depends on the machine as
well. One that computes on and on goes on, behind everyone else who wants to compute (`Priority`).
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
from autograder.core.processes import Process, descendants, memory, pid_of, proportional_memory
from autograder.sandbox.limits import Limits
from autograder.sandbox.loop import Loop
from autograder.sandbox.running_program import RunningProgram

_PIECE = 1 << 16
"""Bytes read at once."""
_MOST_PIECES = 64
"""Of one pipe before others have their turn: more than is read at once."""
_AT_ONCE = 1 << 18
"""Bytes of one pipe that may be read between two looks at the launch, however soon they follow each other."""
_A_SECOND = 10 * _AT_ONCE
"""Bytes of one pipe that may be read in a second: a book. How often a launch is looked at depends on the machine."""
_LONGEST = 10.0
"""Seconds between two looks that count at the most."""


class ProgramPipes:
    """Reads the programs of one group in the sandbox's thread.

    Args:
        loop: that thread.
        changed: held and notified whenever a program is told something.
    """

    def __init__(self, loop: Loop, changed: threading.Condition) -> None:
        """Begin with no program."""
        self._loop = loop
        self._changed = changed
        self._looked = time.monotonic()
        self._room = _AT_ONCE
        """Bytes of a pipe that may be read until the next look: as many as in the time between the last two."""
        self._read: dict[int, int] = {}
        """Bytes that were read of a pipe since the last look."""
        self._paused: dict[int, Callable[[], None]] = {}
        """What reads a pipe that was full of more than may be read at once."""

    def open(self, program: RunningProgram) -> list[int]:
        """Make a program's pipes, and read them from now on; return the ends to write to, closed by the caller."""
        ends = [os.pipe2(os.O_CLOEXEC) for _ in range(3)]
        for ours, _ in ends:
            os.set_blocking(ours, False)
        for _, theirs in ends[1:]:
            os.set_blocking(theirs, False)  # the probe drops what does not fit, it never waits
        takers = (program._take_output, program._take_events, program._take_stacks)
        program.readers = [ours for ours, _ in ends]

        def watch() -> None:
            for (ours, _), taker in zip(ends, takers, strict=True):
                self._loop.when_readable(ours, self._reader(program, ours, taker))

        self._loop.do(watch)
        return [theirs for _, theirs in ends]

    def catch_up(self, program: RunningProgram) -> None:
        """Take what lies in a running program's pipes: its answer may have come by DDS before its notes were read."""
        if program.readers:
            self._loop.do(lambda: self._drain(program))

    def go_on(self) -> None:
        """Read on where more was written than is read at once; only from the sandbox's thread."""
        now = time.monotonic()
        self._room = max(_AT_ONCE, int(_A_SECOND * min(now - self._looked, _LONGEST)))
        self._looked = now
        self._read.clear()
        for descriptor, read in self._paused.items():
            self._loop.when_readable(descriptor, read)
        self._paused.clear()

    def take_rest(self, program: RunningProgram) -> None:
        """Take what a program that has ended has left in its pipes; only from the sandbox's thread."""
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
        """Close what is still open of a program's pipes; only from the sandbox's thread."""
        for descriptor in list(program.readers):
            self._close(program, descriptor)

    def _reader(self, program: RunningProgram, descriptor: int, taker: Callable[[bytes], None]) -> Callable[[], None]:
        def read() -> None:
            if descriptor not in program.readers:
                return  # closed by what came before it in the same round
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
    """Look at what a launch uses, and end the biggest of its programs if that is too much.

    Args:
        first: its first process; every other one descends from it, since orphans become its children.
        base: bytes of memory that the first process had before it started anything; forks share them.
        programs: those that run.
        limits: of all together.

    Returns:
        False if it is the first process itself that uses too much: then everything has to end.
    """
    family = descendants(first)
    own = memory(first) - base
    if own > limits.memory:
        return False
    if own + sum(max(0, memory(pid) - base) for pid in family) > limits.memory:
        sizes = {pid: proportional_memory(pid) for pid in family}
        if sum(sizes.values()) > limits.memory:
            _end_biggest(programs, family, sizes, "memory limit")
    if sum(process.threads for process in family.values()) >= limits.processes - 8:
        _end_biggest(programs, family, {pid: process.threads for pid, process in family.items()}, "process limit")
    return True


def _end_biggest(
    programs: Sequence[RunningProgram], family: dict[int, Process], sizes: dict[int, int], why: str
) -> None:
    """End the program whose processes use most, and all processes that belong to no program any more."""
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
"""Seconds after which a first process that does not answer is given up."""
_ENDED_WITHIN = 30.0
"""Seconds that the kernel may take to end killed processes."""
_SET_BY_THE_SANDBOX = ("FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_LOG_DIR", "HOME", "TMPDIR", "LD_LIBRARY_PATH")
"""What a caller cannot set for a program: it depends on where the program runs."""


class GroupLost(Exception):
    """The group's first process has ended, or never began."""


class RunningPrograms:
    """The programs of one launch. Made by `NodeSandbox.group`; ended with `end`, or as a `with` block.

    Where there is full isolation, it is a PID namespace: when its first process is gone, everything in it is, whoever
    its parent was.
    """

    def __init__(
        self, folder: Path, inside: str, variables: Mapping[str, str], limits: Limits, loop: Loop,
        channel: socket.socket,
    ) -> None:  # fmt: skip
        """Listen to the first process, which may still be on its way.

        Args:
            folder: of the programs.
            inside: where the programs find it.
            variables: the environment of every program.
            limits: of the whole group.
            loop: the sandbox's thread.
            channel: to the first process.
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
        """The first process as this process sees it."""
        self._base = 0
        """Bytes of memory that it had before it started anything."""
        self._ready = False
        self._broken = ""
        self._over = False
        channel.setblocking(False)
        loop.do(lambda: loop.when_readable(channel.fileno(), self._on_channel))

    def __enter__(self) -> RunningPrograms:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self.end()

    # What callers use.

    def wait_ready(self, timeout: float) -> None:
        """Wait for the first process.

        Raises:
            GroupLost: it did not come; says why.
        """
        with self.changed:
            self.changed.wait_for(lambda: (self._ready and self.pid > 0) or self._over, timeout)
            if not self._ready or self._over:
                raise GroupLost(self._broken or "no answer")

    def start(
        self, program: str, args: Sequence[str] = (), env: Mapping[str, str] | None = None, cores: int = 2,
        *, file: str = "", prefixes: Sequence[str] = (),
    ) -> RunningProgram:  # fmt: skip
        """Start a program of the folder as a process of its own.

        Args:
            program: its name.
            args: `sys.argv[1:]`.
            env: variables besides those of every program, such as ROS_DOMAIN_ID.
            cores: the number of CPUs that it sees.
            file: its path in the folder; by default `program`.py.
            prefixes: paths in the folder of installed ROS packages, whose modules it can import.

        Raises:
            FileNotFoundError: the folder has no such program.
            KitError: it is not started.
        """
        file = file or f"{program}.py"
        if not (self.folder / file).is_file():
            raise FileNotFoundError(file)
        started = RunningProgram(program, self._limits, self.changed, self._pipes.catch_up)
        try:
            known = self._request(started, file, list(args), {**(env or {}), **self._packages(prefixes)}, cores)
        except OSError:
            known = False
        if not known:
            raise KitError(f"The sandbox does not start {program}.py.", "Run `autograder doctor`.")
        return started

    def end(self) -> None:
        """End everything that was started, and make sure of it. Can be called twice.

        Raises:
            KitError: something goes on.
        """
        self._loop.do(self._end)

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self._over

    def running(self) -> bool:
        """Whether there are programs to watch."""
        return not self._over and bool(self._programs)

    def watch(self) -> None:
        """Hold the programs to the limits of the group; only from the sandbox's thread."""
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

    # Starting.

    def _packages(self, prefixes: Sequence[str]) -> dict[str, str]:
        """The variable by which ROS, and here the launcher too, finds installed packages."""
        return {"AMENT_PREFIX_PATH": ":".join(f"{self._inside}/{one}" for one in prefixes)} if prefixes else {}

    def _request(self, program: RunningProgram, file: str, args: list[str], env: dict[str, str], cores: int) -> bool:
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
            # A random choice: with the same two CPUs for everyone, a big machine would be idle beside them.
            "cpus": sorted(random.sample(usable, min(cores, len(usable)))),
            "cores": cores,
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

    # In the sandbox's thread.

    def _on_channel(self) -> None:
        """Take one answer. What was never one of a first process of ours ends the group."""
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
        self._channel.shutdown(socket.SHUT_WR)  # a first process that is not known yet ends at this
        handles = [handle for handle in (self._first, *(one._handle for one in self._programs.values())) if handle >= 0]
        for handle in handles:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(handle, signal.SIGKILL)
        poll = select.poll()
        deadline = time.monotonic() + _ENDED_WITHIN
        for handle in handles:
            poll.register(handle, select.POLLIN)
            # The first process of a PID namespace is gone only when everything in it is.
            if not poll.poll(1000 * max(0.0, deadline - time.monotonic())):
                raise KitError("Programs that were killed do not end.", "Look at the machine's process list.")
            poll.unregister(handle)

    def _take_last_answers(self) -> None:
        """Take what the first process said before its end: how programs that ended by themselves did."""
        while True:
            try:
                packet, handles, _, _ = socket.recv_fds(self._channel, 1 << 16, 1)
            except OSError:
                return
            if not packet:
                return
            with contextlib.suppress(ValueError, LookupError, TypeError, AttributeError):
                self._take_answer(json.loads(packet), handles)
