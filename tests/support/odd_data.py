"""Grades a lab's solutions whose programs send odd data: no check may break, whatever comes in.

`python tests/support/odd_data.py lab4_lifecycle --only nan` grades every check on every kind of oddness whose name
contains `nan`, and prints each check that broke; exit status 1 if one did. The programs are the solution's, with
`odd_prelude.py` at the head of each.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import kill_matrix
from places import ROOT

from autograder.core.results import CheckResult, Isolation, Status
from autograder.course.lab import Lab, load_lab
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker

PRELUDE = Path(__file__).with_name("odd_prelude.py").read_text(encoding="utf-8")
VALUES = ("negative", "nan", "infinite", "lowest", "empty", "huge")
KINDS = [
    *(f"messages {value} later" for value in VALUES),
    *(f"messages {value} all" for value in ("nan", "negative", "empty", "huge", "silent", "flood")),
    *(f"messages {how} some" for how in ("nan", "silent", "backwards", "twice", "unicode")),
    *(f"services {how} later" for how in ("negative", "empty", "silent")),
    *(f"logs {value} all" for value in ("huge", "silent", "unicode")),
    *(f"parameters {value} all" for value in ("text", "list", "nan", "huge", "undeclared")),
]
"""What is odd, how, and when: `all`, `later` (from the fourth of a topic on), or `some` (each third from there on)."""


def odd(text: str, kind: str) -> str:
    """A program that sends what is odd."""
    what, how, when = kind.split()
    begin = f"WHAT, ODD, WHEN = {what!r}, {how!r}, {when!r}\n{PRELUDE}"
    return f"exec(compile({begin!r}, 'odd', 'exec', dont_inherit=True), globals())\n{text}"


def graded(lab: Lab, kind: str, checks: Sequence[str] = ()) -> list[CheckResult]:
    """What the lab's checks, or these of them, make of the solution when it sends odd data."""
    solutions = {grade_id: answer.solution for grade_id, answer in lab.answers.items()}
    files = lab.files_with(solutions)
    own = {answer.file.file_name for answer in lab.answers.values() if answer.file is not None}
    files = {name: odd(text, kind) if name in own and is_node(name, text) else text for name, text in files.items()}
    return checked(lab, files, checks)


def checked(lab: Lab, files: dict[str, str], checks: Sequence[str] = ()) -> list[CheckResult]:
    """What the lab's checks make of these files, or some of them; by default all that launch programs."""
    wanted = checks or [cell.grade_id for cell in lab.checks if "launch" in cell.source]
    cells = [cell for cell in lab.cells if cell.points is None or cell.grade_id in wanted]
    job = Job(student="odd", lab=lab.name, digest="", isolation=Isolation.FULL, seed=1, files=files, cells=cells)
    return run_in_worker(job).checks


def is_node(name: str, text: str) -> bool:
    """Whether a file is a program that takes part in the graph, so that it has data to send."""
    return name.endswith(".py") and "import rclpy" in text and "from __future__" not in text


def broken(check: CheckResult) -> str:
    """Why the check broke; empty if it came to a verdict."""
    found = [outcome for outcome in check.outcomes if outcome.status is Status.UNKNOWN]
    return f"{found[0].title}: {found[0].because}" if found else ""


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("lab", choices=kill_matrix.labs())
    parser.add_argument("--only", action="append", default=[], help="kinds whose name contains this text")
    parser.add_argument("--check", action="append", default=[], help="this check only")
    parser.add_argument("--jobs", type=int, default=4)
    options = parser.parse_args()
    lab = load_lab(ROOT, options.lab)
    kinds = [kind for kind in KINDS if not options.only or any(text in kind for text in options.only)]
    fell = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        for kind, checks in zip(kinds, pool.map(lambda kind: graded(lab, kind, options.check), kinds), strict=True):
            for check in checks:
                if why := broken(check):
                    fell += 1
                    print(
                        f"{lab.name} {kind}: {check.grade_id} ({check.seconds:.0f} s, flags {len(check.flags)}) {why}",
                        flush=True,
                    )
            print(
                f"{lab.name} {kind}: {len(checks)} checks, {sum(check.points is None for check in checks)} undecided, "
                f"{sum(check.points == check.max_points for check in checks)} with full marks, "
                f"longest {max(check.seconds for check in checks):.0f} s",
                flush=True,
            )
    return 1 if fell else 0


if __name__ == "__main__":
    sys.exit(main())
