"""The terminal's view: one submission in full, or a class as a table."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from autograder.report.audience import Audience, reason, result_for
from autograder.results import CheckResult, Outcome, Status, SubmissionResult

SYMBOL = {Status.PASSED: "✓", Status.FAILED: "✗", Status.NOT_CHECKED: "-", Status.UNKNOWN: "?"}
STYLE = {Status.PASSED: "blue", Status.FAILED: "bold red", Status.NOT_CHECKED: "dim", Status.UNKNOWN: "bold magenta"}
_JOINERS = "\u200c\u200d"
"""Invisible, but part of how some scripts and emoji are written."""
_LOG_LINES = 20


class _Shown(dict[int, int | str]):
    """What stands on the terminal for each character; worked out once for each that occurs."""

    def __missing__(self, code: int) -> int | str:
        character = chr(code)
        # Control and format characters (which turn the direction of writing), other ends of lines, half characters.
        hidden = unicodedata.category(character) in ("Cc", "Cf", "Zl", "Zp", "Cs") and character not in "\n" + _JOINERS
        self[code] = "�" if hidden else code
        return self[code]


_SHOWN = _Shown()


def plain(text: str) -> str:
    """Take out what cannot be seen: a student's output must not drive the terminal, nor seem to say something else."""
    return text.replace("\t", "    ").translate(_SHOWN)


def points_text(check: CheckResult) -> str:
    """A check's points as `2/3`, or `?/3` when nobody could find out."""
    return f"{'?' if check.points is None else f'{check.points:g}'}/{check.max_points:g}"


def submission_view(result: SubmissionResult, audience: Audience = "student") -> RenderableType:
    """Return everything that this audience may know of one submission."""
    result = result_for(result, audience)
    parts: list[RenderableType] = []
    for problem in result.problems:
        parts.append(_outcome_line(problem))
        parts.extend(_details(problem))
    if result.problems:
        parts.append(Text())
    failed_cells = set()
    for check in result.checks:
        head = Text.assemble(
            (f"{SYMBOL[check.status]} ", STYLE[check.status]),
            (plain(check.title or check.grade_id), "bold"),
            f"  {points_text(check)}  ",
            (check.status.value, STYLE[check.status]),
        )
        parts.append(head)
        if check.status is not Status.PASSED:
            failed_cells.add(check.grade_id)
            for outcome in check.outcomes:
                parts.append(Text("  ") + _outcome_line(outcome))
                if outcome.status is not Status.PASSED:
                    parts.extend(_details(outcome))
    for log in result.logs:
        if log.grade_id in failed_cells and log.text.strip():
            lines = plain(log.text).rstrip().split("\n")
            shown = "\n".join(lines[-_LOG_LINES:])
            title = f"output of {plain(log.program)} in {plain(log.grade_id)}"
            parts.append(Panel(Text(shown), title=Text(title), title_align="left", border_style="dim"))
    parts.append(Text())
    total = f"{result.points:g} of {result.max_points:g} points"
    undecided = sum(check.status is Status.UNKNOWN for check in result.checks)
    if undecided:
        total += f", {undecided} check{'s' if undecided > 1 else ''} undecided: your instructor decides"
    parts.append(Text(f"{result.lab}: {total}", "bold"))
    if result.isolation != "full":
        parts.append(Text(f"isolation: {result.isolation.value}", "dim"))
    return Group(*parts)


def _outcome_line(outcome: Outcome) -> Text:
    mark = (f"{SYMBOL[outcome.status]} ", STYLE[outcome.status])
    words = "" if outcome.status in (Status.PASSED, Status.FAILED) else f" ({outcome.status.value})"
    return Text.assemble(mark, plain(outcome.title), (words, STYLE[outcome.status]))


def _details(outcome: Outcome) -> list[RenderableType]:
    pairs = [
        ("expected", outcome.expected),
        ("observed", outcome.observed),
        ("because", outcome.because),
        ("try", outcome.hint),
    ]
    table = Table.grid(padding=(0, 1))
    table.add_column(justify="right", style="dim", min_width=12)
    table.add_column(overflow="fold")
    for label, text in pairs:
        if text:
            table.add_row(label, Text(plain(text)))
    return [table] if table.row_count else []


def why_lost(result: SubmissionResult) -> str:
    """Why a submission lost points, in one line: the first check that did not pass, and its first failure."""
    for number, check in enumerate(result.checks, start=1):
        if check.status is not Status.PASSED:
            failure = check.first_failure
            return f"{number}: {plain(reason(failure)) if failure else check.status.value}"
    return ""


def class_view(results: Sequence[SubmissionResult]) -> RenderableType:
    """Return a class as a table: a row for each student, a symbol for each check, and why points were lost."""
    checks = results[0].checks if results else []
    table = Table(box=None, header_style="bold", padding=(0, 1), pad_edge=False, expand=True)
    table.add_column("student", no_wrap=True, max_width=26)
    table.add_column(f"checks 1-{len(checks)}", no_wrap=True)
    table.add_column("points", justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    table.add_column("why points were lost", ratio=1, no_wrap=True, overflow="ellipsis")
    for result in results:
        status = class_status(result)
        table.add_row(
            Text(plain(result.student)),
            _marks(result.checks),
            f"{result.points:g}/{result.max_points:g}",
            Text(f"{SYMBOL[status]} {_WORD[status]}", STYLE[status]),
            Text(why_lost(result)),
        )
    legend = Text("\n".join(_legend(checks)), style="dim")
    return Group(table, Text(), legend)


def _marks(checks: Sequence[CheckResult]) -> Text:
    """A symbol for each check, in groups of five that can be counted."""
    marks = Text()
    for number, check in enumerate(checks):
        marks.append(" " if number and number % 5 == 0 else "")
        marks.append(SYMBOL[check.status], STYLE[check.status])
    return marks


_WORD = {
    Status.PASSED: "passed",
    Status.FAILED: "failed",
    Status.UNKNOWN: "undecided",
    Status.NOT_CHECKED: "not checked",
}


def class_status(result: SubmissionResult) -> Status:
    """The worst status of a submission's checks."""
    statuses = {check.status for check in result.checks}
    return next((s for s in (Status.UNKNOWN, Status.FAILED) if s in statuses), Status.PASSED)


def _legend(checks: Sequence[CheckResult]) -> list[str]:
    return [f"{n}  {plain(c.title or c.grade_id)} ({c.max_points:g})" for n, c in enumerate(checks, start=1)]


def undecided_view(results: Sequence[SubmissionResult]) -> RenderableType | None:
    """Return what an instructor has to decide by hand, with the cause; None if there is nothing."""
    lines = [
        Text(f"  {plain(result.student)}: {plain(check.title or check.grade_id)}: ")
        + Text(plain(reason(check.first_failure)) if check.first_failure else "no outcome")
        for result in results
        for check in result.checks
        if check.status is Status.UNKNOWN
    ]
    if not lines:
        return None
    return Group(Text("The grader could not find out; these wait for manual grading:", "bold magenta"), *lines)


def console() -> Console:
    """Return a console for standard output; in a pipe or a log it is 120 columns wide."""
    made = Console(highlight=False)
    if not made.is_terminal:
        made.width = 120
    return made
