"""Calls of rclpy that may block or that answer later, callbacks as rclpy runs them, and the program's own threads."""

import functools
import inspect
import threading
from typing import Any

from . import events, rclpy_names
from .blocking import wrap_blocking
from .callbacks import asked_by, await_or_execute, noted
from .own_lines import callback_line, error_line
from .thing import thing_of
from .wrapping import wrap
from .writing import emit, quiet


def watch_blocking(rclpy: Any) -> None:
    """Wrap the calls that wait for an answer, a service, a rate or the end."""
    wrap_blocking(rclpy.client.Client, "call", "client.call", seen=True)
    wrap_blocking(rclpy.client.Client, "wait_for_service", "wait_for_service", seen=True)
    wrap_blocking(rclpy.action.ActionClient, "send_goal", "action_client.send_goal", seen=True)
    wrap_blocking(rclpy.timer.Rate, "sleep", "rate.sleep", seen=True)
    wrap_blocking(rclpy, "shutdown", "shutdown")
    wrap_blocking(rclpy, "try_shutdown", "shutdown")
    wrap_blocking(rclpy.executors.Executor, "shutdown", "shutdown")

    def asked(future: Any, client: Any, *_args: Any) -> None:
        thing = thing_of(client)
        if thing is not None:
            asked_by[future] = thing.number
            thing.count()

    wrap(rclpy.client.Client, "call_async", after=asked)


def watch_callbacks(rclpy: Any) -> None:
    """Take the place of what runs callbacks, and let tasks be seen."""
    for module in rclpy_names.callers_of_callbacks(rclpy):
        if not hasattr(module, rclpy_names.RUN_CALLBACK):
            raise AttributeError(f"{module.__name__}.{rclpy_names.RUN_CALLBACK}")
        setattr(module, rclpy_names.RUN_CALLBACK, await_or_execute)

    create_task = rclpy.executors.Executor.create_task

    @functools.wraps(create_task)
    def create_noted(self: Any, callback: Any, *args: Any, **kwargs: Any) -> Any:
        with quiet():
            if callback_line(callback).line and not inspect.iscoroutinefunction(callback):
                callback = noted("task", callback, "", None)
        return create_task(self, callback, *args, **kwargs)

    rclpy.executors.Executor.create_task = create_noted


def watch_threads() -> None:
    """Note what ends a thread of the program's own."""
    before = threading.excepthook

    def hook(args: Any) -> None:
        with quiet():
            if args.exc_value is not None and type(args.exc_value).__name__ != "ExternalShutdownException":
                error = args.exc_value
                event = events.ThreadError(
                    type=type(error).__name__,
                    text=str(error),
                    **vars(error_line(error)),
                )
                emit(event)
        before(args)

    threading.excepthook = hook
