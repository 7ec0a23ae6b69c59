"""What each expectation waits for, in words: a notebook says it while a launch runs."""

from __future__ import annotations

import functools
from typing import Any

from autograder.checks.misuse import refuse_times
from autograder.reasons import Reason

_WAITS_FOR = {
    "expect_node": "the node `{}`",
    "expect_no_node": "the node `{}` to go away",
    "expect_topic": "the topic `{}`",
    "expect_no_topic": "the topic `{}` to go away",
    "expect_publisher": "a publisher on `{}`",
    "expect_subscription": "a subscription on `{}`",
    "expect_no_publisher": "the publishers on `{}` to go away",
    "expect_no_subscription": "the subscriptions on `{}` to go away",
    "expect_qos": "an endpoint on `{}`",
    "expect_match": "both ends of `{}`",
    "expect_messages": "messages on `{}`",
    "expect_silence": "silence on `{}`",
    "expect_period": "runs of callbacks, told on `{}`",
    "expect_runs": "runs of callbacks, told on `{}`",
    "expect_overlap": "callbacks that overlap, told on `{}`",
    "expect_no_overlap": "runs of callbacks, told on `{}`",
    "expect_messages_during": "messages on `{}`",
    "expect_service": "the service `{}`",
    "expect_parameter": "the parameters of `{}`",
    "expect_parameter_refused": "the parameters of `{}`",
    "expect_state": "the state of `{}`",
    "expect_transitions": "transitions of `{}`",
    "expect_running": "the program `{}`",
    "expect_exit": "the end of the program `{}`",
    "expect_clean_end": "the end of the program `{}`",
    "expect_log": "a log message that says `{}`",
    "transition": "`{}` to change its state",
    "available_transitions": "an answer of `{}`",
    "state": "the state of `{}`",
    "call": "an answer of `{}`",
    "call_many": "answers of `{}`",
    "get_parameters": "the parameters of `{}`",
    "list_parameters": "the parameters of `{}`",
    "set_parameter": "an answer of `{}`",
    "send_goal": "the action `{}`",
    "expect_feedback": "feedback about a goal",
    "expect_result": "the end of a goal",
    "expect_canceled": "the end of a goal",
    "publish": "a subscription on `{}`",
    "wait_for_graph": "what `ros.wait_for_graph` asks for",
    "wait": "what `ros.wait` asks for",
}


class NotLaunchedError(Exception):
    """What a cell launches is not there, or cannot be used. In a notebook it reads as a sentence."""

    def __init__(self, reason: Reason) -> None:
        """Keep what to say."""
        super().__init__(f"{reason.because} {reason.hint}")

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback: the student's line is not the mistake."""
        return [str(self)]


def watched(launch: type) -> type:
    """Make the methods of `launch` that wait say what for."""
    for name, sentence in _WAITS_FOR.items():
        setattr(launch, name, _says(getattr(launch, name), sentence))
    return launch


def _says(method: Any, sentence: str) -> Any:
    look_at_times = refuse_times(method)

    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        look_at_times(args, kwargs)
        first = next(iter([*args, *kwargs.values()]), "")
        awaited = sentence.format(first if isinstance(first, str) else "it")
        if self._watch is None or not self._watch.begin(awaited):
            return method(self, *args, **kwargs)
        try:
            return method(self, *args, **kwargs)
        finally:
            self._watch.end()

    return call
