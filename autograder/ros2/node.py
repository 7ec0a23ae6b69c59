"""The verbs of `ros2 node`."""

from __future__ import annotations

import sys
from typing import Any

from rclpy.action import get_action_client_names_and_types_by_node, get_action_server_names_and_types_by_node
from rclpy.node import Node

from autograder.graph.names import full_name
from autograder.ros2.failure import Failure
from autograder.ros2.options import add_graph_options
from autograder.ros2.session import Session, is_hidden


def absolute(name: str) -> str:
    """Return a node's name as on the graph, with the leading slash, which the user may leave out."""
    return name if name.startswith("/") else f"/{name}"


def find_node(
    session: Session, name: str, hidden: bool, otherwise: str, within: float | None = None
) -> tuple[str, str]:
    """Return the namespace and name of the node with this full name.

    Args:
        session: the session of the verb.
        name: the full name of the node.
        hidden: whether hidden nodes are considered.
        otherwise: the message of the failure.
        within: the seconds to wait for the node to appear.

    Raises:
        Failure: there is no such node.
    """
    found = session.look_for(
        lambda: next((one for one in session.nodes(hidden) if full_name(*one) == name), None), within
    )
    if found is None:
        raise Failure(otherwise)
    return found


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 node` to the parser."""
    parser = add_graph_options(verbs.add_parser("list", help="Output a list of available nodes"))
    parser.add_argument("-a", "--all", action="store_true", help="Display all nodes even hidden ones")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="Only display the number of nodes discovered")
    parser.set_defaults(run=_list)
    parser = add_graph_options(verbs.add_parser("info", help="Output information about a node"))
    parser.add_argument("node_name", help="Node name to request information")
    parser.add_argument("--include-hidden", action="store_true", help="Display hidden topics, services, and actions")
    parser.set_defaults(run=_info)


def _list(session: Session, options: Any) -> None:
    names = session.node_names(options.all)
    if options.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, "
            "which can have unintended side effects.",
            file=sys.stderr,
        )
    if names:
        print(*names, sep="\n")


def _info(session: Session, options: Any) -> None:
    wanted, hidden = options.node_name, options.include_hidden
    space, name = find_node(session, wanted, hidden, f"Unable to find node '{wanted}'")
    count = session.node_names(hidden).count(wanted)
    if count > 1:
        print(
            f'There are {count} nodes in the graph with the exact name "{wanted}". '
            "You are seeing information about only one of them.",
            file=sys.stderr,
        )
    print(wanted)
    graph = session.graph
    for heading, ask in (
        ("Subscribers", Node.get_subscriber_names_and_types_by_node),
        ("Publishers", Node.get_publisher_names_and_types_by_node),
        ("Service Servers", Node.get_service_names_and_types_by_node),
        ("Service Clients", Node.get_client_names_and_types_by_node),
        ("Action Servers", get_action_server_names_and_types_by_node),
        ("Action Clients", get_action_client_names_and_types_by_node),
    ):
        found = sorted(ask(graph, name, space))
        print(f"  {heading}:")
        shown = [(one, types) for one, types in found if options.include_hidden or not is_hidden(one)]
        print(*[f"    {one}: {', '.join(types)}" for one, types in shown], sep="\n")
