"""Nodes: when they are made, spun and destroyed, and what is made for them."""

import functools
import time
import weakref
from collections.abc import Callable
from typing import Any

from . import events, rclpy_names
from .own_lines import callback_line, own_line
from .thing import Thing, group_of, node_name, thing_of
from .thread_state import here
from .wrapping import wrap
from .writing import ledger, quiet


class Node:
    """A node, from the end of `Node.__init__` on."""

    dirty = False

    def __init__(self, node: Any) -> None:
        """Begin with one that was just made."""
        self.key = f"node{next(ledger.numbers)}"
        self.node = weakref.ref(node)
        self.name = node_name(node)
        self.made = time.monotonic()
        self.spun = 0.0
        self.destroyed = False

    def event(self) -> events.NodeSeen:
        """Return its line as it is now."""
        executor = getattr(self.node(), "executor", None)
        return events.NodeSeen(
            name=self.name,
            made=self.made,
            spun=self.spun,
            destroyed=self.destroyed,
            foreign=executor is not None and executor not in ledger.known,
        )


def watch_nodes(rclpy: Any) -> None:
    """Wrap how nodes are made and destroyed, and how they come to an executor."""
    node_class = rclpy.node.Node
    init = node_class.__init__

    @functools.wraps(init)
    def build(self: Any, *args: Any, **kwargs: Any) -> None:
        before, here.building = here.building, True
        try:
            init(self, *args, **kwargs)
        finally:
            here.building = before
        with quiet():
            ledger.add(Node(self), self)

    node_class.__init__ = build

    def destroyed(_result: Any, node: Any, *_args: Any) -> None:
        known = ledger.known.get(node)
        if known is not None:
            known.destroyed = True
            ledger.touch(known)

    wrap(node_class, "destroy_node", after=destroyed)
    executor = node_class.executor

    def set_executor(self: Any, value: Any) -> None:
        executor.fset(self, value)
        with quiet():
            ledger.touch(ledger.known[self])

    node_class.executor = executor.setter(set_executor)


def watch_things(rclpy: Any) -> None:
    """Wrap how a node's timers, subscriptions, publishers, services and clients are made and destroyed."""
    node_class = rclpy.node.Node
    for method, kind, name_of in (
        ("create_timer", "timer", lambda entity, node: ""),
        ("create_subscription", "subscription", lambda entity, node: entity.topic_name),
        ("create_publisher", "publisher", lambda entity, node: entity.topic_name),
        ("create_service", "service", lambda entity, node: node.resolve_service_name(entity.srv_name)),
        ("create_client", "client", lambda entity, node: node.resolve_service_name(entity.srv_name)),
    ):
        wrap(node_class, method, after=_thing_made(kind, name_of))

    def becomes(**changes: Any) -> Callable[..., None]:
        def note(_result: Any, *args: Any) -> None:
            for entity in args:
                thing = thing_of(entity)
                if thing is not None:
                    thing.note(**changes)

        return note

    for kind in ("timer", "subscription", "publisher", "service", "client"):
        wrap(node_class, f"destroy_{kind}", after=becomes(destroyed=True))
    wrap(rclpy.timer.Timer, "cancel", after=becomes(cancelled=True))
    wrap(rclpy.timer.Timer, "reset", after=becomes(cancelled=False))


def _thing_made(kind: str, name_of: Callable[[Any, Any], str]) -> Callable[..., None]:
    given_as = "srv_name" if kind in ("service", "client") else "topic"

    def note(entity: Any, node: Any, *args: Any, **kwargs: Any) -> None:
        group = getattr(entity, "callback_group", None)
        if here.building or rclpy_names.is_of_a_rate(group, node):
            return
        name, given = "", kwargs.get(given_as, args[1] if len(args) > 1 else "")
        with quiet():
            name = name_of(entity, node)
        about = events.ThingMade(
            **vars(callback_line(getattr(entity, "callback", None))),
            kind=kind,
            name=name,
            given=given if isinstance(given, str) and kind != "timer" else "",
            node=node_name(node),
            made=own_line().line,
            period=entity.timer_period_ns / 1e9 if kind == "timer" else 0.0,
            **(group_of(group, node) if kind != "publisher" else {}),
        )
        ledger.add(Thing(about), entity)

    return note
