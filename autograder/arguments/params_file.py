"""Which nodes a parameter file is for: its keys, matched as rcl matches them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from autograder.core.student_yaml import StudentFileError, load, read


def unreadable(words: Sequence[str], folder: Path) -> StudentFileError | None:
    """Why a program cannot start with these words: the first of its parameter files that is no YAML at all.

    The program itself would only end with the parser's own words. What it might read after all is not decided here.
    """
    for option, file in itertools.pairwise(words):
        if option == "--params-file" and (folder / file).is_file():
            try:
                read(folder / file)
            except StudentFileError as error:
                if error.code == "not-yaml":
                    return error
    return None


def node_keys(text: str) -> list[str]:
    """The node names that the file's values are for, as full names; wildcards are kept. Empty if it is no such file."""
    try:
        content = load(text)
    except StudentFileError:
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
    names = node.strip("/").split("/")
    reached = {0}  # how many of the node's names the key's parts so far can stand for
    for part in key.strip("/").split("/"):
        if part == "**":
            reached = set(range(min(reached), len(names) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(names) and part in ("*", names[at])}
        if not reached:
            return False
    return len(names) in reached


def why_not_reached(text: str, node: str) -> str | None:
    """Why a parameter file's values do not reach a node, as a sentence; None if they do, or the file has none."""
    keys = node_keys(text)
    if not keys or any(is_for(key, node) for key in keys):
        return None
    written = ", ".join(f"`{key[:60]}`" for key in keys[:4]) + (", …" if len(keys) > 4 else "")
    return f"The file has values for {written}, and the node is `{node}`: it gets none, and ROS 2 does not warn."
