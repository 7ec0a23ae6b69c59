"""How notes are written: events at once, records of things by a thread of their own when they have changed."""

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
"""Events of one program; what it repeats is noted once. Records of things: no more either."""

_MOST_RUNS = 2000
"""Runs of callbacks, and messages sent, that are written down one by one: for pictures. The others are only counted."""

_RUNS_OF_A_LINE = 60
"""So many are shorter than `_WHOLE`."""

PAUSE = 0.25
"""Seconds between two writings of the records that have changed."""

_WHOLE = 4000
"""Bytes that a pipe takes whole or not at all."""

quiet = functools.partial(contextlib.suppress, Exception)
"""A block in which nothing that goes wrong reaches the program."""


class _Channel:
    """Where events go, and how many more do."""

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
    """Write to this descriptor from now on."""
    _channel.descriptor = descriptor


def emit(event: events.Event) -> None:
    """Write one event, or drop it: a full pipe must not hold up the program."""
    if _channel.descriptor < 0 or _channel.left <= 0:
        return
    _channel.left -= 1
    with quiet():
        os.write(_channel.descriptor, _line_of(event))


def emit_once(event: events.Event) -> None:
    """Write an event unless the same was written before."""
    key = tuple(str(value) for value in vars(event).values())
    if key not in _channel.once:
        _channel.once.add(key)
        emit(event)


class Record(Protocol):
    """What is known of a thing so far."""

    key: str
    dirty: bool

    def event(self) -> events.Record:
        """Return its line as it is now."""


class Ledger:
    """The things that are known, and the thread that writes down what has changed.

    The thread sleeps until something changes. It is none of `threading`'s, so that a program counts only its own.
    """

    def __init__(self) -> None:
        """Begin with none; the thread starts with the first change."""
        self.lock = threading.Lock()
        self.numbers = itertools.count(1)
        self.known: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        """Object of rclpy -> its record."""
        self.always: list[Record] = []
        """Records that change with every callback, and are written whenever anything is."""
        self._records: list[Record] = []
        self._changed: dict[str, Record] = {}
        self._ran: list[tuple[int, float, float, int]] = []
        self._runs_left = _MOST_RUNS
        self._wake = _thread.allocate_lock()
        self._wake.acquire()
        self._started = False

    def add(self, record: Record, of: Any = None) -> None:
        """Take up a record; `of` is the object of rclpy that it stands for."""
        if len(self._records) < _MOST:
            self._records.append(record)
            if of is not None:
                self.known[of] = record
            # At once: what the graph shows of a thing must find it known here.
            try:
                os.write(_channel.descriptor, _line_of(record.event(), key=record.key))
            except OSError:
                self.touch(record)

    def touch(self, record: Record) -> None:
        """Say that a record has changed."""
        if record.dirty or _channel.descriptor < 0:
            return
        record.dirty = True
        with self.lock:
            self._changed[record.key] = record
            start, self._started = not self._started, True
        if start:
            _thread.start_new_thread(self._write_on, ())
        if self._wake.locked():
            with contextlib.suppress(RuntimeError):  # another thread was faster
                self._wake.release()

    def ran(self, number: int, began: float, ended: float, thread: int) -> None:
        """Note one run of a thing's callback, or one message sent; the caller holds the lock."""
        if self._runs_left > 0:
            self._runs_left -= 1
            self._ran.append((number, round(began, 4), round(ended, 4), thread))

    def _write_on(self) -> None:
        while True:
            self._wake.acquire()
            self.write()
            time.sleep(PAUSE)

    def write(self) -> None:
        """Write what has changed, in pieces that the pipe takes whole."""
        with self.lock:
            changed, self._changed = self._changed, {}
            ran, self._ran = self._ran, []
        changed.update({record.key: record for record in self.always})
        piece = b""
        for record in changed.values():
            with quiet():
                record.dirty = False  # before it is read: what changes from here on is written the next time
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
