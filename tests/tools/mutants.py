"""Grades every mutant of a lab's solutions: a survivor is a missing check, something not asked, or the same program.

`make mutants LAB=lab2_executors`. Survivors are decided one by one in `tests/classes/<lab>/survivors.yaml`, so that
only new ones show; exit status 1 if there are any. What each mutant was told stands in `build/mutants/<lab>.json`.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import kill_matrix
import sample_class
import yaml
from places import ROOT
from rich.progress import track

from autograder.authoring.mutation.mutants import handed_in, mutants, reached
from autograder.authoring.mutation.rules import Mutant
from autograder.core.files import write_beside
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker

VERDICTS = ("missing", "not asked", "same")
"""A requirement that nothing checks yet; something that the text leaves open; a program that behaves the same."""


def survivors_file(lab: str) -> Path:
    """Where a lab's survivors are decided."""
    return sample_class.class_folder(lab) / "survivors.yaml"


def decided(lab: str) -> dict[str, str]:
    """Verdict by the key of a survivor."""
    path = survivors_file(lab)
    told = yaml.safe_load(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return {key: verdict for verdict, keys in (told or {}).items() for key in keys or []}


def grade(lab: Lab, mutant: Mutant, seed: int) -> SubmissionResult:
    """Run the checks that the change can reach."""
    job = Job(
        student="mutant",
        lab=lab.name,
        digest="",
        isolation=Isolation.FULL,
        seed=seed,
        files=handed_in(lab, mutant),
        cells=reached(lab, [mutant.answer]),
    )
    return run_in_worker(job)


def told(mutant: Mutant, result: SubmissionResult) -> dict[str, Any]:
    """What became of a mutant, as the page of the run holds it."""
    lost = [check for check in result.checks if check.points is not None and check.points < check.max_points]
    first = next((check.first_failure for check in lost if check.first_failure), None)
    undecided = any(check.points is None for check in result.checks)
    return {
        "key": mutant.key,
        "fate": "killed" if lost else "undecided" if undecided else "survived",
        "checks": [check.grade_id for check in lost],
        "code": first.code if first else "",
        "because": first.because if first else "",
        "hint": first.hint if first else "",
    }


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("lab", choices=kill_matrix.labs())
    parser.add_argument("--only", default="", help="mutants whose key contains this text")
    parser.add_argument("--every", type=int, default=1, help="only each so many-th mutant")
    parser.add_argument("--jobs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="only list the mutants")
    options = parser.parse_args()
    lab = load_lab(ROOT, options.lab)
    chosen = [mutant for mutant in mutants(lab) if options.only in mutant.key][:: options.every]
    if options.list:
        print(*[mutant.key for mutant in chosen], sep="\n")
        return 0
    with ThreadPoolExecutor(options.jobs) as pool:
        runs = pool.map(lambda mutant: told(mutant, grade(lab, mutant, options.seed)), chosen)
        found = list(track(runs, total=len(chosen), description=lab.name))
    write_beside(
        ROOT / "build" / "mutants" / f"{lab.name}.json", json.dumps(found, indent=1, ensure_ascii=False) + "\n"
    )
    return _report(lab, found)


def _report(lab: Lab, found: list[dict[str, Any]]) -> int:
    verdicts = decided(lab.name)
    alive = [one for one in found if one["fate"] != "killed"]
    kinds = Counter(verdicts.get(one["key"], "new") for one in alive)
    killed = len(found) - len(alive)
    open_ones = kinds["new"] + kinds["missing"]
    rate = killed / (killed + open_ones) if killed + open_ones else 1.0
    print(
        f"{lab.name}: {len(found)} mutants, {killed} killed, " + ", ".join(f"{n} {kind}" for kind, n in kinds.items())
    )
    print(f"{rate:.1%} of those that break a requirement are killed")
    for one in alive:
        if one["key"] not in verdicts:
            print(f"  {one['fate']}: {one['key']}")
    return 1 if kinds["new"] else 0


if __name__ == "__main__":
    sys.exit(main())
