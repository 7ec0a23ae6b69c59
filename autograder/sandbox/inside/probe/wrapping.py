"""Putting a note around a function of rclpy, which goes on to do what it did."""

import functools
from collections.abc import Callable
from typing import Any

from .thread_state import here
from .writing import quiet


def wrap(
    owner: Any, name: str, before: Callable[..., Any] | None = None, after: Callable[..., Any] | None = None
) -> None:
    """Replace `owner.name` by itself with a note before it and one after it has returned (its result first)."""
    original = getattr(owner, name)

    @functools.wraps(original)
    def call(*args: Any, **kwargs: Any) -> Any:
        outermost = here.depth == 0
        here.depth += 1
        try:
            if before is not None and outermost:
                with quiet():
                    before(*args, **kwargs)
            result = original(*args, **kwargs)
        finally:
            here.depth -= 1
        if after is not None:
            with quiet():
                after(result, *args, **kwargs)
        return result

    setattr(owner, name, call)
