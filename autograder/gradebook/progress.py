"""What is seen while a class runs: how far and how fast it is, how long it still takes, who is at work, what failed."""

from __future__ import annotations

import threading
import time

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from autograder.core.results import Status, SubmissionResult
from autograder.report.terminal import plain

_NAMED = 3
"""As many of those at work are named."""


class Steps:
    """Progress on a terminal; a line for each step where nobody watches.

    Args:
        total: how many submissions there are.
        console: to show it on.
    """

    def __init__(self, total: int, console: Console) -> None:
        """Show nothing yet."""
        self._console, self.total, self.done, self._ran = console, total, 0, 0
        self._at_work: dict[str, None] = {}
        self._finished: set[str] = set()
        self._began = 0.0
        self._lock = threading.Lock()
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[more]}", markup=False),
        )
        self._progress = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self._task = self._progress.add_task("grading", total=total, more="")

    def __enter__(self) -> Steps:
        """Begin."""
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take the bar away."""
        self._progress.stop()

    def started(self, student: str) -> None:
        """A submission has begun to run; may be called in any thread, more than once, and after its end."""
        with self._lock:
            self._began = self._began or time.monotonic()
            if student not in self._finished:
                self._at_work[student] = None
        self._progress.update(self._task, more=self._more())

    def finished(self, result: SubmissionResult) -> None:
        """A result is there and kept."""
        self.done += 1
        with self._lock:
            self._finished.add(result.student)
            if result.student in self._at_work:
                del self._at_work[result.student]
                self._ran += 1
        self._progress.update(self._task, advance=1, more=self._more())
        trouble = _trouble(result)
        line = f"{result.student} {result.points:g}/{result.max_points:g}{trouble}"
        if not self._console.is_terminal:
            speed = self._speed()
            self.say(f"{self.done}/{self.total} {line}{f'  ({speed})' if speed else ''}")
        elif trouble:
            self.say(line)

    def watching(self) -> None:
        """The whole class has run; known answers among it may still run."""
        self._progress.update(self._task, description="canaries", more="")

    def recording(self, recorded: int) -> None:
        """Everything has run; so many are in the gradebook."""
        self._progress.update(self._task, description="recording", completed=recorded, more="")

    def say(self, sentence: str) -> None:
        """Print a line above the bar."""
        self._console.print(plain(sentence), markup=False, soft_wrap=True)

    def _speed(self) -> str:
        seconds = time.monotonic() - self._began if self._began else 0.0
        if not self._ran or not seconds:
            return ""
        left = (self.total - self.done) * seconds / self._ran
        return f"{60 * self._ran / seconds:.1f} a minute, {_duration(left)} left"

    def _more(self) -> str:
        with self._lock:
            names = list(self._at_work)
        others = f" +{len(names) - _NAMED}" if len(names) > _NAMED else ""
        at_work = f"at work: {', '.join(names[:_NAMED])}{others}" if names else ""
        return plain("  ".join(part for part in (self._speed(), at_work) if part))


def _trouble(result: SubmissionResult) -> str:
    undecided = sum(check.status is Status.UNKNOWN for check in result.checks)
    parts = [f"{undecided} undecided"] if undecided else []
    parts += [problem.title for problem in result.problems[:1]]
    return f": {', '.join(parts)}" if parts else ""


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
