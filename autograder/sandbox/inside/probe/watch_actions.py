"""Action servers, and what their callbacks must return."""

from typing import Any

from . import forms, rclpy_names
from .callbacks import must_return
from .thing import Thing, node_name
from .wrapping import wrap
from .writing import ledger


def watch_actions(rclpy: Any) -> None:
    """Wrap how action servers are made."""

    def made(_: None, server: Any, node: Any, action_type: Any, *args: Any, **_kwargs: Any) -> None:
        name = str(args[0]) if args else ""
        about: forms.ThingMade = {"kind": "action_server", "name": name, "given": name, "node": node_name(node)}
        ledger.add(Thing(about), server)
        results = (action_type.Result, rclpy.action.GoalResponse, rclpy.action.CancelResponse)
        for callback, result in zip(rclpy_names.action_callbacks(server), results, strict=True):
            must_return[callback] = result

    wrap(rclpy.action.ActionServer, "__init__", after=made)
