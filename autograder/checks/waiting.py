"""What each expectation waits for, in words: a notebook says it while a launch runs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from autograder.checks.misuse import refuse_times
from autograder.reasons import Reason

Method = TypeVar("Method", bound=Callable[..., Any])


class NotLaunchedError(Exception):
    """What a cell launches is not there, or cannot be used. In a notebook it reads as a sentence."""

    def __init__(self, reason: Reason) -> None:
        """Keep what to say."""
        super().__init__(f"{reason.because} {reason.hint}")

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback: the student's line is not the mistake."""
        return [str(self)]


def waits_for(sentence: str) -> Callable[[Method], Method]:
    """Make a method of a noun say what it waits for while it does, and refuse times that are none.

    Args:
        sentence: what it waits for; `{name}` stands for the noun's name.
    """

    def decorate(method: Method) -> Method:
        look_at_times = refuse_times(method)

        @functools.wraps(method)
        def call(self: Any, *args: Any, **kwargs: Any) -> Any:
            look_at_times(args, kwargs)
            watcher = self._running.watcher
            if watcher is None or not watcher.begin(sentence.format(name=getattr(self, "name", ""))):
                return method(self, *args, **kwargs)
            try:
                return method(self, *args, **kwargs)
            finally:
                watcher.end()

        return cast(Method, call)

    return decorate
