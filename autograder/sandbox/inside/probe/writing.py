"""Writes the notes: events immediately, and changed records of things by a separate thread."""

import _thread
import contextlib
import functools
import itertools
import json
import os
import threading
import time
import weakref
from typing import Any, Protocol

from . import events

_MOST = 500
"""The largest number of events of one program, and of its records. Repeated events are written only once."""

_MOST_RUNS = 2000
"""The number of runs of callbacks, and of messages sent, that are written individually, for pictures. Further ones are
only counted."""

_RUNS_OF_A_LINE = 60
"""The number of runs in a line, which is then shorter than `_WHOLE`."""

PAUSE = 0.25
"""The seconds between two writings of changed records."""

_WHOLE = 4000
"""The bytes that a pipe accepts either completely or not at all."""

quiet = functools.partial(contextlib.suppress, Exception)
"""A block whose exceptions do not reach the program."""


class _Channel:
    """The descriptor to which events are written, and how many more may be written."""

    def __init__(self) -> None:
        self.descriptor = -1
        self.left = _MOST
        self.once: set[tuple[str, ...]] = set()


_channel = _Channel()


_encoder = json.JSONEncoder(default=vars)


def _line_of(event: events.Event, **more: str) -> bytes:
    note = {**more, **vars(event)}
    short = {key: value[:500] if isinstance(value, str) else value for key, value in note.items()}
    return _encoder.encode(short).encode()[: _WHOLE - 1] + b"\n"


def open_channel(descriptor: int) -> None:
    """Set the descriptor to which events are written from now on."""
    _channel.descriptor = descriptor


def emit(event: events.Event) -> None:
    """Write one event, or drop it if the pipe is full, because a full pipe must not block the program."""
    if _channel.descriptor < 0 or _channel.left <= 0:
        return
    _channel.left -= 1
    with quiet():
        os.write(_channel.descriptor, _line_of(event))


def emit_once(event: events.Event) -> None:
    """Write an event unless an equal one was written before."""
    key = tuple(str(value) for value in vars(event).values())
    if key not in _channel.once:
        _channel.once.add(key)
        emit(event)


class Record(Protocol):
    """The current state of a thing."""

    key: str
    dirty: bool

    def event(self) -> events.Record:
        """Return the record's line in its current state."""


class Ledger:
    """The known things, and the thread that writes changed records.

    The thread sleeps until something changes. It is not created with `threading`, so that a program that counts its
    threads does not find it.
    """

    def __init__(self) -> None:
        """Begin without records. The thread starts at the first change."""
        self.lock = threading.Lock()
        self.numbers = itertools.count(1)
        self.known: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        """The record of each known object of rclpy."""
        self.always: list[Record] = []
        """Records that change with every callback, and are written whenever any record is written."""
        self._records: list[Record] = []
        self._changed: dict[str, Record] = {}
        self._ran: list[tuple[int, float, float, int]] = []
        self._runs_left = _MOST_RUNS
        self._wake = _thread.allocate_lock()
        self._wake.acquire()
        self._started = False

    def add(self, record: Record, of: Any = None) -> None:
        """Add a record; `of` is the object of rclpy that it describes."""
        if len(self._records) < _MOST:
            self._records.append(record)
            if of is not None:
                self.known[of] = record
            # It is written immediately, because a thing that appears on the graph must already be known here.
            try:
                os.write(_channel.descriptor, _line_of(record.event(), key=record.key))
            except OSError:
                self.touch(record)

    def touch(self, record: Record) -> None:
        """Note that a record has changed."""
        if record.dirty or _channel.descriptor < 0:
            return
        record.dirty = True
        with self.lock:
            self._changed[record.key] = record
            start, self._started = not self._started, True
        if start:
            _thread.start_new_thread(self._write_on, ())
        if self._wake.locked():
            with contextlib.suppress(RuntimeError):  # another thread has already released it
                self._wake.release()

    def ran(self, number: int, began: float, ended: float, thread: int) -> None:
        """Note one run of a thing's callback, or one message that was sent. The caller holds the lock."""
        if self._runs_left > 0:
            self._runs_left -= 1
            self._ran.append((number, round(began, 4), round(ended, 4), thread))

    def _write_on(self) -> None:
        while True:
            self._wake.acquire()
            self.write()
            time.sleep(PAUSE)

    def write(self) -> None:
        """Write everything that has changed, in pieces that the pipe accepts completely."""
        with self.lock:
            changed, self._changed = self._changed, {}
            ran, self._ran = self._ran, []
        changed.update({record.key: record for record in self.always})
        piece = b""
        for record in changed.values():
            with quiet():
                record.dirty = False  # set before the record is read, so that later changes are written next time
                line = _line_of(record.event(), key=record.key)
                if len(piece) + len(line) > _WHOLE:
                    os.write(_channel.descriptor, piece)
                    piece = b""
                piece += line
        if piece:
            with quiet():
                os.write(_channel.descriptor, piece)
        for first in range(0, len(ran), _RUNS_OF_A_LINE):
            event = events.Ran(runs=ran[first : first + _RUNS_OF_A_LINE])
            with quiet():
                os.write(_channel.descriptor, _line_of(event))


ledger = Ledger()
