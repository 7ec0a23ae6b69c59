"""`ros2 topic echo`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import yaml
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.qos import QoSDurabilityPolicy, QoSPresetProfiles, QoSProfile, QoSReliabilityPolicy
from rclpy.validate_full_topic_name import validate_full_topic_name

from autograder.ros2 import messages
from autograder.ros2.failure import Failure
from autograder.ros2.interfaces import interface
from autograder.ros2.options import joins, positive, profile, qos, to_match, unsigned
from autograder.ros2.session import Session

LONGEST = 128
"""Elements or characters of one value that are written by default."""


def add_verbs(verbs: Any) -> None:
    """Add it to the parser."""
    parser = joins(verbs.add_parser("echo", help="Output messages from a topic"))
    parser.add_argument("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')")
    parser.add_argument("message_type", nargs="?", help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
    qos(parser, "sensor_data")
    parser.add_argument("--csv", action="store_true", help="Output all fields separated by commas")
    parser.add_argument("--field", metavar="FIELD", help="Echo a selected field of a message, such as 'pose.position'")
    parser.add_argument("-f", "--full-length", action="store_true", help="Output all elements of arrays and strings")
    parser.add_argument(
        "-l", "--truncate-length", type=unsigned, default=LONGEST, help=f"Where to cut them (default: {LONGEST})"
    )
    parser.add_argument("--no-arr", action="store_true", help="Don't print array fields of messages")
    parser.add_argument("--no-str", action="store_true", help="Don't print string fields of messages")
    parser.add_argument("--flow-style", action="store_true", help="Print collections in the block style")
    parser.add_argument("--no-lost-messages", action="store_true", help="Don't report when a message is lost")
    parser.add_argument("--filter", dest="expression", metavar="EXPR", help="Only messages that match, as 'm.data > 3'")
    parser.add_argument("--raw", action="store_true", help="Echo the raw binary representation")
    parser.add_argument("--include-message-info", action="store_true", help="Shows the associated message info")
    count = parser.add_mutually_exclusive_group()
    count.add_argument("--once", action="store_true", help="Print the first message received and then exit")
    count.add_argument(
        "-n", metavar="N", dest="count", type=positive, help="Print N messages and exit (this kit's own)"
    )
    parser.add_argument("--timeout", metavar="N", type=float, help="Give up after N seconds without a message")
    parser.set_defaults(run=_echo)


def full_topic(session: Session, name: str) -> str:
    """A topic's full name.

    Raises:
        Failure: it can be none.
    """
    try:
        full = expand_topic_name(name, session.node.get_name(), session.node.get_namespace())
        validate_full_topic_name(full)
    except (ValueError, InvalidTopicNameException) as error:
        raise Failure(str(error)) from error
    return str(full)


def type_of(session: Session, name: str) -> Any | None:
    """The message class of a topic that is on the graph, or None.

    Raises:
        Failure: it has several types, or one that is not installed here.
    """
    full = full_topic(session, name)
    types = session.look_for(lambda: dict(session.topics(hidden=True)).get(full))
    if not types:
        return None
    if len(types) > 1:
        raise Failure(f"Cannot echo topic '{name}', as it contains more than one type: [{', '.join(types)}]")
    try:
        return interface(types[0], "msg")
    except LookupError:
        raise Failure(f"The message type '{types[0]}' is invalid") from None


def matching(session: Session, name: str, options: Any) -> QoSProfile:
    """The profile to listen with: the options' own, or what hears all publishers that there are."""
    chosen = [value for option, value in vars(options).items() if option.startswith("qos_")]
    sensor = QoSPresetProfiles.SENSOR_DATA.value
    if any(value is not None for value in chosen):
        return profile(options, sensor)
    ends = session.publishers(full_topic(session, name))
    made = to_match(ends)
    made.depth = sensor.depth
    for what, value, everywhere in (
        ("Reliability", QoSReliabilityPolicy.RELIABLE, made.reliability),
        ("Durability", QoSDurabilityPolicy.TRANSIENT_LOCAL, made.durability),
    ):
        offers = [getattr(end.qos_profile, what.lower()) for end in ends]
        if value in offers and everywhere != value:
            fall_back = "BEST_EFFORT" if what == "Reliability" else "VOLATILE"
            print(
                f"Some, but not all, publishers are offering QoS{what}Policy.{value.name}. "
                f"Falling back to QoS{what}Policy.{fall_back} as it will connect to all publishers"
            )
    return made


def wanted_messages(expression: str | None) -> Callable[[Any], bool]:
    """What `--filter` asks for: whether a message, `m` in the expression, is one of those; without one, all are.

    Raises:
        Failure: it is no expression; or, when it is asked, it does not fit the message.
    """
    if expression is None:
        return lambda _: True
    try:
        code = compile(expression, "EXPR", "eval")
    except (SyntaxError, ValueError) as error:
        raise Failure(f"Invalid filter '{expression}': {error}") from None

    def wanted(message: Any) -> bool:
        try:
            return bool(eval(code, {}, {"m": message}))
        except Exception as error:
            raise Failure(f"Invalid filter '{expression}': {error}") from None

    return wanted


def _echo(session: Session, options: Any) -> None:
    if options.message_type is None:
        message_type = type_of(session, options.topic_name)
        if message_type is None:
            print(f"WARNING: topic [{options.topic_name}] does not appear to be published yet", flush=True)
            raise Failure("Could not determine the type for the passed topic")
    else:
        try:
            message_type = interface(options.message_type, "msg")
        except LookupError:
            raise Failure(f"The message type '{options.message_type}' is invalid") from None
    passes = wanted_messages(options.expression)
    fields = None if options.field is None else [name for name in options.field.split(".") if name]
    if fields == []:
        raise Failure(f"Invalid field value '{options.field}'")
    wanted = 1 if options.once else options.count
    printed = 0

    def take(message: Any, info: dict[str, Any]) -> None:
        nonlocal printed
        if wanted is not None and printed >= wanted:
            return
        value = message
        for name in fields or ():
            try:
                value = getattr(value, name)
            except AttributeError as error:
                raise Failure(f"Invalid field '{'.'.join(fields or ())}': {error}") from None
        if passes(value):
            _print(value, info if options.include_message_info else None, options)
            printed += 1

    lost = None if options.no_lost_messages else _lost
    session.node.create_subscription(
        message_type,
        options.topic_name,
        take,
        matching(session, options.topic_name, options),
        event_callbacks=SubscriptionEventCallbacks(message_lost=lost),
        raw=options.raw,
    )
    done = (lambda: False) if wanted is None else (lambda: printed >= wanted)
    session.spin_until(done, options.timeout)


def _lost(status: Any) -> None:
    print(
        f"A message was lost!!!\n\ttotal count change:{status.total_count_change}\n\ttotal count: {status.total_count}"
    )


def _print(value: Any, info: dict[str, Any] | None, options: Any) -> None:
    """Print a message, or what a field of one holds, after what the middleware says of it."""
    if not messages.is_message(value):
        if info:
            print(f"---Got new message, message info:---\n{info}\n---Message data:---")
        print(value, end="\n---\n", flush=True)
        return
    longest = None if options.full_length else options.truncate_length
    shape = messages.Shape(longest, not options.no_arr, not options.no_str)
    if options.csv:
        before = [*map(str, info.values())] if info else []
        print(",".join([*before, messages.to_csv(value, shape)]), flush=True)
        return
    if info:
        print(yaml.safe_dump(info), end="---------\n")
    print(messages.to_yaml(value, shape, options.flow_style), end="---\n", flush=True)
