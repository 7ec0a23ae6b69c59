"""YAML that a student wrote: one safe way to read it, for tables of answers, parameter files and launch files.

What it accepts is what `yaml.safe_load` makes of plain YAML. Every tag beyond the plain types, and everything too large
or too deep is refused, where what an alias stands for counts as if it were written out; and whatever is wrong with a
text becomes one `Refused`, whose sentence and place name the line as the notebook shows it. In a table of answers a
line that stands twice is no reason to refuse the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from autograder.reasons import Group, Kind, Refused

NOT_YAML = Kind(
    "not-yaml", "the file is not YAML, or is a list or one text where lines `name: value` belong", Group.FILES
)
YAML_REFUSED = Kind(
    "yaml-refused",
    "the YAML uses an anchor, a tag, a repeated key, or too many or too deeply nested values",
    Group.FILES,
)
FILE_MISSING = Kind("file-missing", "no cell has written this file", Group.FILES)
FILE_TOO_LARGE = Kind("file-too-large", "the file is larger than an answer cell may be", Group.FILES)

FILE_BYTES = 64 * 1024
"""The largest file that is read, in bytes of UTF-8: as large as an answer cell may be."""
DEPTH = 40
"""Lists and mappings that may stand inside one another."""
VALUES = 5000
"""Values, keys included, that one file may have."""
NUMBER_LENGTH = 60
"""Characters of a number: many more than any number of ROS needs."""

_PREFIX = "tag:yaml.org,2002:"
_KINDS = {
    "bool": "`true` or `false`",
    "int": "a whole number",
    "float": "a number",
    "null": "an empty value",
    "timestamp": "a date",
}
_PLAIN_TAGS = {_PREFIX + kind for kind in ("str", "bool", "int", "float", "null", "seq", "map")}
# PyYAML's own words for what students run into most, and the same in theirs.
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
    "expected '<document start>'": "the lines above are a whole value already, to which this does not belong",
    "found unexpected document separator": "`---` stands inside a value",
    "second occurrence": "two anchors have this name. Give this one another",
    "undefined alias": "no anchor of this name stands above it",
    "for merging": "`<<` takes a mapping, such as `*name`",
    "special characters are not allowed": "a character that cannot be printed is not allowed",
}


class RefusedHere(Refused):
    """What PyYAML does not take for YAML, and ROS 2 may, which reads with libyaml: a tab between words, for example."""


@dataclass(frozen=True)
class Twice:
    """In a table, the value of a key that stands there more than once."""

    lines: tuple[int, int]
    """The first two of them, as the notebook counts them in the cell."""

    def __str__(self) -> str:
        """What is wrong, as the end of a sentence about the key."""
        return "stands there twice, in lines {} and {} of the cell".format(*self.lines)


class Written(dict[Any, Any]):
    """A mapping that also knows the text of each value that is a plain one: `010`, where YAML makes 8 of it."""

    written: dict[Any, str]


def cell_line(index: int, text: str) -> int:
    """Return the line of a cell at which a character of its file stands: the magic above the file is line 1."""
    return text.count("\n", 0, index) + 2


def load(text: str, name: str = "the file", table: bool = False, written: bool = False) -> Any:
    """Read a YAML text.

    Args:
        text: what stands below the cell's first line.
        name: what the sentence of an error calls it.
        table: whether it is a table of answers, in which the value of a key that stands there twice is a `Twice`.
        written: whether each mapping is a `Written`.

    Raises:
        Refused: it is not YAML, or not plain enough. Nothing else is ever raised.
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
        # Of what is never closed, and of a key without its colon, the beginning helps: the end is noticed lines later.
        begun = "end of stream" in problem or "could not find expected ':'" in problem
        mark = (error.context_mark if begun else None) or error.problem_mark or error.context_mark
        wrong = _error(text, name, mark.index if mark else None, f" is not YAML: {_in_plain_words(problem)}")
        if mark is not None and _taken_elsewhere(text, mark.index, problem):
            raise RefusedHere(wrong.reason, wrong.place) from None
        raise wrong from None
    except yaml.reader.ReaderError as error:
        raise _error(text, name, error.position, f" is not YAML: {_in_plain_words(error.reason)}") from None
    except Exception:  # PyYAML lets through whatever int(), float() and its own slips raise
        raise _error(text, name, None, " is not YAML: it cannot be read") from None


def read(path: Path, table: bool = False, written: bool = False) -> Any:
    """Read a student's YAML file; for `table` and `written` see `load`.

    Raises:
        Refused: it is missing, is no text, or `load` refuses it.
    """
    name = f"`{path.name}`"
    try:
        with path.open("rb") as file:
            content = file.read(FILE_BYTES + 1)
    except OSError:
        because = f"No cell that begins with `%%file {path.name}` was found."
        hint = "Check the first line of the cell; it must stand there unchanged."
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
    """Whether ROS 2, which reads parameter files with libyaml, may take what PyYAML does not: a tab that is no
    indentation, a second document, an anchor's name that stands twice."""
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
    """Something that is refused here though YAML has it; where it stands."""

    def __init__(self, mark: Any, because: str) -> None:
        super().__init__(because)
        self.index: int = mark.index


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader for plain YAML; it refuses while it reads, before anything can grow."""

    def __init__(self, text: str, table: bool, written: bool) -> None:
        super().__init__(text)
        self._text, self._table, self._written = text, table, written
        self._depth = self._values = 0
        self._open: set[str] = set()  # anchors whose value is still being read

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in self._open:
                raise _RefusedError(event.start_mark, f"`*{event.anchor[:40]}` stands inside what it is to repeat")
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
            raise _RefusedError(mark, f"more than {DEPTH} lists and mappings stand inside one another")

    def _written_out(self, node: yaml.Node | None, mark: Any, depth: int) -> yaml.Node | None:
        """A copy of what an alias stands for, all of whose values count: a short text stays as small as it looks."""
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
        """The mapping, whose keys must be plain and differ: of two equal ones the first would be lost."""
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
                    f"the key `{key_node.value[:40]}` stands a second time; it is also in line {line}",
                )
            first[key] = key_node
        return {**super().construct_mapping(node, deep), **twice}

    def make_mapping(self, node: yaml.MappingNode) -> Iterator[dict[Any, Any]]:
        """The mapping, filled when all of it is known, as PyYAML makes each."""
        made: dict[Any, Any] = Written() if self._written else {}
        yield made
        made.update(self.construct_mapping(node))
        if isinstance(made, Written):
            plain = [(key, value) for key, value in node.value if isinstance(value, yaml.ScalarNode)]
            made.written = {self.construct_object(key): value.value for key, value in plain}


_Loader.add_constructor(_PREFIX + "map", _Loader.make_mapping)
