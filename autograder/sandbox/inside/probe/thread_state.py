"""What each thread of the program is doing."""

import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .thing import Thing


class ThreadState(threading.local):
    """What this thread is doing."""

    callback: "Thing | None" = None
    """The callback that it runs."""
    taken: Any = None
    """(thing, executor) of the callback that rclpy is about to run."""
    depth = 0
    """How many noted calls of rclpy are on the stack since the innermost callback began: rclpy calls itself."""
    building = False
    """Inside `Node.__init__`: what is made there is rclpy's own."""


here = ThreadState()
