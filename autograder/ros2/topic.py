"""The verbs of `ros2 topic`: they list topics, print and measure their messages, and publish messages."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import yaml
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.qos import QoSDurabilityPolicy, QoSPresetProfiles, QoSProfile, QoSReliabilityPolicy
from rclpy.time import Time
from rclpy.validate_full_topic_name import validate_full_topic_name

from autograder.ros2 import messages
from autograder.ros2.failure import Failure
from autograder.ros2.interfaces import interface
from autograder.ros2.options import (
    above_zero,
    add_graph_options,
    positive,
    profile,
    qos,
    to_match,
    unsigned,
    values,
    yaml_text,
)
from autograder.ros2.session import Session


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 topic` to the parser."""
    parser = add_graph_options(verbs.add_parser("list", help="Output a list of available topics"))
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the topic type")
    parser.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics")
    parser.add_argument("-v", "--verbose", action="store_true", help="List full details about each topic")
    _hidden(parser)
    parser.set_defaults(run=_list)
    parser = add_graph_options(verbs.add_parser("info", help="Print information about a topic"))
    parser.add_argument("topic_name", help="Name of the ROS topic to get info (e.g. '/chatter')")
    parser.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like the node name")
    parser.set_defaults(run=_info)
    parser = add_graph_options(verbs.add_parser("type", help="Print a topic's type"))
    parser.add_argument("topic_name", help="Name of the ROS topic to get type (e.g. '/chatter')")
    _hidden(parser)
    parser.set_defaults(run=_type)
    parser = add_graph_options(verbs.add_parser("find", help="Output a list of available topics of a given type"))
    parser.add_argument("topic_type", help="Name of the ROS topic type to filter for (e.g. 'std_msgs/msg/String')")
    parser.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics")
    _hidden(parser)
    parser.set_defaults(run=_find)
    _add_echo(verbs)
    _add_measures(verbs)
    _add_pub(verbs)


def _hidden(parser: Any) -> None:
    parser.add_argument("--include-hidden-topics", action="store_true", help="Consider hidden topics as well")


def _list(session: Session, options: Any) -> None:
    topics = session.topics(options.include_hidden_topics)
    if options.count_topics:
        print(len(topics))
    elif options.verbose:
        for heading, one, ends_of in (
            ("Published", "publisher", session.publishers),
            ("Subscribed", "subscriber", session.subscriptions),
        ):
            print(f"{heading} topics:")
            for name, types in topics:
                if count := len(ends_of(name)):
                    print(f" * {name} [{', '.join(types)}] {count} {one}{'s' if count > 1 else ''}")
            print()
    elif topics:
        lines = [f"{name} [{', '.join(types)}]" if options.show_types else name for name, types in topics]
        print(*lines, sep="\n")


def _info(session: Session, options: Any) -> None:
    name = options.topic_name
    types = session.look_for(lambda: dict(session.topics(hidden=True)).get(name))
    if types is None:
        raise Failure(f"Unknown topic '{name}'")
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for heading, ends in (("Publisher", session.publishers(name)), ("Subscription", session.subscriptions(name))):
        print(f"{heading} count: {len(ends)}", end=end)
        if options.verbose:
            for one in ends:
                print(one, end=end)


def _type(session: Session, options: Any) -> None:
    types = session.look_for(lambda: dict(session.topics(options.include_hidden_topics)).get(options.topic_name))
    if types is None:
        raise Failure("")
    print(*types, sep="\n")


def _find(session: Session, options: Any) -> None:
    topics = session.topics(options.include_hidden_topics)
    names = [name for name, types in topics if options.topic_type in types]
    if options.count_topics:
        print(len(names))
    elif names:
        print(*names, sep="\n")


LONGEST = 128
"""The number of elements or characters of one value that are written by default."""


def _add_echo(verbs: Any) -> None:
    """Add the verb `echo` to the parser."""
    parser = add_graph_options(verbs.add_parser("echo", help="Output messages from a topic"))
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
    """Return a topic's full name.

    Raises:
        Failure: the name is not valid.
    """
    try:
        full = expand_topic_name(name, session.node.get_name(), session.node.get_namespace())
        validate_full_topic_name(full)
    except (ValueError, InvalidTopicNameException) as error:
        raise Failure(str(error)) from error
    return str(full)


def type_of(session: Session, name: str) -> Any | None:
    """Return the message class of a topic, or None if the topic is not on the graph.

    Raises:
        Failure: the topic has several types, or its type is not installed here.
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
    """Return the profile of the subscription: that of the options, or one that matches all existing publishers."""
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
    """Return a function that says whether a message passes `--filter`; without an expression, all messages pass.

    Raises:
        Failure: the text is not an expression. The returned function also raises it, if the expression, in which `m` is
            the message, cannot be evaluated for a message.
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
    """Print a message or the value of one of its fields, after the middleware's information about the message."""
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


_EVERY = 1.0
"""The seconds between two reports."""


def _add_measures(verbs: Any) -> None:
    """Add the verbs `hz`, `bw` and `delay` to the parser."""
    parser = add_graph_options(verbs.add_parser("hz", help="Print the average receiving rate to screen"))
    _common(parser, 10_000)
    parser.add_argument("--filter", dest="expression", metavar="EXPR", help="only measure messages that match")
    parser.add_argument("--wall-time", action="store_true", help="calculates rate using wall time")
    parser.set_defaults(run=_hz)
    parser = add_graph_options(verbs.add_parser("bw", help="Display bandwidth used by topic"))
    _common(parser, 100)
    parser.set_defaults(run=_bw)
    parser = add_graph_options(verbs.add_parser("delay", help="Display delay of topic from timestamp in header"))
    _common(parser, 10_000)
    parser.set_defaults(run=_delay)


def _common(parser: Any, window: int) -> None:
    parser.add_argument("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')")
    parser.add_argument(
        "-w", "--window", type=positive, default=window, help=f"window size, in # of messages (default: {window})"
    )


def _listen(session: Session, options: Any, take: Callable[[Any], None], raw: bool) -> None:
    """Wait until the topic exists, and subscribe to it."""
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
    """Return the line that is printed below an average."""
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


_SAY_AGAIN = 1.0
"""The seconds after which the line about what the verb waits for is printed again."""


def _add_pub(verbs: Any) -> None:
    """Add the verb `pub` to the parser."""
    parser = add_graph_options(verbs.add_parser("pub", help="Publish a message to a topic"))
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
    session.stay(options.keep_alive)  # so that the middleware can send what it still has


def _dictionary(text: str) -> dict[str, Any]:
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise Failure(f"The passed value needs to be a dictionary in YAML format: {error}") from None
    if not isinstance(values, dict):
        raise Failure("The passed value needs to be a dictionary in YAML format")
    return values


def _wait(session: Session, publisher: Any, count: int, within: float | None) -> None:
    """Wait until the publisher has so many matching subscriptions."""
    began = time.monotonic()
    while publisher.get_subscription_count() < count:
        if within is not None and time.monotonic() - began >= within:
            raise Failure(f"Timed out waiting for subscribers: Expected {count} subscribers but only got "
                          f"{publisher.get_subscription_count()} subscribers")  # fmt: skip
        print(f"Waiting for at least {count} matching subscription(s)...", flush=True)
        session.spin_until(lambda: publisher.get_subscription_count() >= count, _SAY_AGAIN)
