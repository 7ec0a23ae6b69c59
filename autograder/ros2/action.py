"""The verbs of `ros2 action`."""

from __future__ import annotations

from typing import Any

import yaml
from action_msgs.msg import GoalStatus
from rclpy.action import (
    ActionClient,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)

from autograder.graph.names import full_name
from autograder.ros2 import messages
from autograder.ros2.failure import Failure
from autograder.ros2.interfaces import interface
from autograder.ros2.options import add_graph_options, values, yaml_text
from autograder.ros2.session import Session
from autograder.ros2.topic import full_topic

_STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}
_CANCELED_WITHIN = 5.0
"""The seconds that a server may take to respond to a request to cancel."""


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 action` to the parser."""
    parser = add_graph_options(verbs.add_parser("list", help="Output a list of action names"))
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action type")
    parser.add_argument("-c", "--count-actions", action="store_true", help="Only display the number of actions")
    parser.set_defaults(run=_list)
    parser = add_graph_options(verbs.add_parser("info", help="Print information about an action"))
    parser.add_argument("action_name", help="Name of the ROS action to get info (e.g. '/fibonacci')")
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action type")
    parser.add_argument("-c", "--count", action="store_true", help="Only display the number of clients and servers")
    parser.set_defaults(run=_info)
    parser = add_graph_options(verbs.add_parser("type", help="Print an action's type"))
    parser.add_argument("action_name", help="Name of the ROS action to get type (e.g. '/fibonacci')")
    parser.set_defaults(run=_type)
    parser = add_graph_options(verbs.add_parser("send_goal", help="Send an action goal"))
    parser.add_argument("action_name", help="Name of the ROS action (e.g. '/fibonacci')")
    parser.add_argument("action_type", help="Type of the ROS action (e.g. 'test_msgs/action/Fibonacci')")
    values(parser, "goal", "Goal in YAML format (e.g. '{order: 10}')")
    parser.add_argument("-f", "--feedback", action="store_true", help="Echo feedback messages for the goal")
    parser.set_defaults(run=_send_goal)


def _list(session: Session, options: Any) -> None:
    actions = sorted(get_action_names_and_types(session.graph))
    if options.count_actions:
        print(len(actions))
    elif actions:
        lines = [f"{name} [{', '.join(types)}]" if options.show_types else name for name, types in actions]
        print(*lines, sep="\n")


def _info(session: Session, options: Any) -> None:
    wanted = full_topic(session, options.action_name)
    print(f"Action: {options.action_name}")
    for heading, ask in (
        ("clients", get_action_client_names_and_types_by_node),
        ("servers", get_action_server_names_and_types_by_node),
    ):
        found = [
            (full_name(space, name), types)
            for space, name in session.nodes(hidden=True)
            for action, types in ask(session.graph, name, space)
            if action == wanted
        ]
        print(f"Action {heading}: {len(found)}")
        for node, types in () if options.count else found:
            print(f"    {node} [{', '.join(types)}]" if options.show_types else f"    {node}")


def _type(session: Session, options: Any) -> None:
    types = session.look_for(lambda: dict(get_action_names_and_types(session.graph)).get(options.action_name))
    if types is None:
        raise Failure("")
    print(*types, sep="\n")


def _send_goal(session: Session, options: Any) -> None:
    try:
        action_type = interface(options.action_type, "action")
    except LookupError:
        raise Failure("The passed action type is invalid") from None
    goal = action_type.Goal()
    try:
        messages.fill(goal, yaml.safe_load(yaml_text(options, "goal")))
    except Exception as error:
        raise Failure(f"Failed to populate message fields: {error!r}") from None
    client = ActionClient(session.node, action_type, options.action_name)
    print("Waiting for an action server to become available...", flush=True)
    session.spin_until(client.server_is_ready)
    print(f"Sending goal:\n     {messages.to_yaml(goal)}", flush=True)
    handle = session.answer(client.send_goal_async(goal, _feedback if options.feedback else None))
    if not handle.accepted:
        print("Goal was rejected.")
        return
    try:  # this includes the printing, because Ctrl-C may come as soon as the user sees that the goal is accepted
        print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n", flush=True)
        ended = session.answer(handle.get_result_async())
    except BaseException:
        _cancel(session, handle)
        raise
    print(f"Result:\n    {messages.to_yaml(ended.result)}")
    print(f"Goal finished with status: {_STATUS.get(ended.status, 'UNKNOWN')}")


def _feedback(message: Any) -> None:
    print(f"Feedback:\n    {messages.to_yaml(message.feedback)}", flush=True)


def _cancel(session: Session, handle: Any) -> None:
    """Cancel the goal, because the verb is ended.

    The real tool tries to do so as well, but fails, because it has already left the graph by then.
    """
    print("Canceling goal...", flush=True)
    session.give_more_time(_CANCELED_WITHIN)
    answer = session.answer(handle.cancel_goal_async(), _CANCELED_WITHIN)
    print("Goal canceled." if answer is not None and answer.goals_canceling else "Failed to cancel goal")
