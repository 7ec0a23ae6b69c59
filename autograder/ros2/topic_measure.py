"""`ros2 topic hz`, `bw` and `delay`."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.time import Time

from autograder.ros2.failure import Failure
from autograder.ros2.options import joins, positive
from autograder.ros2.session import Session
from autograder.ros2.topic_listen import matching, type_of, wanted_messages

_EVERY = 1.0
"""Seconds between two reports."""


def add_verbs(verbs: Any) -> None:
    """Add them to the parser."""
    parser = joins(verbs.add_parser("hz", help="Print the average receiving rate to screen"))
    _common(parser, 10_000)
    parser.add_argument("--filter", dest="expression", metavar="EXPR", help="only measure messages that match")
    parser.add_argument("--wall-time", action="store_true", help="calculates rate using wall time")
    parser.set_defaults(run=_hz)
    parser = joins(verbs.add_parser("bw", help="Display bandwidth used by topic"))
    _common(parser, 100)
    parser.set_defaults(run=_bw)
    parser = joins(verbs.add_parser("delay", help="Display delay of topic from timestamp in header"))
    _common(parser, 10_000)
    parser.set_defaults(run=_delay)


def _common(parser: Any, window: int) -> None:
    parser.add_argument("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')")
    parser.add_argument(
        "-w", "--window", type=positive, default=window, help=f"window size, in # of messages (default: {window})"
    )


def _listen(session: Session, options: Any, take: Callable[[Any], None], raw: bool) -> None:
    """Subscribe to the topic, once it is there."""
    found = type_of(session, options.topic_name)
    if found is None:
        print(f"WARNING: topic [{options.topic_name}] does not appear to be published yet", flush=True)

        def appeared() -> bool:
            nonlocal found
            found = type_of(session, options.topic_name)
            return found is not None

        session.spin_until(appeared)
    options_of_qos = matching(session, options.topic_name, options)
    session.node.create_subscription(found, options.topic_name, take, options_of_qos, raw=raw)


def _hz(session: Session, options: Any) -> None:
    passes = wanted_messages(options.expression)
    clock = Clock(clock_type=ClockType.SYSTEM_TIME) if options.wall_time else session.node.get_clock()
    gaps: deque[int] = deque(maxlen=options.window)
    last = reported = 0

    def take(message: Any) -> None:
        nonlocal last, reported
        if not passes(message):
            return
        now = clock.now().nanoseconds
        if last and now >= last:
            gaps.append(now - last)
            reported = reported or now
        else:
            gaps.clear()
        last = now
        if gaps and now - reported >= _EVERY * 1e9:
            reported = now
            print(f"average rate: {1e9 * len(gaps) / sum(gaps):.3f}\n\t{_spread(gaps)}", flush=True)

    _listen(session, options, take, raw=options.expression is None)
    session.spin_until(lambda: False)


def _spread(nanoseconds: deque[int]) -> str:
    """The line below an average."""
    return (
        f"min: {min(nanoseconds) * 1e-9:.3f}s max: {max(nanoseconds) * 1e-9:.3f}s "
        f"std dev: {statistics.pstdev(nanoseconds) * 1e-9:.5f}s window: {len(nanoseconds)}"
    )


def _bw(session: Session, options: Any) -> None:
    sizes: deque[tuple[float, int]] = deque(maxlen=options.window)
    _listen(session, options, lambda data: sizes.append((time.monotonic(), len(data))), raw=True)
    print(f"Subscribed to [{options.topic_name}]", flush=True)

    def report() -> None:
        if len(sizes) < 2:
            return
        numbers = [size for _, size in sizes]
        rate = sum(numbers) / (time.monotonic() - sizes[0][0])
        unit, divisor, digits = next(
            one for one in (("B", 1, 0), ("KB", 1e3, 2), ("MB", 1e6, 2)) if rate < 1000 * one[1] or one[0] == "MB"
        )
        mean, least, most = (
            f"{number / divisor:.{digits}f} {unit}"
            for number in (sum(numbers) / len(numbers), min(numbers), max(numbers))
        )
        print(f"{rate / divisor:.{digits}f} {unit}/s from {len(numbers)} messages")
        print(f"\tMessage size mean: {mean} min: {least} max: {most}", flush=True)

    session.node.create_timer(_EVERY, report)
    session.spin_until(lambda: False)


def _delay(session: Session, options: Any) -> None:
    delays: deque[int] = deque(maxlen=options.window)
    new = 0
    clock = session.node.get_clock()

    def take(message: Any) -> None:
        nonlocal new
        if not hasattr(message, "header"):
            raise Failure("msg does not have header")
        delays.append((clock.now() - Time.from_msg(message.header.stamp, clock_type=clock.clock_type)).nanoseconds)
        new += 1

    def report() -> None:
        nonlocal new
        if delays and not new:
            print("no new messages", flush=True)
        elif delays:
            print(f"average delay: {sum(delays) / len(delays) * 1e-9:.3f}\n\t{_spread(delays)}", flush=True)
        new = 0

    _listen(session, options, take, raw=False)
    session.node.create_timer(_EVERY, report)
    session.spin_until(lambda: False)
