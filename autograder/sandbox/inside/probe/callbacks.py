"""Watches running callbacks: their threads, how they end, what they return and await, and which calls block."""

import functools
import inspect
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any, NamedTuple

from . import events, rclpy_names
from .records import Executor, Thing, here, thing_of
from .student_lines import awaited_line, callback_line, error_line
from .watch_messages import note_misfit
from .wrapping import wrap, wrap_blocking
from .writing import PAUSE, emit, emit_once, ledger, quiet


class ActionCallback(NamedTuple):
    """The information about a callback of an action server."""

    thing: Thing
    expected: type | None
    """The type that it must return."""
    node: "weakref.ref[Any]"


action_callbacks: dict[Any, ActionCallback] = {}
"""The information about each callback of an action server."""

asked_by: "weakref.WeakKeyDictionary[Any, int]" = weakref.WeakKeyDictionary()
"""For the future of each service call: the number of the client."""

_by_line: dict[tuple[str, ...], Thing] = {}


class _OnThread:
    """A block in which a thread runs a callback. An exception that leaves the callback is noted."""

    def __init__(self, thing: Thing, executor: Executor | None) -> None:
        self.thing, self.executor = thing, executor
        self.before: tuple[Thing | None, int] = (None, 0)

    def __enter__(self) -> None:
        self.before = here.callback, here.depth
        here.callback, here.depth = self.thing, 0
        if self.executor is not None:
            self.executor.step(1)

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        here.callback, here.depth = self.before
        if self.executor is not None:
            self.executor.step(-1)
        if not isinstance(error, Exception) or isinstance(error, StopIteration):
            return
        with quiet():
            if type(error).__name__ != "ExternalShutdownException":
                event = events.CallbackError(
                    kind=self.thing.about.kind,
                    name=self.thing.about.name,
                    when=time.monotonic(),
                    type=type(error).__name__,
                    text=str(error),
                    **vars(error_line(error)),
                )
                emit(event)


class _Steps:
    """Awaits a coroutine callback. Between its steps, the thread is not inside the callback."""

    def __init__(self, coroutine: Any, thing: Thing, executor: Executor | None) -> None:
        self.coroutine, self.thing, self.executor = coroutine, thing, executor

    def __await__(self) -> Any:
        # rclpy resumes an awaiting coroutine continuously, without a pause, so most of these steps must be cheap.
        steps, sent, thing, look = self.coroutine.__await__(), None, self.thing, 0.0
        while True:
            try:
                with _OnThread(thing, self.executor):
                    wanted = steps.send(sent)
            except StopIteration as end:
                return end.value
            now = time.monotonic()
            if now >= look:
                look = now + PAUSE
                with quiet():
                    self._note(now)
            sent = yield wanted

    def _note(self, now: float) -> None:
        thing = self.thing
        where, target = awaited_line(self.coroutine)
        client = asked_by.get(target, 0) if target is not None else 0
        if where.line != thing.awaits.line:
            thing.awaits = events.Awaits(client=client, since=now, **vars(where))
            thing.awaited = where.line
            ledger.touch(thing)


async def await_or_execute(callback: Any, *args: Any) -> Any:
    """Do the same as rclpy's own function of this name, and note the run of the callback."""
    taken, here.taken = here.taken, None
    thing, executor = taken or _of_an_action(callback)
    run = thing.begin()
    raised = True
    try:
        if inspect.iscoroutinefunction(callback):
            result = await _Steps(callback(*args), thing, executor)
        else:
            with _OnThread(thing, executor):
                result = callback(*args)
        raised = False
    finally:
        with quiet():
            thing.awaits = events.Awaits()
            thing.end(run, raised)
    with quiet():
        _check_return(callback, thing.about.kind, args, result)
    return result


def _of_an_action(callback: Any) -> tuple[Thing, Executor | None]:
    """Return the thing and the executor of an action server's callback.

    For a callback of something that is not watched, such as the feedback callback of an action client, return the thing
    of the line in which the callback begins, or one thing for all callbacks that begin in none of the student's lines.
    """
    with quiet():
        known = action_callbacks[callback]
        return known.thing, ledger.known.get(getattr(known.node(), "executor", None))
    with quiet():
        return _at_line("", callback_line(callback), ""), None
    return Thing(events.ThingMade(kind="")), None


def _at_line(kind: str, where: events.Where, node: str) -> Thing:
    """Return the thing of a callback that is known only by its line."""
    key = (kind, node, where.line)
    if key not in _by_line:
        _by_line[key] = Thing(events.ThingMade(kind=kind, node=node, **vars(where)))
        ledger.add(_by_line[key])
    return _by_line[key]


def _check_return(callback: Any, kind: str, args: tuple[Any, ...], result: Any) -> None:
    if kind == "service" and len(args) == 2:
        expected: Any = type(args[1])
    else:
        expected = action_callbacks[callback].expected if callback in action_callbacks else None
    if isinstance(expected, type) and not isinstance(result, expected):
        _bad_return(kind, callback, result, expected)
    if kind == "execute" and len(args) == 1:
        name = action_callbacks[callback].thing.about.name
        if isinstance(expected, type) and isinstance(result, expected):
            note_misfit("result", name, result, expected)
        if args[0].is_active:
            emit_once(events.GoalLeft(name=name, **vars(callback_line(callback))))


def _bad_return(kind: str, callback: Any, result: Any, expected: type) -> None:
    text = f"{type(result).__name__} instead of {expected.__name__}".replace("NoneType", "None")
    emit_once(events.BadReturn(kind=kind, text=text, **vars(callback_line(callback))))


def noted(kind: str, callback: Callable[..., Any], node: str, expected: type | None) -> Callable[..., Any]:
    """Return a wrapper that notes the runs of a callback; `expected` is the type that the callback must return."""
    thing = _at_line(kind, callback_line(callback), node)

    @functools.wraps(callback)
    def call(*args: Any, **kwargs: Any) -> Any:
        run = thing.begin()
        raised = True
        try:
            with _OnThread(thing, None):
                result = callback(*args, **kwargs)
            raised = False
        finally:
            with quiet():
                thing.end(run, raised)
        with quiet():
            if expected is not None and not isinstance(result, expected):
                _bad_return(kind, callback, result, expected)
        return result

    return call


def watch_blocking(rclpy: Any) -> None:
    """Wrap the functions that wait for a response, a service or a rate, and those that shut down."""
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
    """Replace the function that runs callbacks, and wrap the creation of tasks."""
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
    """Note exceptions that end a thread which the program started itself."""
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
