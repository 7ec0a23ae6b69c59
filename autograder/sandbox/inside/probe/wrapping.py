"""Putting a note around a function of rclpy, which goes on to do what it did, and noting how often one blocks."""

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


class Call:
    """A call that may block, by its line."""

    dirty = False

    def __init__(self, what: str, target: int, where: events.Where, callback: Thing | None) -> None:
        """Begin with none; `target` is the number of the thing that is called."""
        self.key = f"call{next(ledger.numbers)}"
        self.what, self.target, self.where, self.callback = what, target, where, callback
        self.begun = self.ended = self.vain = 0
        self.since = 0.0
        self.thread = 0

    def event(self) -> events.Call:
        """Return its line as it is now."""
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
        """Note that it begins once more."""
        with ledger.lock:
            self.begun += 1
            self.since, self.thread = time.monotonic(), _thread.get_ident()
        ledger.touch(self)

    def end(self, vain: bool) -> None:
        """Note that it came back; `vain` if what it was to wait for had not come."""
        with ledger.lock:
            self.ended += 1
            self.vain += vain
        ledger.touch(self)


_calls: dict[tuple[Any, ...], Call] = {}


def _call(what: str, target: Any) -> Call:
    """The record of a call from the line where this thread is, in the callback that it runs."""
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
    """Whether there is a future among these, and it has no result."""
    return any(hasattr(each, "add_done_callback") and not each.done() for each in arguments)


def wrap_blocking(
    owner: Any,
    name: str,
    what: str,
    spins: Callable[..., Any] | None = None,
    seen: bool = False,
    long: bool = False,
) -> None:
    """As `wrapping.wrap`, for a call that may block.

    Args:
        owner: what has the function.
        name: its name there.
        what: what the event calls it.
        spins: returns the executor that it spins, from its arguments.
        seen: it is noted outside a callback as well.
        long: it spins until the end.
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
