"""The pipes from a program: its output, its probe's notes, its threads' stacks.

One that writes without end is read no faster than a terminal would read it. Then it has to wait when it prints, as it
would there, and neither it nor the reading takes the machine from others.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable

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
