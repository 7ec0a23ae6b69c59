"""Plant mistakes in checks, and count how many of them a bank of past answers stops.

`python tests/tools/planted_mistakes.py [--answers 6] [--jobs 3] [--only NUMBER …]` takes the mistakes of
`planted_mistakes.yaml`. The bank holds the same number of answers of each lab. A rule picks them from the sample class,
whatever the mistakes are: the solution, the first other right answer, the unfinished one, and then the students with
mistakes, in the order of their names. Each check with a mistake runs on all of these answers. A mistake is stopped if
`make bank` would list a difference. The unchanged checks run twice, so that false alarms are counted as well.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from places import ROOT

from autograder.authoring.bank import Banked, Difference, differences, verdict
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Cell, Lab, load_lab
from autograder.grading.class_runner import run_jobs
from autograder.grading.executors.local import Local
from autograder.grading.runner import Settings, job_of
from autograder.sandbox.isolation import choose
from autograder.submission.reader import read_submission

LIST = Path(__file__).with_suffix(".yaml")


@dataclass(frozen=True)
class Mistake:
    """A mistake in a check."""

    lab: str
    check: str
    kind: str
    about: str
    old: str
    new: str

    def planted(self, cells: Sequence[Cell]) -> list[Cell]:
        """Return the cells of the lab with this mistake in the check."""
        found = []
        for cell in cells:
            if cell.grade_id == self.check:
                assert cell.source.count(self.old) == 1, f"{self.check}: {self.old!r} is not in it, or not once"
                cell = cell.model_copy(update={"source": cell.source.replace(self.old, self.new)})
            found.append(cell)
        return found


def chosen_answers(lab: str, number: int) -> list[str]:
    """Return the students whose answers are in the bank."""
    names = sample_class.students(lab)
    right = [name for name in names if name.startswith("correct")]
    wrong = [name for name in names if name.startswith("m")]
    return [name for name in ("solution", *right[:1], "partial") if name in names] + wrong[: number - 3]


def run(lab: Lab, cells: Sequence[Cell], students: dict[str, Path], check: str, jobs: int) -> list[SubmissionResult]:
    """Run one check on the answers of some students."""
    settings = Settings(isolation=choose(Isolation.FULL), jobs=jobs)
    wanted = [cell for cell in cells if cell.points is None or cell.grade_id == check]
    made = [job_of(read_submission(path, lab), name, lab, settings) for name, path in students.items()]
    return list(run_jobs(Local(jobs), [job.model_copy(update={"cells": wanted}) for job in made]))


def banked(result: SubmissionResult) -> Banked:
    """Return the entry of a result whose points nobody changed."""
    points = {one.grade_id: one.points for one in result.checks}
    return Banked(sources={}, own={}, points=points, verdicts={one.grade_id: verdict(one) for one in result.checks})


def compared(bank: dict[str, Banked], results: Sequence[SubmissionResult]) -> list[Difference]:
    """Return what `make bank` would list."""
    return [one for result in results for one in differences(result.student, bank[result.student], result)]


def by_points(bank: dict[str, Banked], results: Sequence[SubmissionResult]) -> list[Difference]:
    """Return what a bank would list that knows only the points of the checks."""
    return compared({name: entry.model_copy(update={"verdicts": {}}) for name, entry in bank.items()}, results)


def main() -> int:
    """Run the experiment, print a line for each mistake, and the figures at the end."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--answers", type=int, default=6, help="how many answers of each lab the bank holds")
    parser.add_argument("--jobs", type=int, default=3, help="how many answers run at once")
    parser.add_argument("--only", type=int, nargs="*", help="the numbers of the mistakes, from 1; default: all")
    asked = parser.parse_args()
    mistakes = [Mistake(**one) for one in yaml.safe_load(LIST.read_text(encoding="utf-8"))]
    stopped = points_only = false_alarms = 0
    with tempfile.TemporaryDirectory(prefix="bank-") as folder:
        for number, mistake in enumerate(mistakes, 1):
            if asked.only and number not in asked.only:
                continue
            lab = load_lab(ROOT, mistake.lab)
            students = {
                name: sample_class.build_student(lab, name, Path(folder)) / f"{lab.name}.ipynb"
                for name in chosen_answers(lab.name, asked.answers)
            }
            before, again = (run(lab, lab.cells, students, mistake.check, asked.jobs) for _ in range(2))
            bank = {result.student: banked(result) for result in before}
            alarms = compared(bank, again)
            after = run(lab, mistake.planted(lab.cells), students, mistake.check, asked.jobs)
            found, with_points = compared(bank, after), by_points(bank, after)
            stopped, points_only = stopped + bool(found), points_only + bool(with_points)
            false_alarms += len(alarms)
            said = ["stopped" if one else "not stopped" for one in (found, with_points)]
            print(f"{number} {mistake.check}, {mistake.kind}: {mistake.about}: {said[0]}; by points alone {said[1]}")
            for label, one in (*(("", one) for one in found), *(("false alarm: ", one) for one in alarms)):
                print(f"  {label}{one.entry}: {'; '.join(one.changes)}", flush=True)
    tried = len(asked.only or mistakes)
    print(
        f"{stopped} of {tried} stopped; {points_only} by points alone; {false_alarms} false alarms of unchanged checks"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
