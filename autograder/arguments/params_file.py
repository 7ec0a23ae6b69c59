"""Which nodes a parameter file is for: its keys, matched as rcl matches them."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import yaml

from autograder.arguments.remap_rules import LIBYAML
from autograder.core.student_yaml import DEPTH, FILE_BYTES, NOT_YAML, RefusedHere, read
from autograder.reasons import Group, Kind, Reason, Refused

PARAMS_FILE = Kind("params-file", "the parameter file cannot be read as one", Group.FILES)

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


def unreadable(words: Sequence[str], folder: Path) -> Refused | None:
    """Why a program cannot start with these words: the first of its parameter files that is no YAML at all.

    The program itself would only end with the parser's own words. What it might read after all is not decided here.
    """
    for option, file in itertools.pairwise(words):
        if option == "--params-file" and (folder / file).is_file():
            try:
                read(folder / file)
            except Refused as error:
                if error.reason.kind is NOT_YAML and not isinstance(error, RefusedHere):
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
    return [str(name) for key, values in _sections(text) if is_for(key, node) for name in values]


def _sections(text: str) -> list[tuple[str, list[str]]]:
    """Each `ros__parameters` of a file: the full name of the node that it is for, and the names below it.

    Read as rcl reads it: several documents, keys that stand twice, anchors and tags are all the same to it. It refuses
    a file with an alias, and then there are none.
    """
    found: list[tuple[str, list[str]]] = []
    path: list[str | None] = []  # for each collection that is open: the key in it that is being read
    lists = 0

    def end_value() -> None:
        if path:
            path[-1] = None

    try:
        for event in yaml.parse(text, Loader=LIBYAML):
            match event:
                case yaml.AliasEvent():
                    return []
                case yaml.MappingStartEvent() if not lists:
                    if path and path[-1] == "ros__parameters":
                        parts = [part.strip("/") for part in path[:-1] if part]
                        found.append(("/" + "/".join(parts), []))
                    path.append(None)
                case yaml.MappingEndEvent() if not lists:
                    path.pop()
                    end_value()
                case yaml.SequenceStartEvent():
                    lists += 1
                case yaml.SequenceEndEvent():
                    lists -= 1
                    if not lists:
                        end_value()
                case yaml.ScalarEvent() if not lists and path:
                    if path[-1] is not None:
                        end_value()
                        continue
                    path[-1] = event.value
                    if path[-2:-1] == ["ros__parameters"] and found:
                        found[-1][1].append(event.value)
            if len(path) > DEPTH:
                return []
    except (yaml.YAMLError, RecursionError):
        return []
    return found


def why_refused(error: str, folder: Path) -> Reason | None:
    """Why rcl could not read a parameter file, by what a program printed."""
    match = _REFUSED.search(error)
    if match is None or not (folder / match["file"]).is_file():
        return None
    at = f", line {int(match['line']) + 1} of the cell," if match["line"] else ""
    words, hint = next(
        ((ours, what_to_do) for theirs, (ours, what_to_do) in _IN_WORDS.items() if theirs in match["what"]),
        (f"is refused by ROS 2: {match['what']}", "Look at the keys and the indentation there."),
    )
    return PARAMS_FILE(f"`{match['file']}`{at} {words.format(what=match['what'].split(' ')[0])}.", hint)


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
