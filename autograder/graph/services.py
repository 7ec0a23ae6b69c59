"""Calls a student's services, and offers a service to a student's client."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.srv import ListParameters
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.client import Client
from rclpy.task import Future
from type_description_interfaces.srv import GetTypeDescription

from autograder.graph.observer import Observer

_NO_TYPE = "RIHS01_" + 64 * "0"
"""The hash of no type. If a hash is not of this form, rcl prints an error in the program that is asked."""
_QUESTIONS: dict[str, tuple[type, Any]] = {
    "list_parameters": (ListParameters, ListParameters.Request()),
    "get_type_description": (GetTypeDescription, GetTypeDescription.Request(type_hash=_NO_TYPE)),
}
"""Services that a node has by default, with requests that change nothing. A program can switch off either of them."""


@dataclass(frozen=True)
class Answer:
    """The response to one call."""

    response: Any | None
    """The response; None if none came in time."""
    seconds: float
    """The seconds from sending the request to the response, or to giving up."""


class ServiceMissing(Exception):
    """No server with this name and type was found in time."""


def call_all(
    observer: Observer,
    name: str,
    srv_type: type,
    requests: Sequence[Any],
    within: float,
    give_up: Callable[[], bool] | None = None,
) -> list[Answer]:
    """Send all requests at once and wait for the responses.

    Args:
        observer: the observer that sends the requests.
        name: the full name of the service.
        srv_type: the service class.
        requests: the requests.
        within: the seconds to wait, once for the server to appear and once for the responses.
        give_up: returns true if no response can come any more, for example because the program has ended.

    Raises:
        ServiceMissing: no server appeared.
    """
    client = observer.node.create_client(srv_type, name)
    try:
        if not observer.wait(client.service_is_ready, within, give_up):
            raise ServiceMissing(name)
        sent = time.monotonic()
        ended: dict[int, float] = {}
        futures: list[Future] = []
        for number, request in enumerate(requests):
            future = client.call_async(request)

            def note(done: Future, number: int = number) -> None:
                ended[number] = time.monotonic()
                if done.exception() is None:
                    observer.answers.append((name, done.result()))
                observer.notify()

            future.add_done_callback(note)
            futures.append(future)
        observer.wait(lambda: all(future.done() for future in futures), within, give_up)
        now = time.monotonic()
        return [
            Answer(future.result() if future.done() else None, ended.get(number, now) - sent)
            for number, future in enumerate(futures)
        ]
    finally:
        observer.node.destroy_client(client)


def ask_nodes(
    observer: Observer, nodes: Collection[str], within: float, give_up: Callable[[], bool] | None = None
) -> bool:
    """Ask all nodes a question at once, wait for the answers, and return whether every node has answered.

    Each question has an end of its own, which is made after all ends that the observer had when this was called.

    Args:
        observer: the observer that asks.
        nodes: the full names of the nodes. A node that has none of rclpy's own services cannot be asked.
        within: the seconds to wait for the answers of all nodes together.
        give_up: returns true if no answer can come any more, for example because a program has ended.
    """
    clients: dict[str, tuple[Client, Any]] = {}
    """Of each node that can be asked, the client and the request."""
    answers: dict[str, Future] = {}

    def answered() -> bool:
        for node in nodes:
            if node not in clients:
                offered = observer.services_of(node)
                question = next((name for name in _QUESTIONS if f"{node}/{name}" in offered), None)
                if question is not None:
                    srv_type, request = _QUESTIONS[question]
                    clients[node] = observer.node.create_client(srv_type, f"{node}/{question}"), request
            elif node not in answers and clients[node][0].service_is_ready():
                client, request = clients[node]
                answers[node] = client.call_async(request)
                answers[node].add_done_callback(lambda _: observer.notify())
        return len(answers) == len(nodes) and all(answer.done() for answer in answers.values())

    try:
        return observer.wait(answered, within, give_up)
    finally:
        for client, _ in clients.values():
            observer.node.destroy_client(client)


class OfferedService:
    """A service that the observer offers to the student's node."""

    def __init__(
        self,
        observer: Observer,
        name: str,
        srv_type: type,
        answer: Callable[[Any, Any], Any],
        delay: float = 0.0,
    ) -> None:
        """Create the service.

        Args:
            observer: the observer that answers.
            name: the full name of the service.
            srv_type: the service class.
            answer: called with the request and the response; fills the response and returns it.
            delay: the seconds until each response is sent; other requests are handled in the meantime.
        """
        self.requests: list[Any] = []
        self.served: list[tuple[float, float]] = []
        """When each answered request arrived and was answered, in seconds on the system clock, like message stamps."""
        self._observer = observer
        self._answer = answer
        self.delay = delay
        # The service has its own group, so that the observer receives messages and requests while a response waits.
        self._group = ReentrantCallbackGroup()
        self._service = observer.node.create_service(srv_type, name, self._handle, callback_group=self._group)

    async def _handle(self, request: Any, response: Any) -> Any:
        arrived = time.time()
        self.requests.append(request)
        self._observer.notify()
        if self.delay:
            # Awaiting frees the observer's only thread; with a sleep, it would not take messages that arrive meanwhile.
            later: Future = Future(executor=self._observer.node.executor)

            def time_is_up() -> None:
                later.set_result(None)
                self._observer.node.executor.wake()  # a result alone does not wake an executor that waits

            timer = threading.Timer(self.delay, time_is_up)
            timer.daemon = True
            timer.start()
            await later
        answer = self._answer(request, response)
        self.served.append((arrived, time.time()))
        self._observer.notify()
        return answer
