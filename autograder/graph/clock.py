"""Simulated time: the observer publishes `/clock`, step by step, to nodes that use sim time."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from autograder.graph.observer import Observer

REPEAT = 0.1
"""Seconds after which an unanswered stamp is sent again: it may have been lost before the node was matched."""


class ClockDriver:
    """Publishes `/clock`, only when told to: time in the launch stands still in between."""

    def __init__(self, observer: Observer) -> None:
        """Start at 1 s: rclpy takes time 0 for "not set"."""
        self._observer = observer
        self._publisher = observer.publisher("/clock", Clock, 10)
        self.now = 1.0
        """Simulated seconds."""

    def advance(self, step: float, effect: Callable[[], bool], within: float = 5.0) -> bool:
        """Move time on by `step` seconds and wait for its effect; the stamp is repeated until the effect shows.

        A clock that runs freely loses ticks on a busy machine; in lock-step each run has the same ticks.
        """
        self.now += step
        stamp = Clock(clock=Time(nanoseconds=round(self.now * 1e9)).to_msg())
        for _ in range(max(1, round(within / REPEAT))):
            self._publisher.publish(stamp)
            if self._observer.wait(effect, REPEAT):
                return True
        return False
