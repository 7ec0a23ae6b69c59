"""Wraps functions of rclpy so that calls are noted, without a change to what the functions do."""

import _thread
import functools
import time
from collections.abc import Callable
from typing import Any

from . import events
from .records import Executor, Thing, executor_of, here, thing_of
from .student_lines import own_line
from .writing import ledger, quiet


def wrap(
    owner: Any, name: str, before: Callable[..., Any] | None = None, after: Callable[..., Any] | None = None
) -> None:
    """Wrap `owner.name` so that `before` is called first, and `after` when it has returned.

    `before` gets the arguments of the call, and `after` gets the result and the arguments. `before` is left out if the
    call comes from another noted call of rclpy.
    """
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


class Call:
    """The record of the calls in one line of a function that may block."""

    dirty = False

    def __init__(self, what: str, target: int, where: events.Where, callback: Thing | None) -> None:
        """Begin without calls; `target` is the number of the thing that is called."""
        self.key = f"call{next(ledger.numbers)}"
        self.what, self.target, self.where, self.callback = what, target, where, callback
        self.begun = self.ended = self.vain = 0
        self.since = 0.0
        self.thread = 0

    def event(self) -> events.Call:
        """Return the record's line in its current state."""
        return events.Call(
            what=self.what,
            in_callback=self.callback is not None,
            callback=self.callback.number if self.callback else 0,
            target=self.target,
            begun=self.begun,
            ended=self.ended,
            vain=self.vain,
            since=self.since,
            thread=self.thread,
            **vars(self.where),
        )

    def begin(self) -> None:
        """Note that a call begins."""
        with ledger.lock:
            self.begun += 1
            self.since, self.thread = time.monotonic(), _thread.get_ident()
        ledger.touch(self)

    def end(self, vain: bool) -> None:
        """Note that a call has returned; `vain` says that it did so before the awaited event had happened."""
        with ledger.lock:
            self.ended += 1
            self.vain += vain
        ledger.touch(self)


_calls: dict[tuple[Any, ...], Call] = {}


def _call(what: str, target: Any) -> Call:
    """Return the record of a call from the current line and callback of this thread, and create it if necessary."""
    where, thing = own_line(), None
    with quiet():
        thing = thing_of(target)
    number = thing.number if thing is not None else 0
    key = (what, number, where.line, here.callback.number if here.callback else 0)
    if key not in _calls:
        _calls[key] = Call(what, number, where, here.callback)
        ledger.add(_calls[key])
    return _calls[key]


def _not_done(*arguments: Any) -> bool:
    """Whether one of these arguments is a future that is not done."""
    return any(hasattr(each, "add_done_callback") and not each.done() for each in arguments)


def wrap_blocking(
    owner: Any,
    name: str,
    what: str,
    spins: Callable[..., Any] | None = None,
    seen: bool = False,
    long: bool = False,
) -> None:
    """Wrap a function that may block so that its calls are noted.

    Args:
        owner: the module or class that has the function.
        name: the name of the function in it.
        what: the name of the function in the record.
        spins: returns the executor that the function spins, given its arguments.
        seen: whether calls outside callbacks are noted as well.
        long: whether the function spins until shutdown.
    """
    original = getattr(owner, name)

    @functools.wraps(original)
    def call(*args: Any, **kwargs: Any) -> Any:
        noted: Call | None = None
        spun: Executor | None = None
        if here.depth == 0:
            with quiet():
                if spins is not None:
                    spun = executor_of(spins(*args, **kwargs))
                if seen or here.callback is not None:
                    noted = _call(what, args[0] if args and spins is None else None)
        here.depth += 1
        try:
            with quiet():
                if noted is not None:
                    noted.begin()
                if spun is not None:
                    spun.spin(1, long)
            return original(*args, **kwargs)
        finally:
            here.depth -= 1
            with quiet():
                if noted is not None:
                    noted.end(vain=spins is not None and _not_done(*args, *kwargs.values()))
                if spun is not None:
                    spun.spin(-1, long)

    setattr(owner, name, call)
