"""Show results on the terminal: a submission in full, a class as a table, and each verdict as soon as it is known."""

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

from autograder.core.history import Event
from autograder.core.output import last_lines
from autograder.core.results import CellResult, CheckResult, Isolation, NodeLog, Outcome, Status, SubmissionResult
from autograder.course.settings import NO_BOOK, Book
from autograder.report import words
from autograder.report.audience import Audience, check_for, reason, result_for
from autograder.report.words import Verdict
from autograder.submission.similar import Pair

SYMBOL = {Status.PASSED: "✓", Status.FAILED: "✗", Status.NOT_CHECKED: "-", Status.UNKNOWN: "?", Status.NOTE: "•"}
STYLE = {
    Status.PASSED: "blue",
    Status.FAILED: "bold red",
    Status.NOT_CHECKED: "dim",
    Status.UNKNOWN: "bold magenta",
    Status.NOTE: "dim",
}
_JOINERS = "\u200c\u200d"
"""Invisible characters that are part of the spelling of some scripts and emoji."""
_LOG_LINES = 20


class _Shown(dict[int, int | str]):
    """Maps each character to what the terminal shows for it. Each character is looked up only once."""

    def __missing__(self, code: int) -> int | str:
        character = chr(code)
        # Control characters, format characters (which change the text direction), line separators, surrogates.
        hidden = unicodedata.category(character) in ("Cc", "Cf", "Zl", "Zp", "Cs") and character not in "\n" + _JOINERS
        self[code] = "�" if hidden else code
        return self[code]


_SHOWN = _Shown()


def plain(text: str) -> str:
    """Replace invisible characters, so that a student's text can neither control the terminal nor mislead a reader."""
    return text.replace("\t", "    ").translate(_SHOWN)


def submission_view(result: SubmissionResult, audience: Audience = "student", book: Book = NO_BOOK) -> RenderableType:
    """Return everything that this audience may see of a submission's result."""
    seen = result_for(result, audience)
    checks = [check_view(check, title=check.title or check.grade_id, book=book) for check in seen.checks]
    return Group(*problems_view(seen.problems, book), *checks, total_view(seen))


def problems_view(problems: Sequence[Outcome], book: Book) -> list[RenderableType]:
    """Return the problems of a submission as a whole."""
    lines = [line for problem in problems for line in (_outcome_line(problem), *_details(problem, book))]
    return [*lines, Text()] if lines else []


def total_view(result: SubmissionResult) -> RenderableType:
    """Return the last lines of a report: the points, and the isolation if it is not full."""
    weaker = [] if result.isolation is Isolation.FULL else [Text(f"isolation: {result.isolation.value}", "dim")]
    return Group(Text(), _total(result), *weaker)


def _total(result: SubmissionResult) -> Text:
    return Text(f"{result.lab}: {words.total(result)}", "bold")


def summary_view(result: SubmissionResult) -> RenderableType:
    """Return a line for each check, as students may see it, and the total points."""
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
    """Return a check's report: first the findings, then what holds. A check that passed gets only one line."""
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
    """Return everything about a check for an instructor, including what passed and all output of its programs."""
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
    """Say in one line why a submission lost points: the first check that did not pass, and its first failure."""
    for number, check in enumerate(result.checks, start=1):
        if check.status is not Status.PASSED:
            failure = check.first_failure
            return f"{number}: {plain(reason(failure)) if failure else check.status.value}"
    return ""


_NARROW = 100
"""The columns of a terminal below which the table of a class has no room for reasons, so they follow it."""


def class_view(results: Sequence[SubmissionResult], by_hand: Mapping[str, str], width: int) -> RenderableType:
    """Return a class as a table: a row for each student, a symbol for each check, and why points were lost.

    Args:
        results: the results of the class.
        by_hand: for each student, the points that people gave and what waits for them, in words.
        width: the columns of the terminal. On a narrow one the reasons stand below the table, where nothing is cut.
    """
    narrow = width < _NARROW
    checks = results[0].checks if results else []
    table = Table(box=None, header_style="bold", padding=(0, 1), pad_edge=False, expand=not narrow)
    table.add_column("student", no_wrap=True, max_width=26)
    table.add_column(f"checks 1-{len(checks)}", no_wrap=True)
    table.add_column("points", justify="right", no_wrap=True)
    if any(by_hand.values()):
        table.add_column("by hand", no_wrap=True)
    table.add_column("status", no_wrap=True)
    if not narrow:
        table.add_column("why points were lost", ratio=1, no_wrap=True, overflow="ellipsis")
    for result in results:
        status = class_status(result)
        table.add_row(
            Text(plain(result.student)),
            _marks(result.checks),
            f"{result.points:g}/{result.max_points:g}",
            *([by_hand.get(result.student, "")] if any(by_hand.values()) else []),
            Text(f"{SYMBOL[status]} {_WORD[status]}", STYLE[status]),
            *([] if narrow else [Text(why_lost(result))]),
        )
    below: list[Text | Table] = [Text(), _reasons(results)] if narrow and any(map(why_lost, results)) else []
    return Group(table, *below, Text(), Text("\n".join(_legend(checks)), style="dim"))


def _reasons(results: Sequence[SubmissionResult]) -> Table:
    """Return a line for each student who lost points, with the whole reason."""
    table = Table("student", "why points were lost", box=None, header_style="bold", padding=(0, 1), pad_edge=False)
    for result in results:
        if why := why_lost(result):
            table.add_row(Text(plain(result.student)), Text(why))
    return table


def _marks(checks: Sequence[CheckResult]) -> Text:
    """Return a symbol for each check, in groups of five so that they can be counted."""
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
    """Return the worst status of a submission's checks."""
    statuses = {check.status for check in result.checks}
    return next((s for s in (Status.UNKNOWN, Status.FAILED) if s in statuses), Status.PASSED)


def _legend(checks: Sequence[CheckResult]) -> list[str]:
    return [f"{n}  {plain(c.title or c.grade_id)} ({c.max_points:g})" for n, c in enumerate(checks, start=1)]


def undecided_view(results: Sequence[SubmissionResult], about_several: Sequence[str] = ()) -> RenderableType | None:
    """Return what an instructor has to decide or look at, with the reasons; None if there is nothing.

    Args:
        results: the results of the class.
        about_several: sentences about several students each, at whose work a person should look.
    """
    lines = [Text(f"  {plain(line)}") for result in results for line in _undecided(result)]
    flagged = [Text(f"  {plain(result.student)}: {plain(flag)}") for result in results for flag in result.flags]
    found = []
    if lines:
        head = (
            "The grader could not decide these checks. If the machine was busy, the same command runs them again;"
            " otherwise decide about them in formgrader:"
        )
        found += [Text(head, "bold magenta"), *lines]
    if flagged:
        found += [Text("These checks keep their points, but a person should look at them:", "bold magenta"), *flagged]
    if about_several:
        head = "These students keep their points, but a person should talk to them:"
        found += [Text(head, "bold magenta"), *(Text(f"  {plain(sentence)}") for sentence in about_several)]
    return Group(*found) if found else None


def _undecided(result: SubmissionResult) -> list[str]:
    """Return a line for each reason why checks of a submission are undecided, with the names of these checks."""
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
"""The number of equal lines that are shown for a pair."""


def similar_view(pairs: Sequence[Pair], count: int) -> RenderableType:
    """Return a view of pairs of similar submissions, with what a person should look at first.

    Args:
        pairs: the pairs, the most similar first.
        count: the number of submissions that were compared.
    """
    lines: list[RenderableType] = [Text(f"{count} submissions were compared.", "dim")]
    for pair in pairs:
        one, other = (plain(student) for student in pair.students)
        lines.append(Text.assemble((f"{100 * pair.likeness:3.0f} %  ", "bold"), f"{one}  and  {other}"))
        lines.append(Text(f"       in {', '.join(map(plain, pair.answers))}"))
        if pair.lines:
            number = f"{len(pair.lines)} line{'' if len(pair.lines) == 1 else 's'}"
            lines.append(Text(f"       {number} that are identical in these two and occur in no other submission:"))
            lines += [Text(f"         {plain(line[:90])}", "dim") for line in pair.lines[:_LINES]]
    end = "A task has few solutions, and people may work together, so read both submissions before you ask anybody."
    lines.append(Text(end if pairs else "No pair reaches the smallest similarity that is shown (--at-least).", "dim"))
    return Group(*lines)


def console() -> Console:
    """Return a console for standard output. In a pipe or a log it is 120 columns wide."""
    made = Console(highlight=False)
    if not made.is_terminal:
        made.width = 120
    return made


class LiveReport:
    """A report on one submission that is printed in the lab's order while its checks still run.

    A verdict is printed as soon as it and all verdicts before it are known. On a terminal, a line below the report says
    what is running. In a pipe or a log, this line is not printed.

    Args:
        checks: the grade_ids of the lab's checks, in order.
        audience: the reader; None prints only the line and no report.
        book: the course's lectures.
    """

    def __init__(self, checks: Sequence[str], audience: Audience | None, book: Book) -> None:
        """Prepare the report without printing anything."""
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
        """Show the line below the report."""
        self._line.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the line below the report."""
        self._line.stop()

    def begun(self, problems: Sequence[Outcome]) -> None:
        """Print the problems of the submission as a whole, after it has been read."""
        if self._audience:
            for part in problems_view(problems, self._book):
                self._screen.print(part)

    def at(self, worker: int, what: str) -> None:
        """Show which check a worker is running; an empty text means that it has nothing more to do."""
        self._at[worker] = what
        self._line.update(self._task, description=self._says())

    def decided(self, check: CheckResult) -> None:
        """Take the result of a check, and print it if the results of all checks before it are known."""
        if check.grade_id in self._known:
            return
        self._known[check.grade_id] = check
        while self._left and self._left[0] in self._known:
            self._print(self._known[self._left.pop(0)])

    def finish(self, result: SubmissionResult) -> None:
        """Print the results that have not been printed yet, and the points."""
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
    """Show on the terminal what is being done and for how long. In a pipe or a log, nothing is printed."""
    with _line(Console(stderr=True)) as line:
        line.add_task(plain(sentence), total=None)
        yield


class _Sentence(ProgressColumn):
    """A column with a task's description in one line, which is cut off at the edge of the terminal."""

    def render(self, task: Task) -> Text:
        """Return the description."""
        return Text(task.description, no_wrap=True, overflow="ellipsis")


def _line(screen: Console) -> Progress:
    on_a_terminal = screen.is_terminal and screen.file.isatty()
    elapsed = TimeElapsedColumn(Column(no_wrap=True))
    return Progress(SpinnerColumn(), elapsed, _Sentence(), console=screen, transient=True, disable=not on_a_terminal)


def history_view(events: Sequence[Event]) -> RenderableType:
    """Return a table of what happened to the points of a submission."""
    table = Table(title="History", box=None, header_style="bold", padding=(0, 1), pad_edge=False, title_justify="left")
    for title in ("when (UTC)", "by", "what", "points"):
        table.add_column(title, no_wrap=title != "what")
    for event in events:
        lines = [event.what]
        for change in event.changes:
            name = f"{change.cell}: " if change.cell else ""
            lines.append(f"{name}{change.before} → {change.after}, {change.why}")
        when = f"{event.at:%Y-%m-%d %H:%M}"
        table.add_row(when, plain(event.by), Text("\n".join(map(plain, lines))), event.score)
    return table
