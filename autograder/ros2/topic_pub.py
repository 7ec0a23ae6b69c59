"""`ros2 topic pub`."""

from __future__ import annotations

import time
from typing import Any

import yaml
from rclpy.qos import QoSProfile

from autograder.ros2 import messages
from autograder.ros2.failure import Failure
from autograder.ros2.interfaces import interface
from autograder.ros2.options import above_zero, joins, profile, qos, unsigned, values, yaml_text
from autograder.ros2.session import Session

_SAY_AGAIN = 1.0
"""Seconds after which a line says once more what is waited for."""


def add_verbs(verbs: Any) -> None:
    """Add it to the parser."""
    parser = joins(verbs.add_parser("pub", help="Publish a message to a topic"))
    parser.add_argument("topic_name", help="Name of the ROS topic to publish to (e.g. '/chatter')")
    parser.add_argument("message_type", help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
    values(parser, "values", "Values in YAML format (e.g. '{data: Hello World}')")
    parser.add_argument("-r", "--rate", metavar="N", type=above_zero, default=1.0, help="Rate in Hz (default: 1)")
    parser.add_argument("-p", "--print", metavar="N", type=int, default=1, help="Only print every N-th message")
    count = parser.add_mutually_exclusive_group()
    count.add_argument("-1", "--once", action="store_true", help="Publish one message and exit")
    count.add_argument("-t", "--times", type=unsigned, default=0, help="Publish this number of times and then exit")
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=unsigned, help="Wait for so many (default: 1 with -1 or -t, else 0)"
    )
    parser.add_argument("--max-wait-time-secs", type=above_zero, help="Give up to wait after so long")
    parser.add_argument("--keep-alive", metavar="N", type=above_zero, default=0.1, help="Stay N seconds after the last")
    parser.add_argument("-n", "--node-name", help="Name of the created publishing node")
    qos(parser, "default")
    parser.set_defaults(run=_pub)


def _pub(session: Session, options: Any) -> None:
    try:
        message_type = interface(options.message_type, "msg")
    except LookupError:
        raise Failure("The passed message type is invalid") from None
    given = _dictionary(yaml_text(options, "values"))
    if options.node_name:
        session.name = options.node_name
    message = message_type()
    stamps: list[Any] = []
    try:
        messages.fill(message, given, stamps)
    except Exception as error:
        raise Failure(f"Failed to populate field: {error}") from None
    publisher = session.node.create_publisher(message_type, options.topic_name, profile(options, QoSProfile(depth=10)))
    times = 1 if options.once else options.times
    wanted = options.wait_matching_subscriptions
    _wait(session, publisher, (1 if times else 0) if wanted is None else wanted, options.max_wait_time_secs)
    print("publisher: beginning loop", flush=True)
    count = 0

    def publish() -> None:
        nonlocal count
        now = session.node.get_clock().now().to_msg()
        for stamp in stamps:
            stamp.sec, stamp.nanosec = now.sec, now.nanosec
        count += 1
        if options.print and count % options.print == 0:
            print(f"publishing #{count}: {message!r}\n", flush=True)
        publisher.publish(message)

    session.node.create_timer(1 / options.rate, publish)
    session.spin_until(lambda: times and count >= times)
    session.stay(options.keep_alive)  # for the middleware to send what it still holds


def _dictionary(text: str) -> dict[str, Any]:
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise Failure(f"The passed value needs to be a dictionary in YAML format: {error}") from None
    if not isinstance(values, dict):
        raise Failure("The passed value needs to be a dictionary in YAML format")
    return values


def _wait(session: Session, publisher: Any, count: int, within: float | None) -> None:
    """Wait for so many subscriptions that match."""
    began = time.monotonic()
    while publisher.get_subscription_count() < count:
        if within is not None and time.monotonic() - began >= within:
            raise Failure(f"Timed out waiting for subscribers: Expected {count} subscribers but only got "
                          f"{publisher.get_subscription_count()} subscribers")  # fmt: skip
        print(f"Waiting for at least {count} matching subscription(s)...", flush=True)
        session.spin_until(lambda: publisher.get_subscription_count() >= count, _SAY_AGAIN)
