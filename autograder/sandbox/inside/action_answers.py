"""Answers that rclpy's action client would throw away.

The client sends a request, and only then notes that it waits for the answer. When another thread spins the node, the
answer may be looked at in between: rclpy ignores it with a warning, and the future never ends (ros2/rclpy issue 1123;
versions after 7.1 hold a lock). How often that happens depends on how busy the machine is, and a verdict must not.
"""

import functools
import threading
from typing import Any

from .probe import rclpy_names


def keep_answers(client_class: Any) -> None:
    """Let an answer wait until the request that it belongs to has been noted, for every action client.

    Args:
        client_class: rclpy's `ActionClient`.
    """
    asking = threading.RLock()

    def noted(send: Any) -> Any:
        @functools.wraps(send)
        def send_and_note(*args: Any, **kwargs: Any) -> Any:
            with asking:
                return send(*args, **kwargs)

        return send_and_note

    for name in rclpy_names.ACTION_REQUESTS:
        setattr(client_class, name, noted(getattr(client_class, name)))
    execute = client_class.execute

    @functools.wraps(execute)
    async def execute_after(*args: Any, **kwargs: Any) -> Any:
        with asking:
            pass  # what was being asked has been noted
        return await execute(*args, **kwargs)

    client_class.execute = execute_after
