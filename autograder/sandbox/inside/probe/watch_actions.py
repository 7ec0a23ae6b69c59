"""Watches action servers: their callbacks, the feedback that they publish, and goals that never end."""

import functools
import weakref
from typing import Any

from . import events, rclpy_names
from .callbacks import ActionCallback, action_callbacks
from .records import Thing, group_of, node_name, thing_of
from .student_lines import callback_line, own_line
from .watch_messages import note_misfit
from .wrapping import wrap
from .writing import ledger, quiet

KINDS = ("execute", "goal", "cancel", "accepted")
"""The callbacks of an action server, in the order of `rclpy_names.action_callbacks`."""

_LOOKED_AT = 30
"""The number of feedback messages of an action server that are checked. More than one is checked because often only the
last one has an integer."""


def watch_actions(rclpy: Any) -> None:
    """Wrap the creation of action servers, and the functions that execute goals and publish feedback."""
    server_class, goal_class = rclpy.action.ActionServer, rclpy.action.server.ServerGoalHandle

    def made(_: None, server: Any, node: Any, action_type: Any, *args: Any, **kwargs: Any) -> None:
        given = kwargs.get("action_name", args[0] if args else "")
        about = events.ThingMade(
            kind="action_server",
            name=_full_name(node, given),
            given=given if isinstance(given, str) else "",
            node=node_name(node),
            made=own_line().line,
        )
        ledger.add(Thing(about), server)
        returned = (action_type.Result, rclpy.action.GoalResponse, rclpy.action.CancelResponse, None)
        callbacks = rclpy_names.action_callbacks(server)
        for kind, callback, expected in zip(KINDS, callbacks, returned, strict=True):
            if not getattr(callback, "__module__", "").startswith("rclpy."):
                _add(kind, callback, expected, server, node)

    def scheduled(server: Any, _goal: Any, callback: Any = None) -> None:
        # A goal may be executed by another callback than the one with which the server was created.
        if callback is not None and callback not in action_callbacks:
            node, action_type = rclpy_names.server_parts(server)
            _add("execute", callback, action_type.Result, server, node)

    wrap(server_class, "__init__", after=made)
    wrap(server_class, "notify_execute", before=scheduled)
    publish = goal_class.publish_feedback

    @functools.wraps(publish)
    def publish_noted(self: Any, feedback: Any) -> None:
        server = rclpy_names.server_of(self)
        thing = thing_of(server)
        try:
            publish(self, feedback)
        except Exception:
            with quiet():
                name = thing.about.name if thing is not None else ""
                note_misfit("feedback", name, feedback, server.action_type.Feedback)
            raise
        if thing is not None:
            thing.count()
            if thing.runs <= _LOOKED_AT:  # a number of the wrong type is sent as a different number, without an error
                with quiet():
                    note_misfit("feedback", thing.about.name, feedback, server.action_type.Feedback)

    goal_class.publish_feedback = publish_noted


def _full_name(node: Any, given: Any) -> str:
    """Return an action's name on the graph, which is the name of its services without their ending."""
    with quiet():
        return str(node.resolve_service_name(f"{given}/_action/send_goal")).removesuffix("/_action/send_goal")
    return ""


def _add(kind: str, callback: Any, expected: type | None, server: Any, node: Any) -> None:
    server_thing = thing_of(server)
    about = events.ThingMade(
        **vars(callback_line(callback)),
        kind=kind,
        name=server_thing.about.name if server_thing is not None else "",
        node=node_name(node),
        # rclpy runs `execute` as a task, outside of any group.
        **(group_of(server.callback_group, node) if kind != "execute" else {}),
    )
    thing = Thing(about)
    ledger.add(thing)
    action_callbacks[callback] = ActionCallback(thing, expected, weakref.ref(node))
