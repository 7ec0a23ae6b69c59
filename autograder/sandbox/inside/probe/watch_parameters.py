"""Parameters: declared, read and set how often, and the callbacks that are asked about them."""

import functools
import time
from typing import Any

from . import events, rclpy_names
from .callbacks import noted
from .thing import node_name
from .thread_state import here
from .wrapping import wrap
from .writing import ledger, quiet


class Parameter:
    """A parameter of a node: declared, read and set how often, and when last."""

    dirty = False

    def __init__(self, node: str, name: str) -> None:
        """Begin with one that nothing has happened to."""
        self.key = f"parameter{next(ledger.numbers)}"
        self.node, self.name = node, name
        self.declared = False
        self.gets = self.sets = 0
        self.last_get = self.last_set = 0.0

    def event(self) -> events.ParameterSeen:
        """Return its line as it is now."""
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
    """Wrap how parameters are declared, read and set."""

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
