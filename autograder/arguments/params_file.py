"""Finds the nodes to which a parameter file applies. Its keys are matched as rcl matches them."""

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
"""The error message of rcl about a parameter file that it cannot read."""
_ABOVE = (
    "Write `ros__parameters:`, with two underscores, below a node's name. Below that, indented further, write the "
    "names of the parameters with their values, without dashes."
)
_WHOLE = (
    "The key is the node's full name, such as `/car/front_demo:`. If keys are nested, each of them is a part of that "
    "name."
)
_IN_WORDS = {
    "value before ros__parameters": ("has a value there that is not a `name: value` below `ros__parameters:`", _ABOVE),
    "aliasing": ("has an anchor (`&`) or an alias (`*`), which ROS 2 does not read", "Write the values out."),
    "repeated forward slash": ("has keys that together make `{what}`, which is not a node name", _WHOLE),
    "node name must not be empty": ("has a key that ends with a slash", _WHOLE),
}
"""For the words in rcl's message: what is wrong, and what the student can do."""


def unreadable(words: Sequence[str], folder: Path) -> Refused | None:
    """Return why a program cannot start with this command line: its first parameter file that is not YAML.

    The program itself would only end with the parser's message. Files that a program may be able to read are not
    refused here.
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
    """Return the text of a parameter file, or an empty text if a program cannot read such a file."""
    try:
        with (folder / file).open("rb") as opened:
            return opened.read(FILE_BYTES).decode("utf-8", "replace")
    except OSError:
        return ""


def node_keys(text: str) -> list[str]:
    """Return the full names of the nodes that the file has values for, with wildcards as they are.

    The list is empty if the text is not a parameter file.
    """
    return [node for node, _ in _sections(text)]


def names_for(text: str, node: str) -> list[str]:
    """Return the names of the parameters for which the file has values for this node."""
    return [str(name) for key, values in _sections(text) if is_for(key, node) for name in values]


def _sections(text: str) -> list[tuple[str, list[str]]]:
    """Return, for each `ros__parameters` of a file, the full name of its node and the names of the parameters below it.

    The file is read as rcl reads it: several documents, duplicate keys, anchors and tags are accepted. rcl refuses a
    file with an alias, so the list is empty for such a file.
    """
    found: list[tuple[str, list[str]]] = []
    path: list[str | None] = []  # for each open mapping: the key whose value is being read
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
    """Return why rcl could not read a parameter file, according to what the program printed."""
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
    """Whether values below this key apply to the node with this full name.

    `*` stands for one part of a name, and `**` for any number of parts.
    """
    names = node.strip("/").split("/")
    reached = {0}  # how many parts of the node's name the parts of the key read so far can match
    for part in key.strip("/").split("/"):
        if part == "**":
            reached = set(range(min(reached), len(names) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(names) and part in ("*", names[at])}
        if not reached:
            return False
    return len(names) in reached


def why_not_reached(text: str, node: str) -> str | None:
    """Return why the values of a parameter file do not apply to a node; None if they do, or if the file has none."""
    keys = node_keys(text)
    if not keys or any(is_for(key, node) for key in keys):
        return None
    written = ", ".join(f"`{key[:60]}`" for key in keys[:4]) + (", …" if len(keys) > 4 else "")
    return f"The file has values for {written}, and the node is `{node}`: it gets none, and ROS 2 does not warn."
