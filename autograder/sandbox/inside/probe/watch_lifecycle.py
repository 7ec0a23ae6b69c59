"""Lifecycle nodes: their transitions' callbacks, and messages dropped by publishers that are not activated."""

import functools
import weakref
from typing import Any

from . import events, rclpy_names
from .callbacks import noted
from .own_lines import own_line
from .thing import node_name
from .wrapping import wrap
from .writing import emit_once, quiet


def watch_lifecycle(rclpy: Any) -> None:
    """Wrap the registering of transitions' callbacks, and lifecycle publishers."""
    mixin = rclpy.lifecycle.LifecycleNodeMixin
    register = getattr(mixin, rclpy_names.REGISTER_TRANSITION)

    @functools.wraps(register)
    def register_noted(self: Any, state_id: int, callback: Any) -> Any:
        with quiet():
            callback = noted("lifecycle", callback, node_name(self), rclpy.lifecycle.TransitionCallbackReturn)
        return register(self, state_id, callback)

    setattr(mixin, rclpy_names.REGISTER_TRANSITION, register_noted)
    owners: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()

    def made(publisher: Any, node: Any, *_args: Any, **_kwargs: Any) -> None:
        owners[publisher] = node

    def note_off(publisher: Any, *_args: Any, **_kwargs: Any) -> None:
        if not publisher.is_activated:
            node = owners.get(publisher)
            event = events.LifecyclePublishOff(
                name=publisher.topic_name,
                state=rclpy_names.lifecycle_state(node) if node is not None else "",
                **vars(own_line()),
            )
            emit_once(event)

    wrap(mixin, "create_lifecycle_publisher", after=made)
    wrap(rclpy.lifecycle.LifecyclePublisher, "publish", before=note_off)
