"""Watches executors: their creation, the nodes that they get, when they spin, and which callbacks they take."""

import functools
from typing import Any

from . import rclpy_names
from .records import executor_of, here, thing_of
from .wrapping import wrap, wrap_blocking
from .writing import ledger, quiet


def watch_executors(rclpy: Any) -> None:
    """Wrap the functions that create executors, add nodes to them, and spin them."""
    base = rclpy.executors.Executor

    def made(_result: None, executor: Any, *_args: Any, **_kwargs: Any) -> None:
        executor_of(executor)

    def made_with_threads(_result: None, executor: Any, num_threads: int | None = None, **_kwargs: Any) -> None:
        executor_of(executor).threads_given = num_threads is not None
        ledger.touch(executor_of(executor))

    def nodes_changed(_result: Any, executor: Any, *_args: Any) -> None:
        executor_of(executor).spin(0)

    def itself(executor: Any, *_args: Any, **_kwargs: Any) -> Any:
        return executor

    def given(_node: Any, *args: Any, **kwargs: Any) -> Any:
        found = kwargs.get("executor")
        for value in args:
            found = value if isinstance(value, base) else found
        return rclpy.get_global_executor() if found is None else found

    wrap(base, "__init__", after=made)
    wrap(rclpy.executors.MultiThreadedExecutor, "__init__", after=made_with_threads)
    wrap(base, "add_node", after=nodes_changed)
    wrap(base, "remove_node", after=nodes_changed)
    for name in ("SingleThreadedExecutor", "MultiThreadedExecutor"):
        wrap_blocking(getattr(rclpy.executors, name), "spin_once", "spin", itself)
    wrap_blocking(base, "spin", "spin", itself, long=True)
    wrap_blocking(base, "spin_until_future_complete", "spin", itself)
    for name in ("spin", "spin_once", "spin_until_future_complete"):
        wrap_blocking(rclpy, name, "spin", given, long=name == "spin")
    for name in rclpy_names.TAKES:
        _wrap_take(base, name)
    _wrap_take_answer(base)


def _wrap_take(base: Any, name: str) -> None:
    """Wrap a function that takes a ready callback, so that the thing to which the callback belongs is known."""
    original = getattr(base, name)

    @functools.wraps(original)
    def take(self: Any, entity: Any) -> Any:
        execute = original(self, entity)
        thing = None
        with quiet():
            thing = ledger.known.get(entity)
        if execute is None or thing is None:
            return execute

        async def noted() -> None:
            here.taken = (thing, ledger.known.get(self))
            try:
                await execute()
            finally:
                here.taken = None

        return noted

    setattr(base, name, take)


def _wrap_take_answer(base: Any) -> None:
    """Count the responses that a client gets."""
    original = getattr(base, rclpy_names.TAKE_ANSWER)

    @functools.wraps(original)
    def take(self: Any, client: Any) -> Any:
        result = original(self, client)
        with quiet():
            thing = thing_of(client)
            if thing is not None and result is not None:
                thing.done += 1
                ledger.touch(thing)
        return result

    setattr(base, rclpy_names.TAKE_ANSWER, take)
