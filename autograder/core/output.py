"""What a program printed, as text that a report can show."""

from __future__ import annotations

import re

_ESCAPES = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)?|[@-Z\\-_])")
_DIRECTIONS = (0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
"""Invisible marks that turn the direction of the text around them, that of a table's other cells included."""
_CONTROL = dict.fromkeys((*range(9), *range(11, 32), *range(127, 160), *_DIRECTIONS), "�")


def plain(text: str) -> str:
    """Take out a terminal's escapes, and make visible what would change how the text around it is shown."""
    return _ESCAPES.sub("", text.replace("\r\n", "\n")).translate(_CONTROL)


def tidy(output: str) -> str:
    """Take out colours and other escapes of a terminal; of a line that was written over, the last text stays."""
    lines = _ESCAPES.sub("", output.replace("\r\n", "\n")).split("\n")
    return "\n".join(line.rstrip("\r").rpartition("\r")[2] for line in lines).translate(_CONTROL)


def last_lines(output: str, count: int) -> str:
    """Return the last lines of an output, with a mark where others were left out."""
    lines = tidy(output).strip("\n").split("\n")
    left_out = len(lines) - count
    mark = f"[{left_out} line{'s' * (left_out != 1)} above]"
    return "\n".join([mark, *lines[-count:]] if left_out > 0 else lines)
