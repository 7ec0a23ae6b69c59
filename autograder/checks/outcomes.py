"""How a check records what it found, and how a failure ends the rest of its `with` block."""

from __future__ import annotations

import ast
import linecache
import sys
from pathlib import Path
from types import FrameType
from typing import NoReturn

from autograder.checks import session
from autograder.results import Outcome, Status

_PACKAGE = str(Path(__file__).resolve().parent.parent)
_BEGIN, _END = "### BEGIN HIDDEN TESTS", "### END HIDDEN TESTS"


class CheckEnded(Exception):
    """A failed outcome was recorded; the rest of the `with` block is not checked. Never leaves the block."""


def passed(title: str, *, expected: str = "", observed: str = "") -> None:
    """Record that an expectation holds."""
    _record(Outcome(status=Status.PASSED, title=title, expected=expected, observed=observed))


def failed(
    title: str, *, expected: str = "", observed: str = "", because: str = "", hint: str = "", code: str = ""
) -> NoReturn:
    """Record that an expectation does not hold, and end the block.

    Raises:
        CheckEnded: always.
    """
    _record(_failure(title, expected, observed, because, hint, code))
    _rest_not_checked()
    raise CheckEnded(title)


def failed_as_a_whole(
    first: int, title: str, *, expected: str = "", observed: str = "", because: str = "", hint: str = "", code: str = ""
) -> NoReturn:
    """As `failed`, in place of all that was found out since outcome number `first`: it is worth nothing any more.

    Raises:
        CheckEnded: always.
    """
    del session.current.outcomes[first:]
    _record(_failure(title, expected, observed, because, hint, code))
    _rest_not_checked(whole=True)
    raise CheckEnded(title)


def _failure(title: str, expected: str, observed: str, because: str, hint: str, code: str) -> Outcome:
    return Outcome(
        status=Status.FAILED,
        title=title,
        expected=expected,
        observed=observed,
        because=because,
        hint=hint,
        code=code or "failed",
    )


def unknown(title: str, because: str) -> None:
    """Record that the grader could not find out.

    In a cell with hidden tests the text is for instructors only: it may quote a line or a value of them.
    """
    frame = _check_frame()
    hidden = frame is not None and bool(_hidden_lines(frame))
    _record(Outcome(status=Status.UNKNOWN, title=title, because=because, code="grader", hidden=hidden))


def _record(outcome: Outcome) -> None:
    frame = _check_frame()
    # A cell's own helper function records for the line that called it: hidden there is hidden here.
    while frame is not None and not outcome.hidden:
        outcome.hidden = frame.f_lineno in _hidden_lines(frame)
        frame = frame.f_back if frame.f_code.co_name != "<module>" else None
    session.current.outcomes.append(outcome)


def _check_frame() -> FrameType | None:
    """The frame of the check cell: the nearest caller that is not the kit's or the standard library's."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        filename = frame.f_code.co_filename
        if not filename.startswith((_PACKAGE, sys.base_prefix, "<frozen")):
            return frame
        frame = frame.f_back
    return None


def _lines(frame: FrameType) -> list[str]:
    return linecache.getlines(frame.f_code.co_filename, frame.f_globals)


def _hidden_lines(frame: FrameType) -> set[int]:
    hidden, inside = set(), False
    for number, line in enumerate(_lines(frame), start=1):
        inside = (inside or _BEGIN in line) and _END not in line
        if inside:
            hidden.add(number)
    return hidden


def _block() -> tuple[FrameType | None, ast.With | None]:
    """The check cell's frame, and the `with` block that it is in."""
    frame = _check_frame()
    if frame is None:
        return None, None
    try:
        tree = ast.parse("".join(_lines(frame)))
    except SyntaxError:  # only the shell knows this source (IPython syntax around it): nothing to list
        return frame, None
    blocks = [
        n for n in ast.walk(tree) if isinstance(n, ast.With) and n.lineno <= frame.f_lineno <= (n.end_lineno or 0)
    ]
    return frame, min(blocks, key=lambda node: (node.end_lineno or 0) - node.lineno, default=None)


def _rest_not_checked(whole: bool = False) -> None:
    """Record what the source still wanted to check in the same `with` block, or all that it wanted there."""
    frame, block = _block()
    if frame is None or block is None:
        return
    hidden = _hidden_lines(frame)
    for node in ast.walk(block):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr.startswith("expect")
            and (whole or node.lineno > frame.f_lineno)
        ):
            text = " ".join(ast.unparse(node).split(".", 1)[-1].split())
            session.current.outcomes.append(
                Outcome(
                    status=Status.NOT_CHECKED,
                    title=text if len(text) <= 120 else text[:117] + "...",
                    because="The program ended too early." if whole else "Something before it failed.",
                    hidden=node.lineno in hidden,
                )
            )
