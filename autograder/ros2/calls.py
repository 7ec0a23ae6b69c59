"""Asking a node's own services."""

from __future__ import annotations

from typing import Any

from autograder.ros2.failure import Failure
from autograder.ros2.session import Session

_READY_WITHIN = 5.0
"""Seconds that a service of a node that is on the graph may take to show up, as with the real tool."""


def ask(session: Session, node: str, service: str, srv_type: Any, request: Any, within: float | None = None) -> Any:
    """The answer of a node's service, or None if it did not come within so many seconds.

    Raises:
        Failure: the service is not there.
    """
    client = session.node.create_client(srv_type, f"{node}/{service}")
    if not session.spin_until(client.service_is_ready, _READY_WITHIN):
        raise Failure("Wait for service timed out")
    return session.answer(client.call_async(request), within)
