"""Writes messages as YAML and as comma-separated values, and fills messages from YAML."""

from __future__ import annotations

import array
import sys
from collections.abc import Iterable, Mapping
from typing import Any

import numpy
import yaml
from rclpy.serialization import serialize_message
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    AbstractWString,
    Array,
    BasicType,
    BoundedSequence,
    BoundedString,
    BoundedWString,
    NamedType,
    NamespacedType,
)

_SEQUENCES = (list, tuple, array.array, numpy.ndarray)


class Shape:
    """Settings for how much of a message is written.

    Args:
        longest: the number of elements or characters after which a value is cut, or None for no limit.
        arrays: whether the elements of arrays are written, or only the type and the length.
        strings: whether the text of strings is written, or only the length.
    """

    def __init__(self, longest: int | None = None, arrays: bool = True, strings: bool = True) -> None:
        """Keep the arguments."""
        self.longest, self.arrays, self.strings = longest, arrays, strings


class _Dumper(yaml.SafeDumper):
    """A dumper without aliases and tags, so that an object that occurs twice is written twice.

    The flow style applies to lists only.
    """

    def ignore_aliases(self, data: object) -> bool:
        return True

    def represent_message(self, fields: dict[str, Any]) -> yaml.MappingNode:
        pairs = [(self.represent_data(name), self.represent_data(value)) for name, value in fields.items()]
        return yaml.MappingNode("tag:yaml.org,2002:map", pairs)


_Dumper.add_representer(dict, _Dumper.represent_message)


def is_message(value: object) -> bool:
    """Whether a value is a message, not a plain value."""
    return hasattr(value, "get_fields_and_field_types")


def to_yaml(message: Any, shape: Shape | None = None, flow: bool = False) -> str:
    """Return a message as a YAML mapping with its fields in the order of their definition."""
    plain = _plain(message, None, shape or Shape())
    # Both Python's float and YAML have inf and nan.
    return yaml.dump(plain, Dumper=_Dumper, width=sys.maxsize, default_flow_style=flow, allow_unicode=True)


def to_csv(value: Any, shape: Shape, kind: Any = None) -> str:
    """Return all plain values of a message, separated by commas. No comma follows empty values at the beginning."""
    if is_message(value):
        kinds = dict(zip(value.get_fields_and_field_types(), value.SLOT_TYPES, strict=False))
        return _joined(to_csv(getattr(value, name), shape, of) for name, of in kinds.items())
    if isinstance(value, _SEQUENCES):
        if not shape.arrays and kind is not None:
            return _what_it_is(kind, len(value))
        written = [to_csv(one, shape) for one in value[: shape.longest]]
        return _joined(written + ["..."] * (shape.longest is not None and len(value) > shape.longest))
    if isinstance(value, str) and not shape.strings:
        return f"<string length: <{len(value)}>>"
    if isinstance(value, (bytes, str)) and shape.longest is not None and len(value) > shape.longest:
        cut = value[: shape.longest]
        value = cut + b"..." if isinstance(cut, bytes) else cut + "..."
    return str(value)


def _joined(texts: Iterable[str]) -> str:
    line = ""
    for text in texts:
        line += f",{text}" if line else text
    return line


def _plain(value: Any, kind: Any, shape: Shape) -> Any:
    """Convert a value to one that YAML can write, reduced to the shape."""
    if is_message(value):
        kinds = dict(zip(value.get_fields_and_field_types(), value.SLOT_TYPES, strict=False))
        return {name: _plain(getattr(value, name), kind, shape) for name, kind in kinds.items()}
    if isinstance(value, _SEQUENCES):
        if not shape.arrays and kind is not None:
            return _what_it_is(kind, len(value))
        elements = value.tolist() if isinstance(value, (array.array, numpy.ndarray)) else list(value)
        cut = [_plain(one, None, shape) for one in elements[: shape.longest]]
        return cut + ["..."] * (shape.longest is not None and len(elements) > shape.longest)
    if isinstance(value, bytes):
        value = value.decode("latin-1")
    if isinstance(value, str):
        if not shape.strings:
            return f"<string length: <{len(value)}>>"
        if shape.longest is not None and len(value) > shape.longest:
            return value[: shape.longest] + "..."
    return value


def _what_it_is(kind: AbstractNestedType, length: int) -> str:
    element = kind.value_type
    if isinstance(element, BasicType):
        name = element.typename
    elif isinstance(element, AbstractString):
        name = "string"
    elif isinstance(element, AbstractWString):
        name = "wstring"
    elif isinstance(element, NamespacedType):
        name = "/".join(element.namespaced_name())
    else:
        name = element.name if isinstance(element, NamedType) else str(element)
    if isinstance(kind, Array):
        return f"<array type: {name}[{kind.size}]>"
    if isinstance(kind, BoundedSequence):
        return f"<sequence type: {name}[{kind.maximum_size}], length: {length}>"
    return f"<sequence type: {name}, length: {length}>"


def fill(message: Any, values: Any, stamps: list[Any] | None = None) -> None:
    """Set the fields that a YAML mapping names.

    Args:
        message: the message to fill.
        values: the values by field name, nested like the message.
        stamps: a list that gets the time stamps to set before each message is sent (`header: auto`, `stamp: now`).

    Raises:
        Exception: Python's own exception if a field does not exist or a value does not fit.
    """
    _fill(message, values, stamps)
    try:
        serialize_message(message)  # only this checks whether the values fit their fields
    except Exception:
        raise ValueError("a value is out of the range of its field, or of another type") from None


def _fill(message: Any, values: Any, stamps: list[Any] | None) -> None:
    if not isinstance(values, Mapping):
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a {type(values).__name__}")
    kinds = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=False))
    for name, given in values.items():
        now = getattr(message, name)
        if stamps is not None and _is_stamp(now, given):
            stamps.append(now.stamp if given == "auto" else now)
            continue
        made = _made(now, given, kinds[name], stamps)
        _check_length(name, made, kinds[name])
        setattr(message, name, made)


def _is_stamp(field: Any, given: Any) -> bool:
    name = type(field).__name__
    return is_message(field) and (name, given) in (("Header", "auto"), ("Time", "now"))


def _check_length(name: str, value: Any, kind: Any) -> None:
    most = kind.maximum_size if isinstance(kind, (BoundedSequence, BoundedString, BoundedWString)) else None
    if most is not None and len(value) > most:
        raise ValueError(f"'{name}' takes {most} elements at most, and not {len(value)}")
    if isinstance(kind, Array) and len(value) != kind.size:
        raise ValueError(f"'{name}' takes exactly {kind.size} elements, and not {len(value)}")


def _made(now: Any, given: Any, kind: Any, stamps: list[Any] | None) -> Any:
    """Return a given value, converted to the type of the field's current value."""
    if isinstance(now, array.array):
        return array.array(now.typecode, given)
    if isinstance(now, numpy.ndarray):
        return numpy.array(given, dtype=now.dtype)
    if is_message(now):
        _fill(now, given, stamps)
        return now
    if isinstance(kind, AbstractNestedType) and isinstance(kind.value_type, NamespacedType):
        element = kind.value_type
        made = []
        for one in given:
            module = __import__(".".join(element.namespaces), fromlist=[element.name])
            made.append(getattr(module, element.name)())
            _fill(made[-1], one, stamps)
        return made
    return given if type(given) is type(now) else type(now)(given)
