"""What a lab adds to the live view of a world: buttons of its own, and the rays that a program publishes."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from autograder.checks import current
from autograder.graph.observer import Observer

_LASTS = 0.5
"""The seconds for which a scan is shown, if no other one comes."""


@dataclass(frozen=True)
class Extras:
    """What a lab adds."""

    listen: Sequence[tuple[str, type]]
    """(topic, message class) of further topics to show beside the map."""
    scan: str
    """The topic of the rays that are shown, as seen from each car's namespace; empty for the world's own."""
    buttons: Mapping[str, Callable[[], object]]
    """What each of the lab's buttons does, by its words."""


class Buttons:
    """The buttons of a lab. What a button does runs in a thread of its own, so that it may wait for something.

    Args:
        named: what each button does, by its words; the text that is returned is told below the picture.
        tell: tells a sentence.
        checking: whether a check runs, which would take what a button does for its own.
    """

    def __init__(
        self, named: Mapping[str, Callable[[], object]], tell: Callable[[str], None], checking: Callable[[], bool]
    ) -> None:
        """Keep the buttons; nothing is pressed yet."""
        self._named, self._tell, self._checking = dict(named), tell, checking

    @property
    def words(self) -> list[str]:
        """What stands on the buttons."""
        return list(self._named)

    def press(self, words: str) -> None:
        """Do what this button does."""
        if words not in self._named:
            return
        if self._checking():
            self._tell(f"{words}: a check runs; press again when it has ended.")
            return
        threading.Thread(target=self._do, args=(words,), name=f"button {words}", daemon=True).start()

    def _do(self, words: str) -> None:
        outcomes = current.check.findings.outcomes
        known = len(outcomes)
        try:
            told = self._named[words]()
        except Exception as error:  # the lab's own code, for which nobody else answers
            failed = outcomes[-1].because if len(outcomes) > known else ""
            told = failed or str(error) or type(error).__name__
        del outcomes[known:]  # of an experiment no cell is to give a verdict
        self._tell(f"{words}: {told}" if isinstance(told, str) and told else words)


class ShownScan:
    """The last scan that a program has published on a topic.

    Args:
        observer: hears it.
        topic: its full name.
    """

    def __init__(self, observer: Observer, topic: str) -> None:
        """Begin to listen."""
        self._last: tuple[float, Any] | None = None
        self._subscription = observer.node.create_subscription(LaserScan, topic, self._take, qos_profile_sensor_data)

    def _take(self, message: LaserScan) -> None:
        self._last = (time.monotonic(), message)

    def rays(self, every: int) -> list[tuple[float, float]]:
        """Return the direction, as seen from the car, and the metres of one ray in `every`; none without a new scan."""
        last = self._last
        if last is None or time.monotonic() - last[0] > _LASTS:
            return []
        scan = last[1]
        ends = [
            (scan.angle_min + number * scan.angle_increment, min(float(metres), scan.range_max))
            for number, metres in list(enumerate(scan.ranges))[::every]
        ]
        return [end for end in ends if all(map(math.isfinite, end))]
