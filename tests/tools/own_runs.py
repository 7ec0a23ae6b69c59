"""Records many runs of sample students for the part "Your own run", and looks at every question that they give.

`python tests/tools/own_runs.py lab2_executors lab5_qos --runs 10` records each right submission ten times, as the
notebook's cell does. It says how many questions a run gives, whether each key is what a replay of the run shows, and
how many of them somebody can answer who has no more than another run of the same programs. Exit status 1 if a key is
wrong.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import replay
import sample_class

from autograder.core.results import Isolation
from autograder.course.lab import Lab, load_lab
from autograder.grading.job import Job
from autograder.grading.own_runs import run_recorded
from autograder.own_run.keys import key
from autograder.own_run.question import Question
from autograder.own_run.questions import KINDS, chosen
from autograder.own_run.record import Record

WANTED = 4
"""The questions that each lab asks."""


def record(lab: Lab, student: str, seed: int) -> Record:
    """Run the cell that records a student's own run."""
    cell = sample_class.recording_cell(lab)
    job = Job(
        student=student, lab=lab.name, digest="", isolation=Isolation.NONE, seed=seed, files=files(lab, student),
        cells=[*(cell for cell in lab.cells if cell.points is None), cell],
    )  # fmt: skip
    checks, records = run_recorded(job, [cell.grade_id])
    assert records, [outcome.because for check in checks for outcome in check.outcomes]
    return records[0]


def files(lab: Lab, student: str) -> dict[str, str]:
    """The files of a student whose other answers are the solution's."""
    changed = sample_class.class_folder(lab.name) / student / "cells"
    answers = {name: answer.solution for name, answer in lab.answers.items()}
    for path in changed.glob("*") if changed.is_dir() else ():
        text, first = path.read_text(encoding="utf-8"), answers[path.stem].split("\n")[0]
        answers[path.stem] = text if text.startswith("%%") else f"{first}\n{text}"
    return lab.files_with(answers)


def right(lab: Lab) -> list[str]:
    """The sample students with all points."""
    full = {check.grade_id: check.points for check in lab.checks}
    return [name for name in sample_class.students(lab.name) if sample_class.expected(lab, name).points == full]


def possible(one: Record) -> Iterator[Question]:
    """Every question that may be asked about a record."""
    for kind in KINDS:
        yield from kind(one)


def guesses(records: list[Record]) -> tuple[int, int]:
    """How many of the chosen questions somebody answers from the other runs of the same programs, and of how many."""
    answers = [[(question, key(one, question)) for question in possible(one)] for one in records]
    hits = asked = 0
    for number, one in enumerate(records):
        others = defaultdict(list)
        for other, found in enumerate(answers):
            for question, answer in found if other != number else ():
                others[_same(question)].append((question, answer))
        for _, question in chosen([one], str(number), WANTED):
            asked += 1
            hits += _guess(question, others[_same(question)]) == key(one, question)
    return hits, asked


def _same(question: Question) -> tuple[str, str]:
    return question.kind, str({name: value for name, value in question.about.items() if isinstance(value, str)})


def _guess(question: Question, others: list[tuple[Question, str]]) -> str:
    """The best answer of somebody who has seen the answers to questions of this kind about other runs."""
    if "begin" in question.about and "end" in question.about and not question.choices and others:
        pace = statistics.median(int(a) / (float(q.about["end"]) - float(q.about["begin"])) for q, a in others)
        return str(round(pace * (float(question.about["end"]) - float(question.about["begin"]))))
    common = Counter(answer for _, answer in others if not question.choices or answer in question.choices)
    return common.most_common(1)[0][0] if common else (question.choices or ("1",))[0]


def main() -> int:
    """Record the runs and print what was found."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("labs", nargs="+")
    arguments.add_argument("--runs", type=int, default=4)
    arguments.add_argument("--save", type=Path, help="a folder for the records, as JSON")
    told = arguments.parse_args()
    wrong = 0
    for lab in (load_lab(sample_class.ROOT, name) for name in told.labs):
        runs = [(student, seed) for student in right(lab) for seed in range(told.runs)]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            records = list(pool.map(lambda run, lab=lab: record(lab, *run), runs))
        if told.save:
            told.save.mkdir(parents=True, exist_ok=True)
            for (student, seed), one in zip(runs, records, strict=True):
                (told.save / f"{lab.name}.{student}.{seed}.json").write_text(one.model_dump_json(), encoding="utf-8")
        keys = [(one, question) for one in records for question in possible(one)]
        bad = [(one, question) for one, question in keys if key(one, question) != replay.answer(one, question)]
        enough = [len(chosen([one], "any", WANTED)) for one in records]
        kinds = Counter(question.kind for one in records for _, question in chosen([one], "any", WANTED))
        groups = [
            [one for (name, _), one in zip(runs, records, strict=True) if name == student] for student in right(lab)
        ]
        hits, asked = map(sum, zip(*map(guesses, groups), strict=True))
        print(
            f"{lab.name}: {len(records)} runs of {len(groups)} right submissions, {len(keys)} possible questions,"
            f" {len(bad)} wrong keys; runs with 4, 3, fewer questions: {enough.count(4)}, {enough.count(3)},"
            f" {sum(number < 3 for number in enough)}; answered from another run: {hits} of {asked}; {dict(kinds)}"
        )  # fmt: skip
        for one, question in bad:
            print(f"  {question.text} {key(one, question)}, but {replay.answer(one, question)}")
        wrong += len(bad)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
