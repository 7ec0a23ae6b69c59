"""One running program of a student, as the process that controls the launcher sees it."""

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
"""The nice value with the lowest priority (sched(7))."""
_TO_BEGIN = 1.0
"""The seconds of CPU time up to which a program is not examined; an idle node never uses more."""
_ON_AND_ON = 10.0
"""A program computes all the time if it uses more than this many seconds of CPU time within one period."""
_LOOKS = 50
"""After this many looks, a new period begins if the program did not want to compute at most of them."""


class Priority:
    """The priority of one program, which is examined at intervals.

    A program that computes all the time gets the lowest priority. It cannot get its priority back, so there must be
    clear evidence: many seconds of CPU time within a period during most of which it wanted to compute, whether it got a
    CPU or not. The CPU time that a program needs to start, on any machine, does not count as this.
    """

    def __init__(self) -> None:
        """Begin with the normal priority."""
        self._behind = False
        self._looks = self._wanted = 0
        """The looks since this period began, and those at which the program wanted to compute."""
        self._before = 0.0
        """The seconds of CPU time that the program had used when this period began."""

    def look(self, pid: int) -> None:
        """Give all threads of the program the lowest priority if it computes all the time.

        This overrides priorities that the program itself has set for some threads. The other programs of its launch and
        of other launches come first then. If the kernel divides the CPUs between sessions (sched(7), the autogroup
        feature), the program gets no more than the share of one session, with any number of threads, because each
        program is in its own session.

        Args:
            pid: the process ID of the program.
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
"""The bytes from which a line is dropped; the probe's own lines are shorter."""
_NOTES_KEPT = 1 << 20
"""The bytes of notes that are kept for one program. In memory, they take up to twenty times as much."""
_RECORDS = 500
"""The number of things for which a record is kept. Only the last record of each thing is kept."""


class RunningProgram:
    """A program that was started. The sandbox's own thread reads its output continuously.

    Attributes:
        name: the name with which `RunningPrograms.start` was called.
    """

    def __init__(
        self, name: str, limits: Limits, changed: threading.Condition, catch_up: Callable[[RunningProgram], None]
    ) -> None:
        """Begin without a process; `RunningPrograms.start` creates the object."""
        self.name = name
        self._limits = limits
        self._changed = changed
        self._catch_up = catch_up
        self._handle = -1
        self.pid = -1
        """The process ID as this process sees it."""
        self.priority = Priority()
        self.began = time.monotonic()
        self.told_to_end = False
        """Whether it was sent a signal that asks a program to end, which shuts down rclpy while its callbacks run."""
        self._head = bytearray()
        self._tail = bytearray()
        self._written = 0
        self._noted = 0
        """The bytes that came from the probe, and stacks."""
        self._status: int | None = None
        self._stopped_by = ""
        self._events: list[dict[str, Any]] = []
        self._records: dict[str, dict[str, Any]] = {}
        """The last record of each thing, by the key of the thing."""
        self._event_rest = b""
        self._event_bytes = 0
        self._stacks = bytearray()
        self.readers: list[int] = []
        """The pipes from the program that are still open."""

    # Methods for the sandbox's thread, which calls them while it holds the condition's lock.

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
        """Keep an event. One with a key is the record of a thing, and replaces its earlier record."""
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
        """End the program because of a limit."""
        if self._status is None and not self._stopped_by:
            self._stopped_by = why
        self.signal(signal.SIGKILL)

    # Methods for callers.

    def running(self) -> bool:
        """Whether the program has not ended."""
        return self._status is None

    def exit_status(self) -> int | None:
        """Return the exit status, or None while the program runs.

        A negative number is that of the signal that ended the program.
        """
        return self._status

    def stopped_by(self) -> str:
        """Return the limit because of which the program was ended (`memory limit` or `process limit`), or ""."""
        return self._stopped_by

    def output(self) -> str:
        """Return the program's output so far. Of a long output, only the beginning and the end are kept."""
        self._catch_up(self)
        with self._changed:
            half = self._limits.output_kept // 2
            tail = bytes(self._tail[-half:])
            cut = b"\n[...]\n" if self.truncated() else b""
            return (bytes(self._head) + cut + tail).decode("utf-8", "replace")

    def truncated(self) -> bool:
        """Whether a part is missing from `output`."""
        return self._written > self._limits.output_kept // 2 * 2

    def events(self) -> list[dict[str, Any]]:
        """Return the events that the probe inside the program noted, in order.

        The program can forge them, so they may be used for hints, but never for points. Everything that happened before
        the program sent a response or a message is included once that has arrived. Only the records of things (the
        events with a `key`) may come a moment later.
        """
        self._catch_up(self)
        with self._changed:
            return [*self._events, *self._records.values()]

    def wait(self, timeout: float) -> bool:
        """Wait until the program has ended, at most `timeout` seconds, and return whether it has ended."""
        with self._changed:
            return self._changed.wait_for(lambda: self._status is not None, timeout)

    def signal(self, number: int) -> None:
        """Send the program a signal, if it is still running."""
        with self._changed, contextlib.suppress(ProcessLookupError):
            if self._status is None and self._handle >= 0:
                self.told_to_end |= number in (signal.SIGINT, signal.SIGTERM)
                signal.pidfd_send_signal(self._handle, number)

    def stop(self, grace: float = 1.0) -> None:
        """Ask the program to end (SIGTERM), and kill it (SIGKILL) if it has not ended after `grace` seconds."""
        self.signal(signal.SIGTERM)
        if not self.wait(grace):
            self.signal(signal.SIGKILL)
            self.wait(1.0)

    def stacks(self, timeout: float = 1.0) -> str:
        """Return a traceback of each thread of the program, newest call first, or "" if the program does not answer."""
        self._catch_up(self)  # otherwise the rest of an earlier answer would be taken for the answer to this request
        with self._changed:
            self._stacks.clear()
            if self._status is not None:
                return ""
            self.signal(thread_stacks.STACK_SIGNAL)
            self._changed.wait_for(lambda: thread_stacks.END in self._stacks or self._status is not None, timeout)
            return self._stacks.decode("utf-8", "replace")
