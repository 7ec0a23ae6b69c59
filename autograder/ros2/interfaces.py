"""Interfaces that are installed: their classes, and the files that describe them."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

KINDS = ("msg", "srv", "action")


def interface(name: str, kind: str = "") -> Any:
    """The class of `std_msgs/msg/String`.

    Args:
        name: of the interface.
        kind: `msg`, `srv` or `action`, if it must be one; the name may leave it out then, as `std_msgs/String`.

    Raises:
        LookupError: it is not installed, is of another kind, or has no such name.
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
    """Where packages are installed: the environment's own folder, and those of a workspace that was sourced."""
    sourced = [Path(one) for one in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if one]
    return [*dict.fromkeys([*sourced, Path(sys.prefix)])]


def packages() -> dict[str, list[str]]:
    """Packages with interfaces, and their interfaces as `srv/SetBool`, in the order of the package."""
    found: dict[str, list[str]] = {}
    for prefix in reversed(prefixes()):
        for index in (prefix / "share/ament_index/resource_index/rosidl_interfaces").glob("*"):
            files = [Path(line) for line in index.read_text(encoding="utf-8").split()]
            found[index.name] = [
                str(path.with_suffix("")) for path in files if path.suffix == ".idl" and path.parts[0] in KINDS
            ]
    return found


def source_of(name: str) -> str:
    """The text that defines an interface, as its author wrote it.

    Raises:
        LookupError: there is none; says which part of the name is wrong, in the real tool's words.
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
