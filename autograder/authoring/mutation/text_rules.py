"""Changes of the other answers: tables, parameter and launch files, command lines, and the set-up files of packages."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import yaml

from autograder.authoring.mutation.ros_rules import other_names

_LEAF = re.compile(r"^(\s*(?:- )?)([\w/*~.$()'\"-]+):[ ]+(?![>|])(.+?)\s*$")
_RULE = re.compile(r"-([rp])\s+(\S+?):=(\S*)")


def text_changes(text: str) -> Iterator[tuple[str, str]]:
    """Every change of a YAML answer: the rule and the new text. What is not YAML any more is left out."""
    seen = {repr(_load(text))}
    for rule, changed in _all(text):
        value = _load(changed)
        if value is not None and repr(value) not in seen:
            seen.add(repr(value))
            yield rule, changed


def without_a_line(text: str) -> Iterator[str]:
    """The text without one of its lines, each in turn, but for lines that are empty or only close something."""
    rows = text.split("\n")
    for number, row in enumerate(rows):
        if re.search(r"\w", row) and not row.strip().startswith(("#", "</")):
            yield "\n".join(rows[:number] + rows[number + 1 :])


def _load(text: str) -> object:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return None


def _all(text: str) -> Iterator[tuple[str, str]]:
    rows = text.split("\n")
    for number, row in enumerate(rows):
        match = _LEAF.match(row)
        if match is None:
            continue
        yield "dropped line", "\n".join(rows[:number] + rows[number + 1 :])
        if ":=" not in match[3]:
            for rule, value in _values(match[3]):
                yield rule, "\n".join([*rows[:number], f"{match[1]}{match[2]}: {value}", *rows[number + 1 :]])
    yield from _words(text)


def _values(value: str) -> Iterator[tuple[str, str]]:
    meant = _load(value)
    if isinstance(meant, bool):
        yield "value", "no" if meant else "yes"
    elif isinstance(meant, int):
        yield "value", str(meant + 1)
        yield "type", f'"{meant}"'
    elif isinstance(meant, float):
        yield "value", str(meant * 3)
    elif isinstance(meant, list) and meant:
        yield "value", f"[{', '.join(map(str, meant[1:] + meant[:1]))}]"
    elif isinstance(meant, str):
        yield "value", f"{meant}x" if "$(" not in meant else f'"x{meant}"'
        if re.fullmatch(r"[~/\w]+", meant) and "/" in meant:
            for other in other_names(meant):
                yield "name", other


def _words(text: str) -> Iterator[tuple[str, str]]:
    """Remap and parameter rules inside a command line: left out, or with another left or right side."""
    for match in _RULE.finditer(text):
        start, end = match.span()
        yield "dropped rule", re.sub(r" +\n", "\n", f"{text[:start]}{text[end:].lstrip(' ')}")
        if match[1] == "p":
            yield "parameter rule", f"{text[:start]}-p {match[2]}x:={match[3]}{text[end:]}"
            continue
        for left in (*other_names(match[2]),) if "__" not in match[2] else (match[2].replace("__", "__x"),):
            yield "left side", f"{text[:start]}-r {left}:={match[3]}{text[end:]}"
        for right in other_names(match[3]):
            yield "right side", f"{text[:start]}-r {match[2]}:={right}{text[end:]}"
    rules = list(_RULE.finditer(text))
    for one, two in pairwise(rules):
        if text[one.end() : two.start()].strip() == "":
            between = text[one.end() : two.start()]
            yield "order", text[: one.start()] + two.group() + between + one.group() + text[two.end() :]
