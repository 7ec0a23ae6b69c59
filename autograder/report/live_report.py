"""What the terminal shows while checks run: each verdict as soon as it is there, and what is under way."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

from autograder.core.results import CheckResult, Outcome, SubmissionResult
from autograder.course.book import Book
from autograder.report.audience import Audience, check_for, result_for
from autograder.report.terminal import check_view, console, plain, problems_view, total_view


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
