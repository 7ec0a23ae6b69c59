"""Read YAML that a student wrote, safely: tables of answers, parameter files and launch files.

The values are those that `yaml.safe_load` returns for plain YAML. Tags other than the plain types are refused, and so
is a text that is too large or too deeply nested; an alias counts as if its value were written out. Every fault becomes
one `Refused`, whose sentence and place give the line as the notebook shows it. In a table of answers, a line that
appears twice does not make the other lines invalid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from autograder.reasons import Group, Kind, Refused

NOT_YAML = Kind(
    "not-yaml", "the file is not YAML, or is a list or a single text instead of lines `name: value`", Group.FILES
)
YAML_REFUSED = Kind(
    "yaml-refused",
    "the YAML uses an anchor, a tag, a repeated key, or too many or too deeply nested values",
    Group.FILES,
)
FILE_MISSING = Kind("file-missing", "no cell has written this file", Group.FILES)
FILE_TOO_LARGE = Kind("file-too-large", "the file is larger than an answer cell may be", Group.FILES)

FILE_BYTES = 64 * 1024
"""The size of the largest file that is read, in bytes of UTF-8. It is also the limit for an answer cell."""
DEPTH = 40
"""The deepest nesting of lists and mappings that is allowed."""
VALUES = 5000
"""The number of values, including keys, that one file may have."""
NUMBER_LENGTH = 60
"""The number of characters that a number may have; no number in ROS needs as many."""

_PREFIX = "tag:yaml.org,2002:"
_KINDS = {
    "bool": "`true` or `false`",
    "int": "a whole number",
    "float": "a number",
    "null": "an empty value",
    "timestamp": "a date",
}
_PLAIN_TAGS = {_PREFIX + kind for kind in ("str", "bool", "int", "float", "null", "seq", "map")}
# PyYAML's messages for the most common faults, and what students read instead.
_PROBLEMS = {
    "mapping values are not allowed": "a `:` is not expected there. Check the indentation of this line and the colon of"
    " the line above, or put a text that holds a colon in quotes",
    "found character '\\t'": "a tab is not expected there. Use spaces instead",
    "mapping keys are not allowed": "a `?` is not expected there. Write the value in its place",
    "that cannot start any token": "a value cannot begin with this character. Put it in quotes",
    "could not find expected ':'": "a `key: value` is expected there, with a colon and a space after the key",
    "expected <block end>": "the line is indented differently from the lines it belongs to",
    "found unexpected end of stream": "a quotation mark is opened and never closed",
    "expected the node content": "a value is expected there; perhaps a bracket above is not closed",
    "expected ',' or": "a bracket is not closed, or a comma is missing",
    "found another document": "a second document begins there. Leave out the line `---`",
    "expected '<document start>'": "the lines above are already a complete value, so this line cannot follow them",
    "found unexpected document separator": "`---` is inside a value",
    "second occurrence": "two anchors have this name. Give this one another",
    "undefined alias": "no anchor with this name is defined above it",
    "for merging": "`<<` takes a mapping, such as `*name`",
    "special characters are not allowed": "a character that cannot be printed is not allowed",
}


class RefusedHere(Refused):
    """A text that PyYAML refuses but that ROS 2, which uses libyaml, may accept: a tab between words, for example."""


@dataclass(frozen=True)
class Twice:
    """The value that a table gets for a key that appears in it more than once."""

    lines: tuple[int, int]
    """The first two lines with the key, as the notebook numbers the lines of the cell."""

    def __str__(self) -> str:
        """Say what the fault is, as the end of a sentence about the key."""
        return "appears twice, in lines {} and {} of the cell".format(*self.lines)


class Written(dict[Any, Any]):
    """A mapping that also holds the text of each plain value, such as `010`, which YAML reads as 8."""

    written: dict[Any, str]


def cell_line(index: int, text: str) -> int:
    """Return the cell's line number for a position in its file. The magic above the file is line 1 of the cell."""
    return text.count("\n", 0, index) + 2


def load(text: str, name: str = "the file", table: bool = False, written: bool = False) -> Any:
    """Read a YAML text.

    Args:
        text: the text below the cell's first line.
        name: the name of the text in error messages.
        table: whether this is a table of answers. A key that appears twice in it gets a `Twice` as its value.
        written: whether each mapping is returned as a `Written`.

    Raises:
        Refused: the text is not YAML, or uses more than plain YAML. Nothing else is ever raised.
    """
    if len(text) > FILE_BYTES or len(text.encode("utf-8", "replace")) > FILE_BYTES:
        raise Refused(FILE_TOO_LARGE(f"{name} is larger than {FILE_BYTES // 1024} KiB."))
    try:
        loader = _Loader(text, table, written)
        try:
            return loader.get_single_data()
        finally:
            loader.dispose()
    except _RefusedError as refused:
        raise _error(text, name, refused.index, f": {refused}", YAML_REFUSED) from None
    except yaml.MarkedYAMLError as error:
        problem = error.problem or error.context or ""
        # If a quotation mark is not closed or a colon is missing, show where it begins: PyYAML notices it lines later.
        begun = "end of stream" in problem or "could not find expected ':'" in problem
        mark = (error.context_mark if begun else None) or error.problem_mark or error.context_mark
        wrong = _error(text, name, mark.index if mark else None, f" is not YAML: {_in_plain_words(problem)}")
        if mark is not None and _taken_elsewhere(text, mark.index, problem):
            raise RefusedHere(wrong.reason, wrong.place) from None
        raise wrong from None
    except yaml.reader.ReaderError as error:
        raise _error(text, name, error.position, f" is not YAML: {_in_plain_words(error.reason)}") from None
    except Exception:  # PyYAML does not catch the errors of int() and float(), nor those of its own defects
        raise _error(text, name, None, " is not YAML: it cannot be read") from None


def read(path: Path, table: bool = False, written: bool = False) -> Any:
    """Read a student's YAML file; for `table` and `written` see `load`.

    Raises:
        Refused: the file is missing, is not text, or is refused by `load`.
    """
    name = f"`{path.name}`"
    try:
        with path.open("rb") as file:
            content = file.read(FILE_BYTES + 1)
    except OSError:
        because = f"No cell that begins with `%%file {path.name}` was found."
        hint = "Check the first line of the cell, which must not be changed."
        raise Refused(FILE_MISSING(because, hint)) from None
    try:
        text = content.decode("utf-8", "strict" if len(content) <= FILE_BYTES else "replace")
        return load(text, name, table, written)
    except UnicodeDecodeError:
        raise Refused(NOT_YAML(f"{name} is not text in UTF-8.")) from None


def _error(text: str, name: str, index: int | None, what: str, kind: Kind = NOT_YAML) -> Refused:
    place = "" if index is None else f"line {cell_line(index, text)} of the cell"
    return Refused(kind(f"{name}{', ' * bool(place)}{place}{what}."), place)


def _taken_elsewhere(text: str, index: int, problem: str) -> bool:
    """Return whether ROS 2, which reads parameter files with libyaml, may accept what PyYAML refuses.

    This is so for a tab that is not indentation, a second document, and an anchor that is defined twice.
    """
    if "second occurrence" in problem:
        return True
    begin = text.rfind("\n", 0, index) + 1
    return "found another document" in problem or ("'\\t'" in problem and bool(text[begin:index].strip()))


def _in_plain_words(problem: str) -> str:
    for theirs, ours in _PROBLEMS.items():
        if theirs in problem:
            return ours
    return problem[:200] or "it cannot be read"


class _RefusedError(Exception):
    """A part of YAML that is not allowed here, and its position."""

    def __init__(self, mark: Any, because: str) -> None:
        super().__init__(because)
        self.index: int = mark.index


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, limited to plain YAML. It refuses a text while it reads, before it uses much memory."""

    def __init__(self, text: str, table: bool, written: bool) -> None:
        super().__init__(text)
        self._text, self._table, self._written = text, table, written
        self._depth = self._values = 0
        self._open: set[str] = set()  # the anchors whose value is still being read

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in self._open:
                raise _RefusedError(event.start_mark, f"`*{event.anchor[:40]}` is inside the value that it repeats")
            return self._written_out(super().compose_node(parent, index), event.start_mark, self._depth)
        if getattr(event, "tag", None) not in (None, "!", *_PLAIN_TAGS):
            tag = event.tag.replace(_PREFIX, "!!")[:40]
            raise _RefusedError(event.start_mark, f"the type `{tag}` is not allowed; leave it out")
        self._count(event.start_mark, self._depth)
        self._depth += 1
        self._open |= {event.anchor} - {None}
        node = super().compose_node(parent, index)
        self._open -= {event.anchor}
        self._depth -= 1
        return node

    def _count(self, mark: Any, depth: int) -> None:
        self._values += 1
        if self._values > VALUES:
            raise _RefusedError(mark, f"the file has more than {VALUES} values")
        if depth >= DEPTH:
            raise _RefusedError(mark, f"lists and mappings are nested more than {DEPTH} levels deep")

    def _written_out(self, node: yaml.Node | None, mark: Any, depth: int) -> yaml.Node | None:
        """Return a copy of an alias's value and count all of its values, so that a short text cannot become large."""
        self._count(mark, depth)
        if isinstance(node, yaml.SequenceNode):
            items: list[Any] = [self._written_out(item, mark, depth + 1) for item in node.value]
        elif isinstance(node, yaml.MappingNode):
            items = [tuple(self._written_out(end, mark, depth + 1) for end in pair) for pair in node.value]
        else:
            return node
        return type(node)(node.tag, items, node.start_mark, node.end_mark, node.flow_style)

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        if not isinstance(node, yaml.ScalarNode):
            return super().construct_object(node, deep)
        kind = node.tag.removeprefix(_PREFIX)
        shown = f"`{node.value[:40]}{'…' if len(node.value) > 40 else ''}`"
        if kind in ("int", "float") and len(node.value) > NUMBER_LENGTH:
            raise _RefusedError(node.start_mark, f"the number {shown} is longer than {NUMBER_LENGTH} characters")
        try:
            return super().construct_object(node, deep)
        except Exception:
            what = _KINDS.get(kind, "a plain value")
            because = f"{shown} is not {what}; if a text is meant, put it in quotes"
            raise _RefusedError(node.start_mark, because) from None

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return the mapping. Its keys must be plain and different, because of two equal keys one would be lost."""
        if not isinstance(node, yaml.MappingNode):
            raise _RefusedError(node.start_mark, "`key: value` lines are expected there")
        first: dict[Any, yaml.Node] = {}
        twice: dict[Any, Twice] = {}
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise _RefusedError(key_node.start_mark, "a key is a plain word, not a list or a mapping")
            if key_node.tag == _PREFIX + "merge":
                continue
            key = self.construct_object(key_node)
            if key in first:
                line = cell_line(first[key].start_mark.index, self._text)
                if self._table:
                    twice.setdefault(key, Twice((line, cell_line(key_node.start_mark.index, self._text))))
                    continue
                raise _RefusedError(
                    key_node.start_mark,
                    f"the key `{key_node.value[:40]}` appears a second time; it is also in line {line}",
                )
            first[key] = key_node
        return {**super().construct_mapping(node, deep), **twice}

    def make_mapping(self, node: yaml.MappingNode) -> Iterator[dict[Any, Any]]:
        """Yield an empty mapping and fill it afterwards, as PyYAML's own constructors do."""
        made: dict[Any, Any] = Written() if self._written else {}
        yield made
        made.update(self.construct_mapping(node))
        if isinstance(made, Written):
            plain = [(key, value) for key, value in node.value if isinstance(value, yaml.ScalarNode)]
            made.written = {self.construct_object(key): value.value for key, value in plain}


_Loader.add_constructor(_PREFIX + "map", _Loader.make_mapping)
