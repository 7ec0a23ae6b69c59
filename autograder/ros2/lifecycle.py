"""The verbs of `ros2 lifecycle`."""

from __future__ import annotations

import sys
from typing import Any

from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState

from autograder.ros2.failure import Failure
from autograder.ros2.node import absolute
from autograder.ros2.options import add_graph_options
from autograder.ros2.session import Session, ask


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 lifecycle` to the parser."""
    parser = add_graph_options(verbs.add_parser("nodes", help="Output a list of nodes with lifecycle"))
    parser.add_argument("-a", "--all", action="store_true", help="Display all nodes even hidden ones")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="Only display the number of nodes")
    parser.set_defaults(run=_nodes)
    parser = _with_hidden(verbs.add_parser("get", help="Get lifecycle state for one or more nodes"))
    parser.add_argument("node_name", nargs="?", help="Name of the ROS node")
    parser.set_defaults(run=_get)
    parser = _with_hidden(verbs.add_parser("list", help="Output a list of available transitions"))
    parser.add_argument("node_name", help="Name of the ROS node")
    parser.add_argument("-a", "--all", action="store_true", help="Output all existing transitions")
    parser.set_defaults(run=_list)
    parser = _with_hidden(verbs.add_parser("set", help="Trigger lifecycle state transition"))
    parser.add_argument("node_name", help="Name of the ROS node")
    parser.add_argument("transition", help="The lifecycle transition")
    parser.set_defaults(run=_set)


def _with_hidden(parser: Any) -> Any:
    parser.add_argument("--include-hidden-nodes", action="store_true", help="Consider hidden nodes as well")
    return add_graph_options(parser)


def _lifecycle_nodes(session: Session, hidden: bool) -> list[str]:
    """Return the nodes with a service that returns their state."""
    services = dict(session.services(hidden=True))
    return [
        name
        for name in dict.fromkeys(session.node_names(hidden))
        if "lifecycle_msgs/srv/GetState" in services.get(f"{name}/get_state", ())
    ]


def _found(session: Session, options: Any) -> str:
    name = absolute(options.node_name)
    hidden = options.include_hidden_nodes
    if not session.look_for(lambda: name in _lifecycle_nodes(session, hidden) or None):
        raise Failure("Node not found")
    return name


def _nodes(session: Session, options: Any) -> None:
    names = _lifecycle_nodes(session, options.all)
    if options.count_nodes:
        print(len(names))
    elif names:
        print(*names, sep="\n")


def _get(session: Session, options: Any) -> None:
    every = options.node_name is None
    names = _lifecycle_nodes(session, options.include_hidden_nodes) if every else [_found(session, options)]
    for name in names:
        state = ask(session, name, "get_state", GetState, GetState.Request()).current_state
        print(f"{name + ': ' if every else ''}{state.label} [{state.id}]")


def _transitions(session: Session, name: str, service: str = "get_available_transitions") -> list[Any]:
    request = GetAvailableTransitions.Request()
    return list(ask(session, name, service, GetAvailableTransitions, request).available_transitions)


def _list(session: Session, options: Any) -> None:
    service = "get_transition_graph" if options.all else "get_available_transitions"
    for one in _transitions(session, _found(session, options), service):
        print(f"- {one.transition.label} [{one.transition.id}]")
        print(f"\tStart: {one.start_state.label}\n\tGoal: {one.goal_state.label}")


def _set(session: Session, options: Any) -> None:
    name = _found(session, options)
    available = [one.transition for one in _transitions(session, name)]
    chosen = [one for one in available if one.label == options.transition]
    chosen = chosen or [one for one in available if str(one.id) == options.transition]
    if not chosen:
        lines = [f"- {one.label} [{one.id}]" for one in available]
        raise Failure("\n".join(["Unknown transition requested, available ones are:", *lines]))
    if ask(session, name, "change_state", ChangeState, ChangeState.Request(transition=chosen[0])).success:
        print("Transitioning successful")
    else:
        print("Transitioning failed", file=sys.stderr)
