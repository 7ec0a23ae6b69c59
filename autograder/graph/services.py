"""Calling a student's services, and offering one to a student's client."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future

from autograder.graph.observer import Observer


@dataclass(frozen=True)
class Answer:
    """The answer to one call."""

    response: Any | None
    """None: no answer came in time."""
    seconds: float
    """From sending the request to the answer, or to giving up."""


class ServiceMissing(Exception):
    """No server of that name and type was found in time."""


def call_all(
    observer: Observer,
    name: str,
    srv_type: type,
    requests: Sequence[Any],
    within: float,
    give_up: Callable[[], bool] | None = None,
) -> list[Answer]:
    """Send all requests at once and wait for the answers.

    Args:
        observer: who asks.
        name: full service name.
        srv_type: service class.
        requests: the requests.
        within: seconds, once for the server to appear and once for the answers.
        give_up: says that no answer can come any more, for example because the program ended.

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
        """Offer it.

        Args:
            observer: who answers.
            name: full service name.
            srv_type: service class.
            answer: fills and returns the response, from (request, response).
            delay: seconds until each answer; other calls are answered meanwhile.
        """
        self.requests: list[Any] = []
        self.served: list[tuple[float, float]] = []
        """Of each answered request: its arrival and its answer, seconds on the system clock as message stamps are."""
        self._observer = observer
        self._answer = answer
        self._delay = delay
        # A group of its own: while an answer is awaited, the observer goes on hearing messages and requests.
        self._group = ReentrantCallbackGroup()
        self._service = observer.node.create_service(srv_type, name, self._handle, callback_group=self._group)

    async def _handle(self, request: Any, response: Any) -> Any:
        arrived = time.time()
        self.requests.append(request)
        self._observer.notify()
        if self._delay:
            # Awaiting frees the observer's only thread; a sleep would hide messages that arrive meanwhile.
            later: Future = Future(executor=self._observer.node.executor)

            def time_is_up() -> None:
                later.set_result(None)
                self._observer.node.executor.wake()  # a result alone does not wake an executor that waits

            timer = threading.Timer(self._delay, time_is_up)
            timer.daemon = True
            timer.start()
            await later
        answer = self._answer(request, response)
        self.served.append((arrived, time.time()))
        self._observer.notify()
        return answer
