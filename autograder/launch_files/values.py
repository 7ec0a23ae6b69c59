"""Parameter values and their types, converted from a `value` and a `type` as `launch` and `launch_ros` do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from autograder.core import student_yaml
from autograder.launch_files import substitutions
from autograder.launch_files.errors import refused
from autograder.launch_files.texts import Text, parse, plain
from autograder.reasons import Refused

_SIMPLE = (bool, int, float, str)
_TYPES: dict[str, tuple[type | None, bool]] = {
    "str": (str, False), "bool": (bool, False), "float": (float, False), "int": (int, False),
    "list_of_str": (str, True), "list_of_bool": (bool, True), "list_of_float": (float, True),
    "list_of_int": (int, True), "yaml": (None, False),
}  # fmt: skip
"""The meaning of each word for `type:`: the type of the value or of a list's items, and whether it is a list."""
_OWN_QUOTES = "For a text, write `type: str` beside the value."


@dataclass(frozen=True)
class Value:
    """A `value` as written in the file: a text with substitutions is a `Text`, everything else is as YAML reads it."""

    content: Text | bool | float | str | list[Any]
    kind: type | None
    """The type of the value or of a list's items; None if YAML decides."""


def read(value: Any, kind: Any) -> Value:
    """Read a `value` and its `type` as `launch` does when it reads a file.

    Args:
        value: the content of `value:`.
        kind: the content of `type:`; None if the key is missing.

    Raises:
        Refused: `launch` refuses it.
    """
    if kind is not None and (not isinstance(kind, str) or kind not in _TYPES):
        raise refused(f"`{kind}` is not a type.", f"Types are {', '.join(_TYPES)}.")
    wanted, is_list = _TYPES[kind] if kind is not None else (None, False)
    if isinstance(value, list):
        if kind not in (None, "yaml") and not is_list:
            raise refused(f"a list cannot be of the type `{kind}`.", f"Write `type: list_of_{kind}`.")
        return Value(_list(value, wanted), wanted)
    if not isinstance(value, _SIMPLE):
        raise refused(
            f"a parameter is a bool, a number, a text or a list of these, not {_shown(value)}.",
            "Write a text in quotes.",
        )
    if is_list:  # `launch` accepts no text here, not even one that YAML would convert to a list
        raise refused(f"{_shown(value)} is not of the type `{kind}`.", "Write a list, such as `[1, 2]`.")
    content = _text(value) if isinstance(value, str) else value
    if not isinstance(content, tuple) and wanted is not None and not isinstance(content, wanted):
        raise refused(
            f"{_shown(value)} is not of the type `{kind}`: a value without `$(…)` is not converted.",
            "Write the value as YAML has it, without `type`.",
        )
    return Value(content, wanted)


def _text(value: str) -> Text | str:
    """Return the text itself if it is a literal, or its parts if it has substitutions, which are performed later."""
    parts = parse(value)
    substitutions.check(parts)
    literal = plain(parts)
    return parts if literal is None else literal


def _list(value: list[Any], wanted: type | None) -> list[Any]:
    if not value:
        raise refused("a list without items has no type; it is not covered here.")
    if not all(isinstance(item, _SIMPLE) for item in value):
        raise refused("a list of bools, numbers or texts is expected.")
    items = [_text(item) if isinstance(item, str) else item for item in value]
    kinds = {type(item) for item in items if not isinstance(item, tuple)}
    if len(kinds) > 1 or (wanted is not None and kinds not in (set(), {wanted})):
        raise refused("a list of values of one type is expected.", "`1` is an integer, `1.0` a double.")
    return items


def settle(value: Value, perform: Callable[[Text], str]) -> Any:
    """Perform the substitutions of a value and convert the result.

    Raises:
        Refused: the result cannot be converted.
    """
    content = value.content
    if isinstance(content, tuple):
        return _converted(perform(content), value.kind)
    if not isinstance(content, list):
        return content
    items = [_converted(perform(item), value.kind) if isinstance(item, tuple) else item for item in content]
    return _uniform(items)


def read_as_yaml(text: str) -> Any:
    """Read a parameter's text as YAML and return a bool, a number, a text or a list of values of one type.

    Raises:
        Refused: the text is something else.
    """
    try:
        value = student_yaml.load(text, "the value")
    except Refused:
        raise refused(f"`{text[:60]}` is read as YAML, and it is not YAML.", _OWN_QUOTES) from None
    if isinstance(value, list):
        return _uniform(value)
    if not isinstance(value, _SIMPLE):
        raise refused(
            f"`{text[:60]}` is read as YAML, which makes {_shown(value)} of it; a parameter is a bool, a number, a "
            "text or a list of these.",
            _OWN_QUOTES,
        )
    return value


def _uniform(items: list[Any]) -> list[Any]:
    if not items or len({type(item) for item in items}) != 1 or not isinstance(items[0], _SIMPLE):
        raise refused(f"a list of values of one type is expected, not {_shown(items)}.")
    return items


def _converted(text: str, kind: type | None) -> Any:
    if kind is None:
        return read_as_yaml(text)
    if kind is bool:
        value = read_as_yaml(text)
        if not isinstance(value, bool):
            raise refused(f"`{text[:60]}` is not of the type `bool`.")
        return value
    try:
        return kind(text)
    except ValueError:
        raise refused(f"`{text[:60]}` is not of the type `{kind.__name__}`.") from None


def _shown(value: Any) -> str:
    return "nothing" if value is None else f"`{str(value)[:60]}`"
