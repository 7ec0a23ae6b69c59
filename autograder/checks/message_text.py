"""A message in a line of text: the fields that a check looked at stand first, so that a cut never hides them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import CodeType
from typing import Any

_ELEMENTS = 6
"""So many elements of a sequence are written out."""
_MEANT = 1e-300
"""No robot measures anything smaller."""


def in_words(message: Any, looked_at_by: Callable[..., object] | None = None) -> str:
    """The message's fields as `header.frame_id='map', info.width=5`; of one with `data` only, that alone.

    Args:
        message: a ROS message.
        looked_at_by: the check's function, whose attribute names tell which fields matter.
    """
    data = getattr(message, "data", None)
    if isinstance(data, (str, int, float, bool)):
        return str(data)
    wanted = _names(looked_at_by)
    fields = list(_fields(message, ""))
    fields.sort(key=lambda field: field[0].rpartition(".")[2] not in wanted)  # stable: the message's own order
    return ", ".join(f"{path}={_value(value)}" for path, value in fields)


def int_in_float(message: Any) -> str:
    """The field that holds what becomes of an `int` where a `float` belongs, as `data=5e-324`; empty if none does.

    rclpy's C code takes the int's memory for that of a float, and comes to a number so near to 0 that nobody means it.
    """
    return next((f"{path}={value!r}" for path, value in _fields(message, "") if was_an_int(value)), "")


def was_an_int(value: Any) -> bool:
    """Whether a value is what becomes of an `int` that was assigned where a `float` belongs."""
    return isinstance(value, float) and 0.0 < abs(value) < _MEANT


def set_fields(message: Any) -> str:
    """A message's fields as `order=5`; of several, those that are 0, empty or false are left out."""
    fields = list(_fields(message, ""))
    alone = len(fields) == 1
    said = [f"{path}={_value(value)}" for path, value in fields if alone or value not in (0, b"\x00", "", [])]
    return ", ".join(said) or "every field is 0 or empty"


def shorten(text: str, length: int = 200) -> str:
    """At most `length` characters; what is left out is marked."""
    return text if len(text) <= length else text[: length - 3] + "..."


def _fields(message: Any, path: str) -> Iterator[tuple[str, Any]]:
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            yield from _fields(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", value


def _value(value: Any) -> str:
    if isinstance(value, (str, bool, int, float)):
        return repr(value)
    try:
        first = ", ".join(str(element) for element, _ in zip(value, range(_ELEMENTS), strict=False))
        return f"[{first}{f', ... {len(value)} in all' if len(value) > _ELEMENTS else ''}]"
    except TypeError:
        return str(value)


def _names(function: Callable[..., object] | None) -> set[str]:
    """The names that a function's code uses, those of functions within it included."""
    code = getattr(function, "__code__", None)
    todo, names = [code] if isinstance(code, CodeType) else [], set[str]()
    while todo:
        current = todo.pop()
        names |= set(current.co_names)
        todo += [constant for constant in current.co_consts if isinstance(constant, CodeType)]
    return names
