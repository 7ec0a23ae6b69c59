"""Asking nodes: all at once, and by a service that each of them has."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest
import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
from autograder.graph.services import ask_nodes
from autograder.sandbox.environment import profile_environment

LONG = 120.0
"""Seconds in which an answer comes on every machine."""


@pytest.fixture
def observer() -> Iterator[Observer]:
    os.environ.update(profile_environment())
    domain = claim_domain()
    watching = Observer(domain.id, left=domain.release)
    yield watching
    watching.close()


@contextmanager
def spinning(observer: Observer, name: str, prepare: Callable[[Node], Any] = lambda node: None, **has: bool) -> Any:
    """A node in a context and a thread of its own, with only the services that it is said to have."""
    context = Context()
    rclpy.init(context=context, domain_id=observer.domain_id, args=[])
    node = rclpy.create_node(
        name,
        context=context,
        start_parameter_services=has.get("parameters", False),
        parameter_overrides=[Parameter("start_type_description_service", value=has.get("types", False))],
    )
    prepare(node)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield node
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def test_nodes_are_asked_all_at_once(observer: Observer) -> None:
    """Each node answers only when the other one has been asked, too."""
    both = threading.Barrier(2)

    def meets(node: Node) -> None:
        def answer(_request: Any, response: Any) -> Any:
            both.wait()
            return response

        node.create_service(ListParameters, "~/list_parameters", answer)

    with spinning(observer, "left", meets), spinning(observer, "right", meets):
        try:
            assert ask_nodes(observer, ["/left", "/right"], LONG)
        finally:
            both.abort()


@pytest.mark.parametrize("service", ["parameters", "types"])
def test_a_node_is_asked_by_the_service_that_it_has_and_prints_nothing(
    observer: Observer, service: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with spinning(observer, "quiet", **{service: True}):
        assert ask_nodes(observer, ["/quiet"], LONG)
    assert capfd.readouterr() == ("", "")


def test_a_node_without_services_does_not_keep_the_others_from_answering(observer: Observer) -> None:
    answered = threading.Event()

    def tells(node: Node) -> None:
        def answer(_request: Any, response: Any) -> Any:
            answered.set()
            return response

        node.create_service(ListParameters, "~/list_parameters", answer)

    with spinning(observer, "mute"), spinning(observer, "other", tells):
        assert not ask_nodes(observer, ["/mute", "/other"], LONG, answered.is_set)
    assert answered.is_set()


def test_nobody_to_ask_has_answered(observer: Observer) -> None:
    assert ask_nodes(observer, [], 0.0)
