"""Ctrl-C in a program: always in one order, which rclpy leaves to luck.

At SIGINT a thread of rclpy's shuts the context down, while Python raises KeyboardInterrupt in the main thread.
Whichever comes second finds the work done. So `rclpy.shutdown()` after the exception mostly fails and sometimes does
not, and even `rclpy.try_shutdown()` fails once in a while, between its question and its deed. Here the shutdown always
comes first.
"""

import contextlib
import signal
import sys
import time
from types import FrameType

_SHUT_DOWN_WITHIN = 1.0
"""Seconds that are given to rclpy's thread, which takes milliseconds."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, as Python does, once rclpy has done what it does at this signal."""
    with contextlib.suppress(Exception):
        deadline = time.monotonic() + _SHUT_DOWN_WITHIN
        while _about_to_shut_down() and time.monotonic() < deadline:
            time.sleep(0.002)
    signal.default_int_handler(number, frame)


def _about_to_shut_down() -> bool:
    """Whether rclpy handles the signal, and its default context is still up.

    Without a lock: the main thread may hold any of them while this interrupts it.
    """
    signals, utilities = sys.modules.get("rclpy.signals"), sys.modules.get("rclpy.utilities")
    context = getattr(utilities, "g_default_context", None)
    if signals is None or context is None or context.handle is None:
        return False
    handled = signals.get_current_signal_handlers_options()
    options = signals.SignalHandlerOptions
    return handled in (options.ALL, options.SIGINT) and bool(context.handle.ok())
