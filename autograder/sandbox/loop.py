"""One thread that waits for descriptors, runs requested actions, and calls a function at intervals."""

from __future__ import annotations

import contextlib
import os
import queue
import selectors
import threading
import time
import traceback
from collections.abc import Callable

from autograder.core.errors import KitError

_LOOK_EVERY = 0.1
"""The least seconds between two looks."""
_TIME_BETWEEN_LOOKS = 50
"""The time between two looks is at least this many times as long as a look takes, because a look is expensive on a
machine with thousands of processes."""


class Loop:
    """Runs callbacks one after another in its own thread, which runs until `stop`.

    Args:
        busy: whether there is anything to look at.
        look: called about every 0.1 s as long as there is something to look at.
    """

    def __init__(self, busy: Callable[[], bool], look: Callable[[], None]) -> None:
        """Start the thread."""
        self._busy, self._look = busy, look
        self._wake_read, self._wake_write = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        self._todo: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._on_wake)
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="node sandbox", daemon=True)
        self._thread.start()

    def do(self, action: Callable[[], None]) -> None:
        """Run an action in the thread and wait until it is done. An exception that it raises is raised here."""
        if threading.current_thread() is self._thread:
            action()
            return
        done = threading.Event()
        problem: list[BaseException] = []

        def run() -> None:
            try:
                action()
            except BaseException as error:
                problem.append(error)
            finally:
                done.set()

        self._todo.put(run)
        os.write(self._wake_write, b"x")
        while not done.wait(0.5):
            if not self._thread.is_alive():
                raise KitError("The node sandbox has ended by itself.", "Run the command again.")
        if problem:
            raise problem[0]

    def when_readable(self, descriptor: int, action: Callable[[], None]) -> None:
        """Call `action` whenever there is something to read; call this only in the thread itself."""
        self._selector.register(descriptor, selectors.EVENT_READ, action)

    def read_now(self, descriptor: int) -> None:
        """Call the action of a descriptor if it is still registered; call this only in the thread itself."""
        key = self._selector.get_map().get(descriptor)
        if key is not None:
            key.data()

    def forget(self, descriptor: int) -> None:
        """Stop waiting for a descriptor; call this only in the thread itself."""
        self._selector.unregister(descriptor)

    def stop(self) -> None:
        """End the thread, and close its descriptors."""
        self._stopped = True
        os.write(self._wake_write, b"x")
        self._thread.join()
        self._selector.close()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _on_wake(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake_read, 4096)
        while not self._todo.empty():
            self._todo.get()()

    def _run(self) -> None:
        due = 0.0
        while not self._stopped:
            for key, _ in self._selector.select(max(0.0, due - time.monotonic()) if self._busy() else None):
                self._call_and_go_on(key.data)
            if time.monotonic() >= due and self._busy():
                began = time.thread_time()
                self._call_and_go_on(self._look)
                due = time.monotonic() + max(_LOOK_EVERY, _TIME_BETWEEN_LOOKS * (time.thread_time() - began))

    @staticmethod
    def _call_and_go_on(action: Callable[[], object]) -> None:
        """Call an action. An error in it must not end this thread, because other threads wait for it."""
        try:
            action()
        except Exception:
            traceback.print_exc()
