"""Mistakes of a check's author: refused at once, with the line of the check cell, and never a student's failure."""

from __future__ import annotations

import inspect
import linecache
import re
import traceback
from collections.abc import Callable, Iterable, Mapping
from typing import Any

_TIMES = ("within", "for_seconds")

_CLASSES = {
    "message": ("msg", "get_fields_and_field_types"),
    "service": ("srv", "Response"),
    "action": ("action", "Feedback"),
}
"""For each kind of interface its module in a package, and what every class of this kind has."""


class Misuse(Exception):
    """A check asks for something that makes no sense. The message says what, and what to write instead."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows: where in the cell, and no line of the kit."""
        place = place_of(self, lambda name: "ipykernel_" in name or name.startswith("<ipython"))
        return [f"{self} ({place})" if place else str(self)]


def place_of(error: BaseException, is_cells: Callable[[str], bool]) -> str:
    """Where in the check cell an error arose, as `line 3: ros.node("/talker").expect()`; empty if it was not there.

    Args:
        error: that was raised.
        is_cells: whether a file name is that of a check cell.
    """
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if is_cells(frame.filename)]
    if not frames or frames[-1].lineno is None:
        return ""
    line = linecache.getline(frames[-1].filename, frames[-1].lineno).strip()
    return f"line {frames[-1].lineno}: {line}" if line else f"line {frames[-1].lineno}"


def refuse_text(of: str, **lists: object) -> None:
    """Look for a text where a list belongs: its letters would be taken one by one.

    Args:
        of: what is called.
        lists: its arguments, by their names.

    Raises:
        Misuse: there is one.
    """
    for name, value in lists.items():
        if isinstance(value, str):
            raise Misuse(f"{of}: {name}={value!r} is one text; write a list, [...].")


def refuse_no_rules(of: str, remappings: object) -> None:
    """Look for remap rules that are no pairs of texts.

    Args:
        of: what is called.
        remappings: what should be pairs of an old and a new name.

    Raises:
        Misuse: one of them is none.
    """
    refuse_text(of, remappings=remappings)
    pairs = (
        list(remappings) if isinstance(remappings, Iterable) and not isinstance(remappings, Mapping) else [remappings]
    )
    for pair in pairs:
        if not (isinstance(pair, tuple | list) and len(pair) == 2 and all(isinstance(name, str) for name in pair)):
            raise Misuse(f'{of}: remappings={remappings!r} are no remap rules; write pairs, [("OLD", "NEW")].')


def refuse_other_class(of: str, given: object, kind: str) -> None:
    """Look for something else where the class of an interface belongs, such as its name as a text.

    Args:
        of: what is called.
        given: what should be the class.
        kind: `message`, `service` or `action`.

    Raises:
        Misuse: it is not such a class.
    """
    module, has = _CLASSES[kind]
    if isinstance(given, type) and hasattr(given, has):
        return
    if isinstance(given, str):
        *package, name = re.split(r"[./]", given)
        imported = f"from {package[0] if package else 'PACKAGE'}.{module} import {name}"
        raise Misuse(f"{of}: {given!r} is a text; write the {kind} class {name} without quotes, after `{imported}`.")
    name = given.__name__ if isinstance(given, type) else repr(given)
    which = f"{'an' if kind == 'action' else 'a'} {kind} class"
    raise Misuse(f"{of}: {name:.80} is not {which}; write one that is imported from `PACKAGE.{module}`.")


def refuse_times(method: Callable[..., Any]) -> Callable[[tuple[Any, ...], Mapping[str, Any]], None]:
    """Return what looks through the arguments of a call to `method` for times that are none.

    Raises:
        Misuse: (when called) a time is negative, or no number.
    """
    parameters = inspect.signature(method).parameters.values()
    places = {one.name: place for place, one in enumerate(parameters) if one.name in _TIMES}
    by_place = {one.name for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD}

    def look(args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> None:
        for name, place in places.items():
            value = kwargs.get(name, args[place - 1] if name in by_place and len(args) >= place else 0)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= 0:
                raise Misuse(f"{method.__name__}: {name}={value!r} is no time; it is a number of seconds, 0 or more.")

    return look
