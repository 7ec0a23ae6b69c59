"""The programs of one launch: started together, watched together, ended together."""

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
from collections.abc import Mapping, Sequence
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.processes import memory, pid_of
from autograder.sandbox import watch
from autograder.sandbox.limits import Limits
from autograder.sandbox.loop import Loop
from autograder.sandbox.program_pipes import ProgramPipes
from autograder.sandbox.running_program import RunningProgram

_ANSWER_WITHIN = 30.0
"""Seconds after which a first process that does not answer is given up."""
_ENDED_WITHIN = 30.0
"""Seconds that the kernel may take to end killed processes."""
_SET_BY_THE_SANDBOX = ("FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_LOG_DIR", "HOME", "TMPDIR", "LD_LIBRARY_PATH")
"""What a caller cannot set for a program: it depends on where the program runs."""


class GroupLost(Exception):
    """The group's first process has ended, or never began."""


class ProgramGroup:
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

    def __enter__(self) -> ProgramGroup:
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
            if not watch.enforce(self.pid, self._base, programs, self._limits):
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
