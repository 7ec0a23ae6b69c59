"""The whole way of a class: take in, run, record, and tell what came of it."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from autograder.core.results import SubmissionResult
from autograder.course.lab import load_lab
from autograder.gradebook.grades import write_grades
from autograder.gradebook.recorder import Recorder
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings
from autograder.intake.collect import Collected, collect


@dataclass
class ClassRun:
    """What came of grading a class."""

    results: list[SubmissionResult]
    collected: Collected
    """What was taken in and what was not."""
    unrecorded: dict[str, str]
    """Why nbgrader has no grade, by student."""
    grades: Path
    seconds: dict[str, float] = field(default_factory=dict)
    """How long it took in all, and how much of that nbgrader took, which mostly overlaps with running."""


class _Steps:
    """Progress on a terminal; a line for each step where nobody watches."""

    def __init__(self, title: str, total: int, console: Console) -> None:
        self.console, self.total, self.done = console, total, 0
        self.progress = Progress(
            TextColumn(title),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[last]}", markup=False),
            console=console,
            disable=not console.is_terminal,
            transient=True,
        )
        self.task = self.progress.add_task(title, total=total, last="")

    def __enter__(self) -> _Steps:
        self.progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def step(self, last: str) -> None:
        self.done += 1
        self.progress.update(self.task, advance=1, last=last)
        if not self.console.is_terminal:
            self.console.print(f"{self.done}/{self.total} {last}", markup=False, soft_wrap=True)


def grade_class(root: Path, lab_name: str, source: Path, settings: Settings) -> ClassRun:
    """Grade every submission in a folder or zip.

    Args:
        root: of the course.
        lab_name: the lab they answer.
        source: folder or zip.
        settings: how to run them.

    Raises:
        KitError: usage or set-up.
        KeyboardInterrupt: finished results are kept, and the next run goes on from them.
    """
    console = Console(file=sys.stderr, highlight=False)
    lab = load_lab(root, lab_name)
    collected = collect(source, lab.name, root)
    began = time.monotonic()
    recording = 0.0
    with (
        Recorder(root, lab, settings.force) as recorder,
        _Steps("grading", len(collected.notebooks), console) as steps,
    ):

        def finished(result: SubmissionResult) -> None:
            # nbgrader is slow and works one by one: it does so while the rest of the class is running.
            nonlocal recording
            start = time.monotonic()
            recorder.record(result.student)
            recording += time.monotonic() - start
            steps.step(f"{result.student} {result.points:g}/{result.max_points:g}")

        try:
            results = run_class(collected.notebooks, root, lab, settings, finished)
        except KeyboardInterrupt:
            steps.progress.stop()
            console.print(f"\n{steps.done} of {steps.total} results are kept in build/results; run again to go on.")
            raise
    grades = write_grades(root)
    return ClassRun(
        results=list(results.values()),
        collected=collected,
        unrecorded=recorder.failures,
        grades=grades,
        seconds={"all": round(time.monotonic() - began, 2), "recording": round(recording, 2)},
    )
