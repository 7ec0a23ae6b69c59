"""Grades every sample student many times, half of them beside four busy loops: no score and no status may differ.

`make soak N=20`, `make soak N=4 LAB=lab2_executors`. Exit status 1 if anything differs from round to round.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import kill_matrix
import sample_class
from rich.console import Console
from rich.table import Table

from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings

BUSY_LOOPS = 4
# Not to outlive this program, however it ends: standard input closes then.
BUSY = """
import os, threading
threading.Thread(target=lambda: (os.read(0, 1), os._exit(0)), daemon=True).start()
while True:
    pass
"""

Signature = tuple[tuple[str, float | None, tuple[str, ...]], ...]


def signature(result: SubmissionResult) -> Signature:
    """What may not differ: points of every check and the status of its outcomes, one after the other.

    A check that asks until something happens may ask once more on a busy machine: equal neighbours count as one.
    """
    return tuple(
        (
            check.grade_id,
            check.points,
            tuple(status for status, _ in groupby(each.status.value for each in check.outcomes)),
        )
        for check in result.checks
    )


def reasons(result: SubmissionResult) -> tuple[str, ...]:
    """The code of each check's first failure."""
    return tuple(check.first_failure.code if check.first_failure else "" for check in result.checks)


@contextlib.contextmanager
def load(busy: bool) -> Iterator[None]:
    """Keep the cores busy meanwhile."""
    loops = [
        subprocess.Popen([sys.executable, "-c", BUSY], stdin=subprocess.PIPE) for _ in range(BUSY_LOOPS if busy else 0)
    ]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.communicate()


def soak(lab: Lab, times: int, console: Console) -> bool:
    """Grade a lab's class `times` times, print the table, and return whether everything was the same every time."""
    results: dict[str, list[SubmissionResult]] = {}
    seconds: dict[bool, list[float]] = {False: [], True: []}
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        notebooks = {}
        for student in sample_class.students(lab.name):
            made = sample_class.build_student(lab, student, Path(folder, "submitted"))
            notebooks[student] = next(iter(sorted(made.glob("*.ipynb"))), made / f"{lab.name}.ipynb")
        for number in range(times):
            busy = number % 2 == 1
            began = time.monotonic()
            with load(busy):
                run_class(
                    notebooks,
                    Path(folder),
                    lab,
                    Settings(force=True),
                    lambda result: results.setdefault(result.student, []).append(result),
                )
            seconds[busy].append(time.monotonic() - began)
            console.print(f"{lab.name}: round {number + 1} of {times}, {seconds[busy][-1]:.0f} s{', busy' * busy}")
    table = Table("student", "times", "scores", "statuses", "reasons", title=lab.name, box=None, title_justify="left")
    same = True
    for student, graded_times in sorted(results.items()):
        scores = Counter(f"{result.points:g}" for result in graded_times)
        kinds = {signature(result) for result in graded_times}
        why = {reasons(result) for result in graded_times}
        same = same and len(kinds) == 1
        table.add_row(
            student,
            str(len(graded_times)),
            " ".join(score if len(scores) == 1 else f"{score} ({times})" for score, times in sorted(scores.items())),
            "identical" if len(kinds) == 1 else f"DIFFER: {', '.join(sorted(differing(kinds)))}",
            "identical" if len(why) == 1 else f"{len(why)} kinds",
        )
    console.print(table)
    for busy, took in seconds.items():
        if took:
            console.print(f"{'busy' if busy else 'quiet'} rounds: {sum(took) / len(took):.0f} s on average")
    return same


def differing(kinds: set[Signature]) -> set[str]:
    """The grade_ids of the checks that came out in several ways."""
    return {first[0] for checks in zip(*kinds, strict=True) for first in checks if len(set(checks)) > 1}


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--lab", choices=kill_matrix.labs(), help="default: every lab that has a sample class")
    options = parser.parse_args()
    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    labs = [options.lab] if options.lab else kill_matrix.labs()
    same = [soak(load_lab(sample_class.ROOT, name), options.times, console) for name in labs]
    console.print("Everything was the same every time." if all(same) else "Something differed.")
    return 0 if all(same) else 1


if __name__ == "__main__":
    sys.exit(main())
