"""How a check records what it found, and how a failure ends the rest of its `with` block."""

from __future__ import annotations

import ast
import contextlib
import linecache
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

from autograder.checks import current, unusable
from autograder.checks.misuse import place_of
from autograder.core.errors import KitError
from autograder.core.results import Outcome, Picture, Status
from autograder.course.cells import MORE_AT_GRADING, hidden_lines
from autograder.graph.observer import ForgedGraph
from autograder.reasons import Group, Kind, Reason

FAILED = Kind("failed", "an expectation does not hold; nothing more is known", Group.OUTPUT)
GRADER = Kind("grader", "the check itself broke; no points are taken, and an instructor decides", Group.GRADER)
FORGED_GRAPH = Kind(
    "forged-graph",
    "the ROS graph cannot be read; no program that uses only rclpy can cause this",
    Group.GRADER,
)
UNUSABLE_DATA = Kind(
    "unusable-data",
    "the check broke after the programs had sent data that no check can process: a NaN, a stamp below 0 s,"
    " or an extremely long text or list",
    Group.OUTPUT,
)

_PACKAGE = str(Path(__file__).resolve().parent.parent)

_NOT_CELLS = (_PACKAGE, sys.prefix, sys.base_prefix, "<frozen", "<string>")
"""How the names of files begin that are the kit's, an installed package's, the standard library's or generated."""

TEXT_KEPT = 8000
"""Characters of one text in an outcome: some of them quote what a student's program sent."""

_WORTH_QUOTING = 12
"""Characters from which on an observation is a sentence or a list; a shorter one is a value to compare at a glance."""

_USABLE = "The check can go on with what the programs send"

_FORGED = "A program has announced a node or a topic whose name is no text, below ROS, which allows no such name."


class CheckEnded(Exception):
    """A failed outcome was recorded; the rest of the `with` block, or of a cell without one, is not checked."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows where there is no block: the report below the cell says all."""
        return []


class LaunchEnded(CheckEnded):
    """The launch, or the table, failed as a whole: none of its parts is worth anything."""


def ends_block(error: BaseException | None, ran: bool = False) -> bool:
    """What becomes of an exception that leaves a launch, a build or a table: whether Python is to forget it.

    A check that breaks at grading says nothing about the student: the instructor decides. In a notebook the error is
    the student's to see.

    Args:
        error: the exception.
        ran: something of the student's has run, besides the programs of a launch.
    """
    if error is None or isinstance(error, CheckEnded):
        return True
    if isinstance(error, ForgedGraph):
        with contextlib.suppress(LaunchEnded):
            failed_as_a_whole("The ROS graph can be read", FORGED_GRAPH(_FORGED))
        return True
    if isinstance(error, KitError):  # such as a machine without a compiler
        if ran or current.check.block is not None:  # what the student wrote may have brought it about
            _flag(error)
        unknown("This can be found out on this machine", " ".join(part for part in (error.what, error.do) if part))
        return True
    if because := unusable.reason(error):
        _flag(error)
        _record(_failure(_USABLE, UNUSABLE_DATA(because)))
        _void_parts()
        return True
    if current.check.front_end is not None or not isinstance(error, Exception):
        return False
    place = place_of(error, _is_cells)
    _flag(error)
    unknown("The check itself broke", f"{type(error).__name__}: {error}" + (f" ({place})" if place else ""))
    return True


def ends_part(error: Exception) -> bool:
    """Fail the part in which a check broke over something that no check can use; whether it was that."""
    because = unusable.reason(error)
    if because:
        _flag(error)
        _record(_failure(_USABLE, UNUSABLE_DATA(because)))
    return bool(because)


def _flag(error: BaseException) -> None:
    if current.check.front_end is None:
        unusable.broke(error, place_of(error, _is_cells))


def _is_cells(file: str) -> bool:
    """Whether a file name is that of a check cell."""
    return not file.startswith(_NOT_CELLS)


def passed(title: str, *, expected: str = "", observed: str = "", picture: Picture | None = None) -> None:
    """Record that an expectation holds."""
    _record(worded(Status.PASSED, title, expected, observed).model_copy(update={"picture": picture}))


def worded(
    status: Status,
    title: str,
    expected: str = "",
    observed: str = "",
    because: str = "",
    hint: str = "",
    code: str = "",
    hidden: bool = False,
) -> Outcome:
    """Return an outcome whose texts have a bounded length; its arguments are those of `Outcome`.

    What the reason quotes already is not shown a second time as what was observed, unless it stands beside what was
    expected, to be compared.
    """
    if not expected and len(observed) >= _WORTH_QUOTING and _said_in(observed, because):
        observed = ""
    title, expected, observed, because, hint = map(_cut, (title, expected, observed, because, hint))
    return Outcome(
        status=status, title=title, expected=expected, observed=observed, because=because, hint=hint, code=code,
        hidden=hidden,
    )  # fmt: skip


def _said_in(part: str, whole: str) -> bool:
    """Whether a text contains another one, apart from case, quotes and the full stop."""
    one, other = (text.replace("`", "").strip(" .").casefold() for text in (part, whole))
    return one in other


def _cut(text: str) -> str:
    return text if len(text) <= TEXT_KEPT else f"{text[: TEXT_KEPT // 2]} […] {text[-TEXT_KEPT // 2 :]}"


def failed(
    title: str,
    reason: Reason,
    *,
    expected: str = "",
    observed: str = "",
    picture: Picture | None = None,
) -> NoReturn:
    """Record that an expectation does not hold, and end the block: the part, or the whole launch outside of any.

    Raises:
        CheckEnded: always.
    """
    _record(_failure(title, reason, expected, observed).model_copy(update={"picture": picture}))
    _rest_not_checked()
    if current.check.findings.part:
        raise CheckEnded(title)
    _void_parts()
    raise LaunchEnded(title)


def _void_parts(standing: Collection[str] = ()) -> None:
    """Take the points of every part that the current launch or table has looked at, or would have; others stand."""
    found = current.check.findings.outcomes[current.check.findings.block_began :]
    current.check.findings.lost_parts |= {outcome.part for outcome in found if outcome.part} - set(standing)


def failed_as_a_whole(
    title: str,
    reason: Reason,
    *,
    expected: str = "",
    observed: str = "",
    standing: Collection[str] = (),
) -> NoReturn:
    """As `failed`, in place of all that the launch has found out but for the parts in `standing`: the rest is void.

    Raises:
        LaunchEnded: always.
    """
    _void_parts(standing)
    findings = current.check.findings
    found = findings.outcomes[findings.block_began :]
    findings.outcomes[findings.block_began :] = [outcome for outcome in found if outcome.part in standing]
    findings.part = ""
    _record(_failure(title, reason, expected, observed))
    _rest_not_checked(whole=True, standing=standing)
    _void_parts(standing)
    raise LaunchEnded(title)


def _failure(title: str, reason: Reason, expected: str = "", observed: str = "") -> Outcome:
    because = reason.because
    if not any(outcome.status is Status.FAILED for outcome in current.check.findings.outcomes):
        for package, why in current.check.findings.references.items():
            because += f" The programs ran with a right `{package}`, because the one that was handed in is wrong: {why}"
    return worded(Status.FAILED, title, expected, observed, because, reason.hint, reason.kind.code)


def unknown(title: str, because: str) -> None:
    """Record that the grader could not find out.

    In a cell with hidden tests the text is for instructors only: it may quote a line or a value of them.
    """
    frame = _check_frame()
    hidden = frame is not None and bool(hidden_lines(_lines(frame)))
    _record(worded(Status.UNKNOWN, code=GRADER.code, hidden=hidden, title=title, because=because))


def _record(outcome: Outcome) -> None:
    patience = current.check.findings.patience
    if outcome.status is Status.PASSED:
        patience.passed()
    else:
        current.check.findings.starved = max(current.check.findings.starved, patience.decided())
    outcome.part = current.check.findings.part
    outcome.hidden = outcome.hidden or in_hidden_lines()
    current.check.findings.outcomes.append(outcome)


def in_hidden_lines() -> bool:
    """Whether a line of a hidden test runs now. A cell's own helper function runs for the line that called it."""
    frame = _check_frame()
    while frame is not None:
        if frame.f_lineno in hidden_lines(_lines(frame)):
            return True
        frame = frame.f_back if frame.f_code.co_name != "<module>" else None
    return False


def _check_frame() -> FrameType | None:
    """The frame of the check cell: the nearest caller that is not the kit's or the standard library's."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        filename = frame.f_code.co_filename
        if not filename.startswith(_NOT_CELLS):
            return frame
        frame = frame.f_back
    return None


def _lines(frame: FrameType) -> list[str]:
    return linecache.getlines(frame.f_code.co_filename, frame.f_globals)


def parts_with_more_at_grading() -> set[str]:
    """Titles of the parts whose hidden tests were taken out of this copy of the cell; "" for those of no part."""
    frame = _check_frame()
    lines = _lines(frame) if frame is not None else []
    return {_part_around(lines, number) for number, line in enumerate(lines) if line.strip() == MORE_AT_GRADING}


def _part_around(lines: Sequence[str], number: int) -> str:
    """The title of the `with ros.part("title"):` block that a line is in, by its indentation."""
    indent = _indent(lines[number])
    for line in reversed(lines[:number]):
        if line.strip() and _indent(line) < indent:
            indent = _indent(line)
            match = _PART.search(line)
            if match:
                return str(ast.literal_eval(match[1]))
    return ""


_EXPECTS = re.compile(r"expect(_|$)|require(_equal)?$")
_PART = re.compile(r"""\.part\(\s*("[^"]*"|'[^']*')""")


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _block_of(part: str) -> tuple[FrameType | None, ast.With | None]:
    """The `with` block of a part, or the launch's if there is no part, and the frame that is in it.

    A cell's own helper function may be where an expectation fails: the block is that of the line that called it.
    """
    frame = _check_frame()
    while frame is not None:
        try:
            tree = ast.parse("".join(_lines(frame)))
        except SyntaxError:  # only the shell knows this source (IPython syntax around it): nothing to list
            return frame, None
        line = frame.f_lineno
        blocks = [n for n in ast.walk(tree) if isinstance(n, ast.With) and n.lineno <= line <= (n.end_lineno or 0)]
        blocks = [block for block in blocks if _part_title(block) == part]
        if blocks or frame.f_code.co_name == "<module>":
            return frame, min(blocks, key=lambda n: (n.end_lineno or 0) - n.lineno, default=None)
        frame = frame.f_back
    return None, None


def _part_title(block: ast.With) -> str:
    """The title if it is a `with ros.part("title"):` block."""
    call = block.items[0].context_expr
    named = isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "part"
    title = call.args[0] if named and isinstance(call, ast.Call) and call.args else None
    return title.value if isinstance(title, ast.Constant) and isinstance(title.value, str) else ""


def _rest_not_checked(whole: bool = False, standing: Collection[str] = ()) -> None:
    """Record what the source still wanted to check in the same block, or all that it wanted in the launch."""
    frame, block = _block_of("" if whole else current.check.findings.part)
    if frame is None or block is None:
        return
    hidden = hidden_lines(_lines(frame))
    for node, part in _expectations(block, current.check.findings.part):
        if (whole and part not in standing) or (not whole and node.lineno > frame.f_lineno):
            text = " ".join(_in_words(node, frame.f_globals).split())
            current.check.findings.outcomes.append(
                Outcome(
                    status=Status.NOT_CHECKED,
                    title=text if len(text) <= 120 else text[:117] + "...",
                    because="The program ended too early." if whole else "Something before it failed.",
                    hidden=node.lineno in hidden,
                    part=part,
                )
            )


def _expectations(node: ast.AST, part: str) -> Iterator[tuple[ast.Call, str]]:
    """The calls of expectations below a node, each with the title of its part, in the order of the source."""
    for child in ast.iter_child_nodes(node):
        inside = (isinstance(child, ast.With) and _part_title(child)) or part
        if isinstance(child, ast.Call) and _EXPECTS.match(_called(child)):
            yield child, part
        yield from _expectations(child, inside)


def _called(call: ast.Call) -> str:
    """The name of the method or function that is called."""
    if isinstance(call.func, ast.Attribute):
        return call.func.attr
    return call.func.id if isinstance(call.func, ast.Name) else ""


def _in_words(call: ast.Call, names: Mapping[str, object]) -> str:
    """What an expectation asks: one of the lab's own says it itself in its first sentence."""
    own = names.get(_called(call)) if isinstance(call.func, ast.Name) else None
    said = (getattr(own, "__doc__", None) or "").strip().split("\n")[0].removesuffix(".")
    return said or ast.unparse(call).removeprefix("ros.")
