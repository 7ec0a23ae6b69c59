"""`ros2 topic`: what there is. Listening and publishing stand in modules of their own."""

from __future__ import annotations

from typing import Any

from autograder.ros2 import topic_listen, topic_measure, topic_pub
from autograder.ros2.failure import Failure
from autograder.ros2.options import joins
from autograder.ros2.session import Session


def add_verbs(verbs: Any) -> None:
    """Add them to the parser."""
    parser = joins(verbs.add_parser("list", help="Output a list of available topics"))
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the topic type")
    parser.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics")
    parser.add_argument("-v", "--verbose", action="store_true", help="List full details about each topic")
    _hidden(parser)
    parser.set_defaults(run=_list)
    parser = joins(verbs.add_parser("info", help="Print information about a topic"))
    parser.add_argument("topic_name", help="Name of the ROS topic to get info (e.g. '/chatter')")
    parser.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like the node name")
    parser.set_defaults(run=_info)
    parser = joins(verbs.add_parser("type", help="Print a topic's type"))
    parser.add_argument("topic_name", help="Name of the ROS topic to get type (e.g. '/chatter')")
    _hidden(parser)
    parser.set_defaults(run=_type)
    parser = joins(verbs.add_parser("find", help="Output a list of available topics of a given type"))
    parser.add_argument("topic_type", help="Name of the ROS topic type to filter for (e.g. 'std_msgs/msg/String')")
    parser.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics")
    _hidden(parser)
    parser.set_defaults(run=_find)
    for module in (topic_listen, topic_measure, topic_pub):
        module.add_verbs(verbs)


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
