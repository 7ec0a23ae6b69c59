"""One running program of a student's, as its launcher's keeper sees it."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

from autograder.core.processes import cpu_time, pid_of, threads, wants_cpu
from autograder.sandbox.inside import thread_stacks
from autograder.sandbox.limits import Limits

LAST = 19
"""The nice value of whoever lets everyone else go first (sched(7))."""
_TO_BEGIN = 1.0
"""Seconds of CPU up to which a program is not looked at; a node that rests never has more."""
_ON_AND_ON = 10.0
"""Seconds of CPU within the time that is judged."""
_LOOKS = 50
"""After so many looks a new time begins if the program did not want to compute in most of them."""


class Priority:
    """The priority of one program, which is looked at now and then.

    A program that computes on and on lets everyone else go first. It cannot get its priority back, so it has to be seen
    to compute on and on: many seconds of CPU within a time in most of which it wanted to compute, whether it could or
    not. What a program needs to begin, on whatever machine, is not that.
    """

    def __init__(self) -> None:
        """Begin with that of everyone."""
        self._behind = False
        self._looks = self._wanted = 0
        """Looks since this time began, and those at which the program wanted to compute."""
        self._before = 0.0
        """Seconds of CPU that it had had when this time began."""

    def look(self, pid: int) -> None:
        """Give all threads of the program the lowest priority if it computes on and on, whatever it gave to some.

        The programs of its launch, and of others, come before it then. Where each session has its share of the CPUs
        (sched(7), the autogroup feature) it takes no more than one session's, with however many threads: each program
        is a session of its own.

        Args:
            pid: of the program.
        """
        with contextlib.suppress(OSError):
            self._behind = self._behind or self._goes_on_and_on(pid)
            # Linux keeps a nice value for each thread; threads inherit that of the thread that starts them.
            for thread in threads(pid) if self._behind else ():
                with contextlib.suppress(ProcessLookupError):
                    if os.getpriority(os.PRIO_PROCESS, thread) < LAST:
                        os.setpriority(os.PRIO_PROCESS, thread, LAST)

    def _goes_on_and_on(self, pid: int) -> bool:
        used = cpu_time(pid)
        if used < _TO_BEGIN:
            return False
        self._looks += 1
        self._wanted += wants_cpu(pid)
        if 2 * self._wanted > self._looks:
            return used - self._before > _ON_AND_ON
        if self._looks >= _LOOKS:
            self._looks, self._wanted, self._before = 0, 0, used
        return False


_LONGEST_NOTE = 4096
"""Bytes; the probe's own are shorter."""
_NOTES_KEPT = 1 << 20
"""Bytes of notes that are kept of one program: what they become in memory is twenty times as much at worst."""
_RECORDS = 500
"""Notes that stand for a thing: only the last one of each is kept."""


class RunningProgram:
    """A program that was started. Its output is read all the time by the sandbox's own thread.

    Attributes:
        name: what `RunningPrograms.start` was asked for.
    """

    def __init__(
        self, name: str, limits: Limits, changed: threading.Condition, catch_up: Callable[[RunningProgram], None]
    ) -> None:
        """Made by `RunningPrograms.start`."""
        self.name = name
        self._limits = limits
        self._changed = changed
        self._catch_up = catch_up
        self._handle = -1
        self.pid = -1
        """Process id as this process sees it."""
        self.priority = Priority()
        self.began = time.monotonic()
        self._head = bytearray()
        self._tail = bytearray()
        self._written = 0
        self._noted = 0
        """Bytes that came from the probe, and stacks."""
        self._status: int | None = None
        self._stopped_by = ""
        self._events: list[dict[str, Any]] = []
        self._records: dict[str, dict[str, Any]] = {}
        """Events that stand for a thing, by its key: only the last one counts."""
        self._event_rest = b""
        self._event_bytes = 0
        self._stacks = bytearray()
        self.readers: list[int] = []
        """The pipes from it that are still open."""

    # What the sandbox's thread tells it; all under the condition's lock.

    def _started(self, handle: int) -> None:
        self._handle = handle
        self.pid = pid_of(handle)

    def _take_output(self, data: bytes) -> None:
        half = self._limits.output_kept // 2
        self._written += len(data)
        room = half - len(self._head)
        self._head += data[:room]
        self._tail += data[room:] if room < len(data) else b""
        if len(self._tail) > 2 * half:
            del self._tail[:-half]

    def _take_events(self, data: bytes) -> None:
        self._noted += len(data)
        *lines, self._event_rest = (self._event_rest + data).split(b"\n")
        self._event_rest = self._event_rest[-_LONGEST_NOTE:]
        for line in lines:
            if len(line) >= _LONGEST_NOTE:
                continue
            with contextlib.suppress(ValueError, RecursionError):
                event = json.loads(line)
                if isinstance(event, dict):
                    self._take_event(event, len(line))

    def _take_event(self, event: dict[str, Any], size: int) -> None:
        """Keep an event; one that has a key stands for a thing, and takes the place of the one before it."""
        key = event.get("key")
        if isinstance(key, str) and (key in self._records or len(self._records) < _RECORDS):
            self._records[key] = event
        elif key is None and len(self._events) < self._limits.events and self._event_bytes <= _NOTES_KEPT:
            self._event_bytes += size
            self._events.append(event)

    def _take_stacks(self, data: bytes) -> None:
        self._noted += len(data)
        if len(self._stacks) < self._limits.output_kept:
            self._stacks += data

    def _ended(self, status: int) -> None:
        if self._status is not None:
            return
        self._status = status
        if not self._stopped_by and status != 0 and any(event.get("e") == "memory_error" for event in self._events):
            self._stopped_by = "memory limit"
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def _kill(self, why: str) -> None:
        """End it because of a limit."""
        if self._status is None and not self._stopped_by:
            self._stopped_by = why
        self.signal(signal.SIGKILL)

    # What others ask of it.

    def running(self) -> bool:
        """Whether it has not ended."""
        return self._status is None

    def exit_status(self) -> int | None:
        """Return None while it runs; negative: the number of the signal that ended it."""
        return self._status

    def stopped_by(self) -> str:
        """Return which limit ended it (`memory limit` or `process limit`), or "" for none."""
        return self._stopped_by

    def output(self) -> str:
        """Return what it has printed so far: of a long output the beginning and the end."""
        self._catch_up(self)
        with self._changed:
            half = self._limits.output_kept // 2
            tail = bytes(self._tail[-half:])
            cut = b"\n[...]\n" if self.truncated() else b""
            return (bytes(self._head) + cut + tail).decode("utf-8", "replace")

    def truncated(self) -> bool:
        """Whether `output` has a gap."""
        return self._written > self._limits.output_kept // 2 * 2

    def events(self) -> list[dict[str, Any]]:
        """Return what the probe inside it noted, in order. The program can forge it: for hints, never for points.

        What happened before it sent an answer or a message is in here once that has arrived; what stands for a thing
        (the events with a `key`) follows within a moment.
        """
        self._catch_up(self)
        with self._changed:
            return [*self._events, *self._records.values()]

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended, at most `timeout` seconds; return whether it has."""
        with self._changed:
            return self._changed.wait_for(lambda: self._status is not None, timeout)

    def signal(self, number: int) -> None:
        """Send it a signal, if it still runs."""
        with self._changed, contextlib.suppress(ProcessLookupError):
            if self._status is None and self._handle >= 0:
                signal.pidfd_send_signal(self._handle, number)

    def stop(self, grace: float = 1.0) -> None:
        """Ask it to end (SIGTERM); after `grace` seconds make it end (SIGKILL)."""
        self.signal(signal.SIGTERM)
        if not self.wait(grace):
            self.signal(signal.SIGKILL)
            self.wait(1.0)

    def stacks(self, timeout: float = 1.0) -> str:
        """Return what each of its threads does now, as a traceback each, newest call first; "" if it does not say."""
        self._catch_up(self)  # what is left of an earlier answer is none to this question
        with self._changed:
            self._stacks.clear()
            if self._status is not None:
                return ""
            self.signal(thread_stacks.STACK_SIGNAL)
            self._changed.wait_for(lambda: thread_stacks.END in self._stacks or self._status is not None, timeout)
            return self._stacks.decode("utf-8", "replace")
