"""The value of a parameter rule, `NAME:=VALUE`: which texts rcl (Jazzy) takes for one.

rcl reads the value as YAML: one plain value, or a list of values of one type.
"""

from __future__ import annotations

import re

import yaml

_BOOLS = {
    word for small in ("y", "yes", "true", "on", "n", "no", "false", "off")
    for word in (small, small.capitalize(), small.upper())
}  # fmt: skip
_INTEGER = re.compile(r"\s*[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_DOUBLE = re.compile(
    r"\s*[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|0[xX][0-9a-fA-F]+(\.[0-9a-fA-F]*)?([pP][+-]?[0-9]+)?"
    r"|\.?inf|infinity|nan)|\.nan",
    re.IGNORECASE,
)

_LONGEST_INTEGER = 1000
"""Characters."""

# A comma behind a tag belongs to the tag for rcl.
_TAG = re.compile(r"(![\w-]*),")
LIBYAML = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The library that rcl reads YAML with; it differs from PyYAML's own reader in tabs and colons."""


def why_refused(value: str) -> str | None:
    """Why rcl does not take a text for a value, as a sentence; None if it does."""
    shown = f"`{value[:60]}`"
    if not value:
        return "it has no value."
    kinds: list[str] = []
    depth = 0
    try:
        for event in yaml.parse(_TAG.sub(r"\1", value), Loader=LIBYAML):
            match event:
                case yaml.AliasEvent() | yaml.MappingStartEvent():
                    what = "an alias" if isinstance(event, yaml.AliasEvent) else "`key: value`"
                    return f"{shown} is {what} in YAML, and no value of a parameter."
                case yaml.SequenceStartEvent():
                    depth += 1
                case yaml.SequenceEndEvent():
                    depth -= 1
                case yaml.ScalarEvent():
                    bare = event.style not in ("'", '"')
                    if depth and bare and ":" in event.value:
                        return f"{shown} has a colon in a list, which stands in quotes."
                    if not event.value and bare:
                        return f"{shown} is empty in YAML."
                    if depth:
                        plain = event.style in (None, "") and event.tag != "tag:yaml.org,2002:str"
                        kinds.append(_kind(event.value, plain=plain))
    except (yaml.YAMLError, RecursionError):
        return f"{shown} is not YAML."
    if len(set(kinds)) > 1:
        return f"in {shown}, the values are of several types: {', '.join(dict.fromkeys(kinds))}."
    return None


def _kind(value: str, *, plain: bool) -> str:
    if not plain:
        return "text"
    if value in _BOOLS:
        return "bool"
    # Python reads no number of thousands of digits, and rcl takes none that long for an integer.
    if len(value) < _LONGEST_INTEGER and _INTEGER.fullmatch(value) and -(2**63) <= _integer(value) < 2**63:
        return "integer"
    return "double" if _DOUBLE.fullmatch(value) else "text"


def _integer(value: str) -> int:
    return int(value, 16 if "x" in value.lower() else 10)
