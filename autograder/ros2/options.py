"""Options that several verbs have, and the QoS profiles that they describe."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    QoSReliabilityPolicy,
)
from rclpy.topic_endpoint_info import TopicEndpointInfo

Parser = argparse.ArgumentParser


def add_graph_options(parser: Parser) -> Parser:
    """Add the options of every verb that looks at the graph."""
    parser.add_argument("--spin-time", type=float, help="seconds to listen before the graph is believed")
    parser.add_argument("-s", "--use-sim-time", action="store_true", help="take the time from /clock")
    parser.add_argument("--no-daemon", action="store_true", help="has no effect, because there is no daemon")
    return parser


def positive(text: str) -> int:
    """Parse an integer that is at least 1.

    Raises:
        argparse.ArgumentTypeError: the text is not such a number.
    """
    number = unsigned(text)
    if number == 0:
        raise argparse.ArgumentTypeError("value must be a positive integer")
    return number


def unsigned(text: str) -> int:
    """Parse an integer that is not negative.

    Raises:
        argparse.ArgumentTypeError: the text is not such a number.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError("value must be non-negative integer")
    return int(text)


def above_zero(text: str) -> float:
    """Parse a number greater than 0.

    Raises:
        ValueError: the text is not such a number.
    """
    if (number := float(text)) <= 0:
        raise ValueError(text)
    return number


def values(parser: Parser, name: str, text: str) -> None:
    """Add options for a YAML mapping, which is an argument or comes from standard input; `yaml_text` returns it."""
    given = parser.add_mutually_exclusive_group()
    given.add_argument(name, nargs="?", default="{}", help=text)
    given.add_argument("--stdin", action="store_true", help="Read values from standard input")


def yaml_text(options: Any, name: str) -> str:
    """Return the text of the YAML mapping for which `values` added the options."""
    return sys.stdin.read() if options.stdin else str(getattr(options, name))


def qos(parser: Parser, default: str) -> None:
    """Add the options for each policy."""
    presets = [name.lower() for name in QoSPresetProfiles.__members__ if name != "UNKNOWN"]
    parser.add_argument("--qos-profile", choices=presets, help=f"preset (default: {default})")
    parser.add_argument("--qos-depth", type=int, metavar="N", help="queue size, with keep_last")
    parser.add_argument("--qos-history", choices=_words(QoSHistoryPolicy))
    parser.add_argument("--qos-reliability", choices=_words(QoSReliabilityPolicy))
    parser.add_argument("--qos-durability", choices=_words(QoSDurabilityPolicy))
    parser.add_argument("--qos-liveliness", choices=_words(QoSLivelinessPolicy))
    parser.add_argument("--qos-liveliness-lease-duration-seconds", type=float, metavar="S")


def _words(policy: Any) -> list[str]:
    return [word for word in policy.short_keys() if word != "unknown"]


def profile(options: Any, default: QoSProfile) -> QoSProfile:
    """Return the profile that the options describe; policies without an option are those of the default profile."""
    start = default
    if options.qos_profile:
        start = QoSPresetProfiles.get_from_short_key(options.qos_profile)
    made = QoSProfile(
        history=start.history,
        depth=start.depth,
        reliability=start.reliability,
        durability=start.durability,
        liveliness=start.liveliness,
        liveliness_lease_duration=start.liveliness_lease_duration,
        deadline=start.deadline,
        lifespan=start.lifespan,
    )
    if options.qos_durability:
        made.durability = QoSDurabilityPolicy.get_from_short_key(options.qos_durability)
        if made.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL and options.qos_depth is None:
            made.depth = max(made.depth, 1)
    if options.qos_reliability:
        made.reliability = QoSReliabilityPolicy.get_from_short_key(options.qos_reliability)
    if options.qos_history:
        made.history = QoSHistoryPolicy.get_from_short_key(options.qos_history)
    if options.qos_depth is not None:
        made.depth = options.qos_depth
    if options.qos_liveliness:
        made.liveliness = QoSLivelinessPolicy.get_from_short_key(options.qos_liveliness)
    if options.qos_liveliness_lease_duration_seconds is not None:
        made.liveliness_lease_duration = Duration(seconds=options.qos_liveliness_lease_duration_seconds)
    return made


def to_match(publishers: list[TopicEndpointInfo]) -> QoSProfile:
    """Return a profile for a subscription that matches all of these publishers.

    It is reliable if all of them are, and transient local if all of them are. The real tool uses the same profile if no
    option specifies another one.
    """
    offered = [end.qos_profile for end in publishers]
    made = QoSProfile(depth=10)
    reliable = [one.reliability == QoSReliabilityPolicy.RELIABLE for one in offered]
    if offered and not all(reliable):
        made.reliability = QoSReliabilityPolicy.BEST_EFFORT
    if offered and all(one.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for one in offered):
        made.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL
    return made
