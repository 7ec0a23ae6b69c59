"""Plant mistakes in checks, and count how many of them a bank of past answers stops.

`python tests/tools/planted_mistakes.py [--answers 6] [--jobs 3] [--once] [--only NUMBER …]` takes the mistakes of
`planted_mistakes.yaml`. The bank holds the same number of answers of each lab. A rule picks them from the sample class,
whatever the mistakes are: the solution, the first other right answer, the unfinished one, and then the students with
mistakes, in the order of their names. Each check with a mistake runs on all of these answers. A mistake is stopped if
`make bank` would list a difference. The unchanged checks run twice, so that false alarms are counted as well.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from places import ROOT

from autograder.authoring.bank import Banked, Difference, differences, verdict
from autograder.authoring.mutation.mutants import using
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
    if number == 0:
        return [name for name in ("solution", *right, "partial") if name in names] + wrong
    return [name for name in ("solution", *right[:1], "partial") if name in names] + wrong[: number - 3]


def different(lab: Lab, check: Cell, students: dict[str, Path]) -> dict[str, Path]:
    """Return the students without those who hand in the same as an earlier one to this check."""
    names, found = sorted(using(lab, check)), {}
    for student, path in students.items():
        sources = read_submission(path, lab).sources
        found.setdefault(tuple(sources[name] for name in names), (student, path))
    return dict(found.values())


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


def knowing_less(bank: dict[str, Banked], *unknown: str) -> dict[str, Banked]:
    """Return a bank that does not know some parts of the verdicts."""
    return {
        name: entry.model_copy(
            update={
                "verdicts": {
                    check: one.model_copy(update=dict.fromkeys(unknown)) for check, one in entry.verdicts.items()
                }
            }
        )
        for name, entry in bank.items()
    }


def tried(mistake: Mistake, asked: argparse.Namespace, folder: Path) -> Counter[str]:
    """Plant a mistake, print what the bank finds, and return which kinds of a bank stop it."""
    lab = load_lab(ROOT, mistake.lab)
    names = chosen_answers(lab.name, asked.answers)
    made = {name: sample_class.build_student(lab, name, folder) / f"{lab.name}.ipynb" for name in names}
    students = different(lab, next(one for one in lab.checks if one.grade_id == mistake.check), made)
    before = run(lab, lab.cells, students, mistake.check, asked.jobs)
    again = [] if asked.once else run(lab, lab.cells, students, mistake.check, asked.jobs)
    after = run(lab, mistake.planted(lab.cells), students, mistake.check, asked.jobs)
    bank = {result.student: banked(result) for result in before}
    banks = {
        "by all that the bank knows": bank,
        "without the numbers of expectations": knowing_less(bank, "expectations"),
        "by points alone": knowing_less(bank, "parts", "codes", "expectations"),
    }
    found = {kind: compared(one, after) for kind, one in banks.items()}
    alarms = compared(bank, again)
    said = "; ".join(f"{kind} {'stopped' if one else 'NOT stopped'}" for kind, one in found.items())
    print(f"{mistake.check}, {mistake.kind}: {mistake.about} ({len(students)} different answers): {said}")
    for label, one in (
        *(("", one) for one in found["by all that the bank knows"]),
        *(("ALARM ", one) for one in alarms),
    ):
        print(f"  {label}{one.entry}: {'; '.join(one.changes)}")
    sys.stdout.flush()
    return Counter({kind: 1 for kind, one in found.items() if one} | {"false alarms": len(alarms)})


def main() -> int:
    """Run the experiment, and print a line for each mistake and the figures at the end."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--answers", type=int, default=6, help="how many answers of each lab the bank holds; 0: all")
    parser.add_argument("--once", action="store_true", help="do not run the unchanged checks again")
    parser.add_argument("--jobs", type=int, default=3, help="how many answers run at once")
    parser.add_argument("--only", type=int, nargs="*", help="the numbers of the mistakes, from 1; default: all")
    asked = parser.parse_args()
    mistakes = [Mistake(**one) for one in yaml.safe_load(LIST.read_text(encoding="utf-8"))]
    chosen = [mistakes[number - 1] for number in asked.only] if asked.only else mistakes
    figures: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="bank-") as folder:
        for mistake in chosen:
            figures += tried(mistake, asked, Path(folder))
    print(f"{len(chosen)} mistakes; stopped or false alarms: {dict(figures)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
