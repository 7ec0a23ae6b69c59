"""Turn a program's output into text that a report can show."""

from __future__ import annotations

import re

_ESCAPES = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)?|[@-Z\\-_])")
_DIRECTIONS = (0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
"""Invisible characters that change the direction of the text around them, even in other cells of a table."""
_CONTROL = dict.fromkeys((*range(9), *range(11, 32), *range(127, 160), *_DIRECTIONS), "�")


def plain(text: str) -> str:
    """Remove terminal escapes, and replace characters that would change how the text around them is shown."""
    return _ESCAPES.sub("", text.replace("\r\n", "\n")).translate(_CONTROL)


def tidy(output: str) -> str:
    """Remove colours and other terminal escapes. If a line was overwritten, keep only its last text."""
    lines = _ESCAPES.sub("", output.replace("\r\n", "\n")).split("\n")
    return "\n".join(line.rstrip("\r").rpartition("\r")[2] for line in lines).translate(_CONTROL)


def last_lines(output: str, count: int) -> str:
    """Return the last lines of an output, with a mark above them if other lines were left out."""
    lines = tidy(output).strip("\n").split("\n")
    left_out = len(lines) - count
    mark = f"[{left_out} line{'s' * (left_out != 1)} above]"
    return "\n".join([mark, *lines[-count:]] if left_out > 0 else lines)
