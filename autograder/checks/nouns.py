"""Every noun of the check API with its name, for what goes through all of them: `lint`, the book and the tests."""

from __future__ import annotations

import inspect

from autograder.checks.expect.action import Action
from autograder.checks.expect.activity import Activity
from autograder.checks.expect.car import Car
from autograder.checks.expect.draw import Draw
from autograder.checks.expect.goal import SentGoal
from autograder.checks.expect.graph import Graph
from autograder.checks.expect.lifecycle import Lifecycle
from autograder.checks.expect.node import Node
from autograder.checks.expect.program import StartedProgram
from autograder.checks.expect.publisher import Publisher
from autograder.checks.expect.qos import Qos
from autograder.checks.expect.service import Server, Service
from autograder.checks.expect.topic import Topic
from autograder.checks.launch import Launch

NOUNS: dict[str, type] = {
    "ros": Launch,
    "topic": Topic,
    "publisher": Publisher,
    "qos": Qos,
    "node": Node,
    "lifecycle": Lifecycle,
    "service": Service,
    "server": Server,
    "action": Action,
    "goal": SentGoal,
    "activity": Activity,
    "program": StartedProgram,
    "car": Car,
    "graph": Graph,
    "draw": Draw,
}
"""Each noun's class by the name that the book gives it."""

_BY_CLASS = {noun.__name__: noun for noun in NOUNS.values()}


def noun_given(owner: type, name: str) -> type | None:
    """The noun that a method or property of another one gives; None where it gives something else.

    Args:
        owner: a noun.
        name: of its method or property.
    """
    thing = inspect.getattr_static(owner, name, None)
    method = inspect.unwrap(thing.fget if isinstance(thing, property) and thing.fget else thing) if thing else None
    return _BY_CLASS.get(str(getattr(method, "__annotations__", {}).get("return", "")))
