"""Which nodes a parameter file is for: its keys, matched as rcl matches them."""

from __future__ import annotations

import re
from typing import Any

import yaml


def node_keys(text: str) -> list[str]:
    """The node names that the file's values are for, as full names; wildcards are kept. Empty if it is no such file."""
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError):
        return []
    found: list[str] = []

    def walk(part: Any, path: str, depth: int) -> None:
        if not isinstance(part, dict) or depth > 10:
            return
        for key, below in part.items():
            if key == "ros__parameters":
                found.append(path or "/")
            else:
                walk(below, f"{path}/{str(key).strip('/')}", depth + 1)

    walk(content, "", 0)
    return found


def is_for(key: str, node: str) -> bool:
    """Whether values below this key reach the node with this full name: `*` is one part of a name, `**` any number."""
    parts = [{"**": r"(/\w+)*", "*": r"/\w+"}.get(part, f"/{re.escape(part)}") for part in key.strip("/").split("/")]
    return re.fullmatch("".join(parts), node) is not None


def why_not_reached(text: str, node: str) -> str | None:
    """Why a parameter file's values do not reach a node, as a sentence; None if they do, or the file has none."""
    keys = node_keys(text)
    if not keys or any(is_for(key, node) for key in keys):
        return None
    written = ", ".join(f"`{key}`" for key in keys)
    return f"The file has values for {written}, and the node is `{node}`: they are left out without a word."
