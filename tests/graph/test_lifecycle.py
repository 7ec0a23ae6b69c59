"""The lifecycle client on real lifecycle nodes: healthy, refusing, failing, and dead ones."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from lifecycle_msgs.msg import TransitionEvent
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from autograder.graph.domains import claim_domain
from autograder.graph.lifecycle import LifecycleClient, in_order
from autograder.graph.observer import Observer
from autograder.graph.parameters import NoAnswer
from autograder.graph.services import ServiceMissing
from autograder.sandbox.environment import profile_environment

UP = [
    ("unconfigured", "configuring"),
    ("configuring", "inactive"),
    ("inactive", "activating"),
    ("activating", "active"),
]


class Part(LifecycleNode):  # type: ignore[misc]
    """A node whose on_configure does what it is given."""

    def __init__(self, name: str, context: Context, configure: Callable[[], Any]) -> None:
        super().__init__(name, context=context)
        self._configure = configure

    def on_configure(self, state: Any) -> Any:
        return self._configure()


@pytest.fixture
def observer() -> Iterator[Observer]:
    os.environ.update(profile_environment())
    Path(os.environ["ROS_LOG_DIR"]).mkdir(parents=True, exist_ok=True)
    domain = claim_domain()
    watching = Observer(domain.id, left=domain.release)
    yield watching
    watching.close()


@contextmanager
def spinning(
    observer: Observer, *names: str, configure: Callable[[], Any] = lambda: TransitionCallbackReturn.SUCCESS
) -> Iterator[None]:
    """Spin lifecycle nodes as a student's process would; an error in a callback ends the spinning, as there."""
    context = Context()
    rclpy.init(context=context, domain_id=observer.domain_id, args=[])
    executor = SingleThreadedExecutor(context=context)
    nodes = [Part(name, context, configure) for name in names]
    for node in nodes:
        executor.add_node(node)

    def spin() -> None:
        # An error here is the student's: the node goes silent.
        try:
            executor.spin()
        except Exception:
            return

    thread = threading.Thread(target=spin)
    thread.start()
    yield
    executor.shutdown()
    thread.join()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=context)


def test_transitions_are_driven_by_label_and_every_step_is_heard(observer: Observer) -> None:
    client = LifecycleClient(observer, "/part")
    with spinning(observer, "part"):
        assert client.state() == "unconfigured"
        done = client.transition("configure")
        assert (done.before, done.after, done.success, done.offered) == ("unconfigured", "inactive", True, True)
        assert client.transition("activate").success
        assert [change.step for change in client.wait_for_changes(4)] == UP
        assert client.wait_for_state("active") == "active"
        assert client.available() == {"deactivate": "deactivating", "shutdown": "shuttingdown"}


def test_a_transition_that_is_not_offered_is_not_sent_and_the_node_lives_on(observer: Observer) -> None:
    client = LifecycleClient(observer, "/part")
    with spinning(observer, "part"):
        refused = client.transition("cleanup")
        assert (refused.offered, refused.success, refused.after) == (False, False, "unconfigured")
        assert client.transition("shutdown").after == "finalized"
        assert client.transition("shutdown").available == ()


@pytest.mark.parametrize(
    ("result", "path"),
    [
        (TransitionCallbackReturn.FAILURE, ["configuring", "unconfigured"]),
        (TransitionCallbackReturn.ERROR, ["configuring", "errorprocessing", "unconfigured"]),
    ],
)
def test_failure_and_error_are_told_apart_by_their_steps(observer: Observer, result: Any, path: list[str]) -> None:
    client = LifecycleClient(observer, "/part")
    with spinning(observer, "part", configure=lambda: result):
        done = client.transition("configure")
        assert (done.success, done.after) == (False, "unconfigured")
        assert [change.goal for change in client.wait_for_changes(len(path))] == path


def test_a_callback_without_a_return_value_leaves_no_answer(observer: Observer) -> None:
    client = LifecycleClient(observer, "/part")
    with spinning(observer, "part", configure=lambda: None):
        assert client.state() == "unconfigured"
        assert "configure" in client.available()
        assert observer.wait(client._clients[ChangeState].service_is_ready, 60.0)
        with pytest.raises(NoAnswer):
            client.transition("configure", within=0.6)


def test_a_node_that_is_not_there_is_missing_at_once_when_nothing_can_come(observer: Observer) -> None:
    with pytest.raises(ServiceMissing):
        LifecycleClient(observer, "/nobody").state(within=60.0, give_up=lambda: True)


def test_a_node_whose_events_never_end_does_not_keep_the_check_waiting_for_ever(observer: Observer) -> None:
    client, over = LifecycleClient(observer, "/part"), threading.Event()
    context = Context()
    rclpy.init(context=context, domain_id=observer.domain_id, args=[])
    flood = rclpy.create_node("flood", context=context)
    events = flood.create_publisher(TransitionEvent, "/part/transition_event", 1)

    def publish() -> None:
        while not over.wait(0.01):
            events.publish(TransitionEvent())

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        with spinning(observer, "part"):
            assert client.state(within=60.0) == "unconfigured"
            assert client.wait_for_state("active", within=10.0) == "unconfigured"
    finally:
        over.set()
        thread.join()
        flood.destroy_node()
        rclpy.try_shutdown(context=context)


def test_steps_of_several_nodes_come_in_the_order_in_which_they_were_taken(observer: Observer) -> None:
    clients = [LifecycleClient(observer, f"/{name}") for name in ("first", "second")]
    with spinning(observer, "first", "second"):
        for client in clients:
            assert client.wait_for_state("unconfigured") == "unconfigured"
        for client in reversed(clients):
            assert client.transition("configure").success
        assert observer.wait(lambda: len(in_order(clients)) == 4, 30.0)
        assert [(change.node, change.goal) for change in in_order(clients)] == [
            ("/second", "configuring"),
            ("/second", "inactive"),
            ("/first", "configuring"),
            ("/first", "inactive"),
        ]
