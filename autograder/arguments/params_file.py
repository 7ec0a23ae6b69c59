"""Which nodes a parameter file is for: its keys, matched as rcl matches them."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from autograder.core.student_yaml import FILE_BYTES, StudentFileError, load, read

_REFUSED = re.compile(
    r"parse params file: '--params-file (?P<file>[^']{1,300})'\. Error: (?P<what>.{0,400}?)"
    r"(?: at line (?P<line>\d+))?(?:, at /|\s*$)",
    re.MULTILINE,
)
"""What rcl says of a parameter file that it cannot read."""
_ABOVE = (
    "Below a node's name stands `ros__parameters:`, with two underscores, and below that, indented further, the names "
    "of the parameters with their values, without dashes."
)
_WHOLE = (
    "The key is the node's full name, such as `/car/front_demo:`; of keys that stand below one another each is a part "
    "of it."
)
_IN_WORDS = {
    "value before ros__parameters": ("has a value there that is no `name: value` below `ros__parameters:`", _ABOVE),
    "aliasing": ("has an anchor (`&`) or an alias (`*`), which ROS 2 does not read", "Write the values out."),
    "repeated forward slash": ("has keys that together make `{what}`, which is no node's name", _WHOLE),
    "node name must not be empty": ("has a key that ends with a slash", _WHOLE),
}
"""By rcl's words: what is wrong, and what to do."""


def unreadable(words: Sequence[str], folder: Path) -> StudentFileError | None:
    """Why a program cannot start with these words: the first of its parameter files that is no YAML at all.

    The program itself would only end with the parser's own words. What it might read after all is not decided here.
    """
    for option, file in itertools.pairwise(words):
        if option == "--params-file" and (folder / file).is_file():
            try:
                read(folder / file)
            except StudentFileError as error:
                if error.code == "not-yaml" and not error.elsewhere:
                    return error
    return None


def text_of(folder: Path, file: str) -> str:
    """A parameter file's text; empty where there is none that a program could read as one."""
    try:
        with (folder / file).open("rb") as opened:
            return opened.read(FILE_BYTES).decode("utf-8", "replace")
    except OSError:
        return ""


def node_keys(text: str) -> list[str]:
    """The node names that the file's values are for, as full names; wildcards are kept. Empty if it is no such file."""
    return [node for node, _ in _sections(text)]


def names_for(text: str, node: str) -> list[str]:
    """The names of the parameters that the file has values for, as far as they are for this node."""
    return [
        str(name)
        for key, values in _sections(text)
        if is_for(key, node) and isinstance(values, dict)
        for name in values
    ]


def _sections(text: str) -> list[tuple[str, Any]]:
    """Each `ros__parameters` of a file: the full name of the node that it is for, and what stands below it."""
    try:
        content = load(text)
    except StudentFileError:
        return []
    found: list[tuple[str, Any]] = []

    def walk(part: Any, path: str, depth: int) -> None:
        for key, below in part.items() if isinstance(part, dict) and depth <= 10 else ():
            if key == "ros__parameters":
                found.append((path or "/", below))
            else:
                walk(below, f"{path}/{str(key).strip('/')}", depth + 1)

    walk(content, "", 0)
    return found


def why_refused(error: str, folder: Path) -> tuple[str, str, str] | None:
    """Why rcl could not read a parameter file, by what a program printed: a sentence, a short word, what to do."""
    match = _REFUSED.search(error)
    if match is None or not (folder / match["file"]).is_file():
        return None
    at = f", line {int(match['line']) + 1} of the cell," if match["line"] else ""
    words, hint = next(
        ((ours, what_to_do) for theirs, (ours, what_to_do) in _IN_WORDS.items() if theirs in match["what"]),
        (f"is refused by ROS 2: {match['what']}", "Look at the keys and the indentation there."),
    )
    return f"`{match['file']}`{at} {words.format(what=match['what'].split(' ')[0])}.", "params-file", hint


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
