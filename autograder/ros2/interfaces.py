"""Finds installed interfaces: their classes, and the files that define them."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

KINDS = ("msg", "srv", "action")


def interface(name: str, kind: str = "") -> Any:
    """Return the class of an interface, such as `std_msgs/msg/String`.

    Args:
        name: the name of the interface.
        kind: `msg`, `srv` or `action` if the interface must be of this kind; the name may leave it out then, as in
            `std_msgs/String`.

    Raises:
        LookupError: the interface is not installed or is of another kind, or the name is not valid.
    """
    parts = name.split("/")
    if kind and len(parts) == 2:
        parts.insert(1, kind)
    if len(parts) != 3 or not all(parts) or parts[1] not in ((kind,) if kind else KINDS):
        raise LookupError(name)
    try:
        return getattr(importlib.import_module(f"{parts[0]}.{parts[1]}"), parts[2])
    except (ImportError, AttributeError, ValueError) as error:
        raise LookupError(name) from error


def prefixes() -> list[Path]:
    """Return the folders in which packages are installed: those of a sourced workspace, and the environment's own."""
    sourced = [Path(one) for one in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if one]
    return [*dict.fromkeys([*sourced, Path(sys.prefix)])]


def packages() -> dict[str, list[str]]:
    """Return the packages with interfaces, each with its interfaces in their order there, written as `srv/SetBool`."""
    found: dict[str, list[str]] = {}
    for prefix in reversed(prefixes()):
        for index in (prefix / "share/ament_index/resource_index/rosidl_interfaces").glob("*"):
            files = [Path(line) for line in index.read_text(encoding="utf-8").split()]
            found[index.name] = [
                str(path.with_suffix("")) for path in files if path.suffix == ".idl" and path.parts[0] in KINDS
            ]
    return found


def source_of(name: str) -> str:
    """Return the text that defines an interface, as its author wrote it.

    Raises:
        LookupError: there is none. The message, which is that of the real tool, says which part of the name is wrong.
    """
    parts = name.split("/")
    if len(parts) != 3:
        raise LookupError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    package, kind, _ = parts
    if package not in packages():
        raise LookupError(f"Unknown package '{package}'")
    for prefix in prefixes():
        path = prefix / "share" / package / kind / f"{parts[2]}.{kind}"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise LookupError(f"Could not find the interface '{name}'")
