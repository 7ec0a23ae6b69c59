"""A solution's source as text with positions: replacing one piece of it leaves every other character as it is."""

from __future__ import annotations

import ast
from dataclasses import dataclass


@dataclass(frozen=True)
class Change:
    """One piece of the source and what takes its place."""

    start: int
    """Offset in bytes of UTF-8."""
    end: int
    text: str
    rule: str


@dataclass(frozen=True)
class Mutant:
    """A solution with one change."""

    answer: str
    """grade_id of the answer cell."""
    rule: str
    before: str
    """The changed line, without its indentation."""
    after: str
    source: str
    """The whole answer as it would be handed in."""

    @property
    def key(self) -> str:
        """The same words for the same change as long as the line stays as it is."""
        return f"{self.answer}: {self.rule}: {self.before} => {self.after}"


class Source:
    """A Python source and the places of its nodes."""

    def __init__(self, text: str) -> None:
        """Remember where each line begins."""
        self.text = text
        self.data = text.encode()
        self._lines = [0]
        for line in self.data.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))

    def start(self, node: ast.expr | ast.stmt | ast.keyword) -> int:
        """Offset of a node's first byte; of a decorated function's decorator."""
        decorators = getattr(node, "decorator_list", [])
        if decorators:
            return self.start(decorators[0]) - 1
        return self._lines[node.lineno - 1] + node.col_offset

    def end(self, node: ast.expr | ast.stmt | ast.keyword) -> int:
        """Offset behind a node's last byte."""
        return self._lines[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)

    def of(self, node: ast.expr | ast.stmt | ast.keyword) -> str:
        """A node's own text."""
        return self.data[self.start(node) : self.end(node)].decode()

    def with_change(self, change: Change) -> str:
        """The text with one piece replaced."""
        return (self.data[: change.start] + change.text.encode() + self.data[change.end :]).decode()

    def argument(self, call: ast.Call, node: ast.expr | ast.keyword) -> tuple[int, int]:
        """The place of an argument together with the comma that parts it from the others."""
        start, end = self.start(node), self.end(node)
        after = self.data[end : self.end(call)]
        rest = after.lstrip()
        if rest.startswith(b","):
            end += len(after) - len(rest) + 1
            end += len(self.data[end:]) - len(self.data[end:].lstrip(b" \n"))
            return start, end
        before = self.data[:start].rstrip()
        return (len(before) - 1 if before.endswith(b",") else start), end
