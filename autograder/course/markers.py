"""The marks in a lab's source: what students do not receive stands between `BEGIN …` and `END …`, as in nbgrader."""

from __future__ import annotations

import re
from collections.abc import Sequence

MORE_AT_GRADING = "# More is checked here when the lab is graded."
"""The line that stands in a released check cell where hidden tests were taken out."""

MARK = re.compile(r"\b(BEGIN|END) (SOLUTION|HIDDEN TESTS|MARK SCHEME)\b")
"""Each of the marks: which end of a region, and of which."""

_HIDDEN = "HIDDEN TESTS"


def without_region(source: str, mark: str, stub: str | None = None) -> str:
    """Drop the lines between `BEGIN mark` and `END mark`, or put a stub in their place, as nbgrader does."""
    lines: list[str] = []
    inside = False
    for line in source.split("\n"):
        if f"BEGIN {mark}" in line:
            inside = True
            if stub is not None:
                lines.append(re.match(r"\s*", line).group() + stub)  # type: ignore[union-attr]
        elif f"END {mark}" in line:
            inside = False
        elif not inside:
            lines.append(line)
    return "\n".join(lines)


def without_hidden_tests(source: str) -> str:
    """Return a check cell as students receive it: a line says where more is checked at grading."""
    return without_region(source, _HIDDEN, MORE_AT_GRADING)


def hidden_lines(lines: Sequence[str]) -> set[int]:
    """Return the numbers of the lines that are hidden from students, counted from 1."""
    hidden, inside = set(), False
    for number, line in enumerate(lines, start=1):
        inside = (inside or f"BEGIN {_HIDDEN}" in line) and f"END {_HIDDEN}" not in line
        if inside:
            hidden.add(number)
    return hidden
