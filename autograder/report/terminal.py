"""The terminal's view: one submission in full, a class as a table, and each verdict as soon as it is there."""

from __future__ import annotations

import contextlib
import io
import unicodedata
from collections.abc import Iterator, Mapping, Sequence

from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TimeElapsedColumn
from rich.table import Column, Table
from rich.text import Text

from autograder.core.output import last_lines
from autograder.core.results import CellResult, CheckResult, Isolation, NodeLog, Outcome, Status, SubmissionResult
from autograder.course.settings import NO_BOOK, Book
from autograder.report import words
from autograder.report.audience import Audience, check_for, reason, result_for
from autograder.report.words import Verdict
from autograder.submission.similar import Pair

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


def submission_view(result: SubmissionResult, audience: Audience = "student", book: Book = NO_BOOK) -> RenderableType:
    """Return everything that this audience may know of one submission."""
    seen = result_for(result, audience)
    checks = [check_view(check, title=check.title or check.grade_id, book=book) for check in seen.checks]
    return Group(*problems_view(seen.problems, book), *checks, total_view(seen))


def problems_view(problems: Sequence[Outcome], book: Book) -> list[RenderableType]:
    """Return what is wrong with a submission as a whole."""
    lines = [line for problem in problems for line in (_outcome_line(problem), *_details(problem, book))]
    return [*lines, Text()] if lines else []


def total_view(result: SubmissionResult) -> RenderableType:
    """Return the last lines of a report: the points, and the isolation if it is not full."""
    weaker = [] if result.isolation is Isolation.FULL else [Text(f"isolation: {result.isolation.value}", "dim")]
    return Group(Text(), _total(result), *weaker)


def _total(result: SubmissionResult) -> Text:
    return Text(f"{result.lab}: {words.total(result)}", "bold")


def summary_view(result: SubmissionResult) -> RenderableType:
    """Return a line for each check, as students may know it, and the points."""
    table = Table.grid(padding=(0, 1))
    for check in result_for(result, "student").checks:
        verdict = words.verdict(check)
        head = Text(f"{words.SYMBOL[verdict]} {verdict.value}", _VERDICT_STYLE[verdict])
        table.add_row(head, Text(plain(check.title or check.grade_id)), Text(words.points(check)))
    return Group(table, Text(), _total(result))


def check_view(
    check: CellResult,
    remarks: Sequence[str] = (),
    origin: str = "",
    title: str = "",
    book: Book = NO_BOOK,
) -> RenderableType:
    """Return one check's report: what was found first, then what holds. Of a check that passed, a line."""
    verdict, found = words.verdict(check), words.findings(check)
    style = _VERDICT_STYLE[verdict]
    head = Text.assemble((f"{words.SYMBOL[verdict]} ", style), (verdict.value, style))
    if title:
        head.append("  ").append(plain(title), "bold")
    if check.max_points:
        head.append(f"  {words.points(check)}")
    lines: list[RenderableType] = [head]
    lines += [Text(f"  {plain(text)}") for text in (words.not_attempted(check),) if text]
    lines += [Text(f"  ! {plain(remark)}", "bold") for remark in [*remarks, *check.flags]]
    if verdict is not Verdict.NOT_ATTEMPTED:
        lines += _findings(found, book)
    if verdict in (Verdict.FAILED, Verdict.PARTLY, Verdict.UNKNOWN):
        lines += [Text(f"  {text}", "dim") for text in (words.holding(found),) if text]
        lines += [_output(log) for log in check.logs if log.text.strip()]
    lines += [Text(f"  {plain(origin)}", "dim")] if origin else []
    return Group(*lines)


def _findings(found: words.Findings, book: Book) -> list[RenderableType]:
    lines: list[RenderableType] = []
    for outcome in found.bad:
        lines += [Text("  ") + _outcome_line(outcome), *_details(outcome, book)]
    for part in found.lost:
        mark = (f"{words.SYMBOL[part.verdict]} ", _VERDICT_STYLE[part.verdict])
        lines.append(Text.assemble("  ", mark, f"{plain(part.title)}: {part.points}"))
        for outcome in part.bad:
            lines += [Text("    ") + _outcome_line(outcome), *_details(outcome, book)]
    return lines + [Text(f"  {text}", "dim") for text in (found.not_looked_at,) if text]


def check_text(check: CellResult, remarks: Sequence[str], origin: str, book: Book = NO_BOOK) -> str:
    """Return a student's view of one check as plain text, for a notebook in a terminal."""
    screen = Console(file=io.StringIO(), width=100, highlight=False, color_system=None, force_jupyter=False)
    screen.print(check_view(check_for(check, "student"), remarks, origin, book=book))
    assert isinstance(screen.file, io.StringIO)
    return "\n".join(line.rstrip() for line in screen.file.getvalue().splitlines())


def evidence_view(check: CheckResult, book: Book) -> RenderableType:
    """Return all that is known of a check, for an instructor: what passed, too, and all that its programs printed."""
    lines: list[RenderableType] = [
        check_view(check, title=check.title or check.grade_id, book=book),
        Text(),
    ]
    part = ""
    for outcome in check.outcomes:
        if outcome.part != part:
            part = outcome.part
            lines.append(Text(plain(part) or "all parts", "bold"))
        mark = Text("  (hidden)", "dim") if outcome.hidden else Text()
        lines += [Text("  ") + _outcome_line(outcome) + mark, *_details(outcome, book)]
    printed = {log.program for log in check.logs if log.text.strip()}
    return Group(*lines, *(_output(log, None) for log in check.logs if log.program in printed))


def _output(log: NodeLog, most: int | None = _LOG_LINES) -> RenderableType:
    ended = f", stopped by the {log.stopped_by}" if log.stopped_by else ""
    if not ended and log.exit_status is not None:
        ended = f", exit status {log.exit_status}"
    shown = Text(plain(last_lines(log.text, most or len(log.text) + 1)))
    return Panel(shown, title=Text(f"output of {plain(log.program)}{ended}"), title_align="left", border_style="dim")


_VERDICT_STYLE = {
    Verdict.PASSED: "blue",
    Verdict.HOLDS: "blue",
    Verdict.PARTLY: "bold red",
    Verdict.FAILED: "bold red",
    Verdict.NOT_ATTEMPTED: "bold",
    Verdict.UNKNOWN: "bold magenta",
}


def _outcome_line(outcome: Outcome) -> Text:
    mark = (f"{SYMBOL[outcome.status]} ", STYLE[outcome.status])
    words = "" if outcome.status in (Status.PASSED, Status.FAILED) else f" ({outcome.status.value})"
    return Text.assemble(mark, plain(outcome.title), (words, STYLE[outcome.status]))


def _details(outcome: Outcome, book: Book) -> list[RenderableType]:
    pairs = [
        ("because", outcome.because),
        ("expected", outcome.expected),
        ("observed", outcome.observed),
        ("try", outcome.hint),
        ("read on", "" if outcome.hint else str(book.sections.get(outcome.code, ""))),
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


def class_view(results: Sequence[SubmissionResult], by_hand: Mapping[str, str]) -> RenderableType:
    """Return a class as a table: a row for each student, a symbol for each check, and why points were lost.

    Args:
        results: of the class.
        by_hand: by student, what people gave and what waits for them.
    """
    checks = results[0].checks if results else []
    table = Table(box=None, header_style="bold", padding=(0, 1), pad_edge=False, expand=True)
    table.add_column("student", no_wrap=True, max_width=26)
    table.add_column(f"checks 1-{len(checks)}", no_wrap=True)
    table.add_column("points", justify="right", no_wrap=True)
    if any(by_hand.values()):
        table.add_column("by hand", no_wrap=True)
    table.add_column("status", no_wrap=True)
    table.add_column("why points were lost", ratio=1, no_wrap=True, overflow="ellipsis")
    for result in results:
        status = class_status(result)
        table.add_row(
            Text(plain(result.student)),
            _marks(result.checks),
            f"{result.points:g}/{result.max_points:g}",
            *([by_hand.get(result.student, "")] if any(by_hand.values()) else []),
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
        verdict = words.verdict(check)
        marks.append(words.SYMBOL[verdict], _VERDICT_STYLE[verdict])
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
    """Return what an instructor has to decide by hand or to look at, with the cause; None if there is nothing."""
    lines = [Text(f"  {plain(line)}") for result in results for line in _undecided(result)]
    flagged = [Text(f"  {plain(result.student)}: {plain(flag)}") for result in results for flag in result.flags]
    found = []
    if lines:
        head = "The grader could not decide these checks. They wait for manual grading (--force runs them again):"
        found += [Text(head, "bold magenta"), *lines]
    if flagged:
        found += [Text("These checks keep their points, but a person should look at them:", "bold magenta"), *flagged]
    return Group(*found) if found else None


def _undecided(result: SubmissionResult) -> list[str]:
    """A line for each cause that left checks of a submission undecided, with all of these checks."""
    by_cause: dict[str, list[str]] = {}
    for check in result.checks:
        if check.status is Status.UNKNOWN:
            cause = reason(check.first_failure) if check.first_failure else "no outcome"
            by_cause.setdefault(cause, []).append(check.title or check.grade_id)
    named = {
        cause: "everything" if 1 < len(which) == len(result.checks) else "; ".join(dict.fromkeys(which))
        for cause, which in by_cause.items()
    }
    return [f"{result.student}: {which}: {cause}" for cause, which in named.items()]


_LINES = 3
"""Equal lines of a pair that are shown."""


def similar_view(pairs: Sequence[Pair], count: int) -> RenderableType:
    """Return pairs of submissions that are alike, with what a person should look at first.

    Args:
        pairs: the most alike first.
        count: of all submissions that were compared.
    """
    lines: list[RenderableType] = [Text(f"{count} submissions were compared.", "dim")]
    for pair in pairs:
        one, other = (plain(student) for student in pair.students)
        lines.append(Text.assemble((f"{100 * pair.likeness:3.0f} %  ", "bold"), f"{one}  and  {other}"))
        lines.append(Text(f"       in {', '.join(map(plain, pair.answers))}"))
        if pair.lines:
            number = f"{len(pair.lines)} line{'' if len(pair.lines) == 1 else 's'}"
            lines.append(Text(f"       {number} that only these two have, letter for letter:"))
            lines += [Text(f"         {plain(line[:90])}", "dim") for line in pair.lines[:_LINES]]
    end = "A task has few solutions, and people may work together: read both before you ask anybody."
    lines.append(Text(end if pairs else "No pair reaches the smallest similarity that is shown (--at-least).", "dim"))
    return Group(*lines)


def console() -> Console:
    """Return a console for standard output; in a pipe or a log it is 120 columns wide."""
    made = Console(highlight=False)
    if not made.is_terminal:
        made.width = 120
    return made


class LiveReport:
    """A report on one submission that is printed while its checks still run, in the lab's order.

    A verdict is printed once it is known and those above it are. On a terminal a line below says what is waited for; a
    pipe or a log gets nothing of that.

    Args:
        checks: the grade_ids of the lab's checks, in order.
        audience: who reads it; None prints no report, only the line.
        book: the course's lectures.
    """

    def __init__(self, checks: Sequence[str], audience: Audience | None, book: Book) -> None:
        """Nothing is known yet."""
        self._book = book
        self._audience = audience
        self._screen = console()
        self._left = list(checks)
        self._known: dict[str, CheckResult] = {}
        self._count = 0
        self._at: dict[int, str] = {}
        self._line = _line(self._screen if audience else Console(stderr=True))
        self._task = self._line.add_task(self._says(), total=None)

    def __enter__(self) -> LiveReport:
        """Begin to show the line."""
        self._line.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take it away."""
        self._line.stop()

    def begun(self, problems: Sequence[Outcome]) -> None:
        """The submission has been read: this is wrong with it as a whole."""
        if self._audience:
            for part in problems_view(problems, self._book):
                self._screen.print(part)

    def at(self, worker: int, what: str) -> None:
        """A worker is at this check now; empty: it has nothing more to do."""
        self._at[worker] = what
        self._line.update(self._task, description=self._says())

    def decided(self, check: CheckResult) -> None:
        """A check came to this."""
        if check.grade_id in self._known:
            return
        self._known[check.grade_id] = check
        while self._left and self._left[0] in self._known:
            self._print(self._known[self._left.pop(0)])

    def finish(self, result: SubmissionResult) -> None:
        """Print what nobody has told so far, and the points."""
        for check in result.checks:
            self.decided(check)
        self._line.stop()
        if self._audience:
            self._screen.print(total_view(result_for(result, self._audience)))

    def _print(self, check: CheckResult) -> None:
        if self._audience:
            title = check.title or check.grade_id
            self._screen.print(check_view(check_for(check, self._audience), title=title, book=self._book))

    def _says(self) -> str:
        done = f"{len(self._known)} of {len(self._known.keys() | set(self._left))} checks done"
        under_way = dict.fromkeys(what for _, what in sorted(self._at.items()) if what)
        return plain("; now: ".join(text for text in (done, ", ".join(under_way)) if text))


@contextlib.contextmanager
def working(sentence: str) -> Iterator[None]:
    """Say on the terminal what takes so long, and for how long; a pipe or a log gets nothing of it."""
    with _line(Console(stderr=True)) as line:
        line.add_task(plain(sentence), total=None)
        yield


class _Sentence(ProgressColumn):
    """A task's description in one line, cut where the terminal ends."""

    def render(self, task: Task) -> Text:
        """Return it."""
        return Text(task.description, no_wrap=True, overflow="ellipsis")


def _line(screen: Console) -> Progress:
    on_a_terminal = screen.is_terminal and screen.file.isatty()
    elapsed = TimeElapsedColumn(Column(no_wrap=True))
    return Progress(SpinnerColumn(), elapsed, _Sentence(), console=screen, transient=True, disable=not on_a_terminal)
