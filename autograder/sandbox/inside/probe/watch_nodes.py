"""Watches nodes, the things that are created for them, their parameters, and their lifecycle."""

import functools
import time
import weakref
from collections.abc import Callable
from typing import Any

from . import events, rclpy_names
from .callbacks import noted
from .records import Thing, group_of, here, node_name, thing_of
from .student_lines import callback_line, own_line
from .wrapping import wrap
from .writing import emit_once, ledger, quiet


class Node:
    """The record of a node, which is created at the end of `Node.__init__`."""

    dirty = False

    def __init__(self, node: Any) -> None:
        """Begin with a node that was just created."""
        self.key = f"node{next(ledger.numbers)}"
        self.node = weakref.ref(node)
        self.name = node_name(node)
        self.made = time.monotonic()
        self.spun = 0.0
        self.destroyed = False

    def event(self) -> events.NodeSeen:
        """Return the record's line in its current state."""
        executor = getattr(self.node(), "executor", None)
        return events.NodeSeen(
            name=self.name,
            made=self.made,
            spun=self.spun,
            destroyed=self.destroyed,
            foreign=executor is not None and executor not in ledger.known,
        )


def watch_nodes(rclpy: Any) -> None:
    """Wrap the functions that create and destroy nodes, and the setting of a node's executor."""
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
    """Wrap the functions that create and destroy a node's timers, subscriptions, publishers, services and clients."""
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

    def cancelled(_result: Any, timer: Any) -> None:
        becomes(cancelled=True, cancelled_in=own_line().line, cancelled_at=time.monotonic())(_result, timer)

    wrap(rclpy.timer.Timer, "cancel", after=cancelled)
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


class Parameter:
    """A parameter of a node: whether it is declared, and how often and when it was last read and set."""

    dirty = False

    def __init__(self, node: str, name: str) -> None:
        """Begin with a parameter that was neither declared nor used."""
        self.key = f"parameter{next(ledger.numbers)}"
        self.node, self.name = node, name
        self.declared = False
        self.gets = self.sets = 0
        self.last_get = self.last_set = 0.0

    def event(self) -> events.ParameterSeen:
        """Return the record's line in its current state."""
        return events.ParameterSeen(
            node=self.node,
            name=self.name,
            declared=self.declared,
            gets=self.gets,
            sets=self.sets,
            last_get=self.last_get,
            last_set=self.last_set,
        )


_known: dict[tuple[int, str], Parameter] = {}


def _parameter(node: Any, name: str) -> Parameter:
    key = (id(node), name)
    if key not in _known:
        _known[key] = Parameter(node_name(node), name)
        ledger.add(_known[key])
    return _known[key]


def watch_parameters(rclpy: Any) -> None:
    """Wrap the functions that declare, read and set parameters."""

    def declared(_result: Any, node: Any, name: Any, *_args: Any, **_kwargs: Any) -> None:
        if not here.building and isinstance(name, str):
            _parameter(node, name).declared = True
            ledger.touch(_parameter(node, name))

    def got(_result: Any, node: Any, name: Any, *_args: Any) -> None:
        if not here.building and isinstance(name, str):
            found = _parameter(node, name)
            found.gets, found.last_get = found.gets + 1, time.monotonic()
            ledger.touch(found)

    def was_set(result: Any, node: Any, parameters: Any, *_args: Any) -> None:
        if not here.building and getattr(result, "successful", False):
            for one in parameters:
                found = _parameter(node, one.name)
                found.sets, found.last_set = found.sets + 1, time.monotonic()
                ledger.touch(found)

    node_class = rclpy.node.Node
    wrap(node_class, "declare_parameter", after=declared)
    wrap(node_class, "get_parameter", after=got)
    wrap(node_class, rclpy_names.SET_PARAMETERS, after=was_set)
    _wrap_callbacks(node_class, "on_set")
    _wrap_callbacks(node_class, "post_set")


def _wrap_callbacks(node_class: Any, moment: str) -> None:
    add_name, remove_name = (f"{what}_{moment}_parameters_callback" for what in ("add", "remove"))
    add, remove = getattr(node_class, add_name), getattr(node_class, remove_name)
    wrapped: dict[Any, Any] = {}

    @functools.wraps(add)
    def add_noted(self: Any, callback: Any) -> None:
        with quiet():
            from rcl_interfaces.msg import SetParametersResult

            if not here.building and callable(callback):
                expected = SetParametersResult if moment == "on_set" else None
                with_notes = noted("parameter", callback, node_name(self), expected)
                wrapped[(id(self), callback)] = with_notes
                callback = with_notes
        add(self, callback)

    @functools.wraps(remove)
    def remove_noted(self: Any, callback: Any) -> None:
        with quiet():
            callback = wrapped.pop((id(self), callback), callback)
        remove(self, callback)

    setattr(node_class, add_name, add_noted)
    setattr(node_class, remove_name, remove_noted)


class _ForgottenReturns:
    """What becomes of a lifecycle callback that returns no TransitionCallbackReturn."""

    succeed = False


forgotten_returns = _ForgottenReturns()


def _succeeds(callback: Callable[..., Any], returns: Any) -> Callable[..., Any]:
    """Return a callback that succeeds where this one returns something else than a transition callback has to."""

    @functools.wraps(callback)
    def call(*args: Any, **kwargs: Any) -> Any:
        result = callback(*args, **kwargs)
        return result if isinstance(result, returns) else returns.SUCCESS

    return call


def watch_lifecycle(rclpy: Any) -> None:
    """Wrap the registration of transition callbacks, and the functions of lifecycle publishers."""
    mixin = rclpy.lifecycle.LifecycleNodeMixin
    register = getattr(mixin, rclpy_names.REGISTER_TRANSITION)

    @functools.wraps(register)
    def register_noted(self: Any, state_id: int, callback: Any) -> Any:
        with quiet():
            returns = rclpy.lifecycle.TransitionCallbackReturn
            must_return = None if forgotten_returns.succeed else returns
            callback = noted("lifecycle", callback, node_name(self), must_return)
            if forgotten_returns.succeed:
                callback = _succeeds(callback, returns)
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
