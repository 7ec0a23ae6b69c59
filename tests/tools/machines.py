"""Grades a lab's sample class on worse machines than this one: no verdict may be another, but for "could not find out".

`make machines LAB=lab2_executors`, or `python tests/tools/machines.py lab2_executors m03_a_third_a_part --on half`.
The machines are this one as it is, with a quota of half a CPU, with one of a quarter, and beside 30 busy loops. A quota
needs a control group that may be made (cgroups(7), in either version). What each student must get stands in the sample
class. Exit status 1 if a verdict differs.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from rich.console import Console
from soak import BUSY

from autograder.core.results import CheckResult
from autograder.course.lab import Lab, load_lab
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings

PERIOD = 100_000
"""Microseconds of a quota's period."""
V1, V2 = Path("/sys/fs/cgroup/cpu"), Path("/sys/fs/cgroup")


@dataclass(frozen=True)
class Machine:
    """What is made of this machine."""

    quota: float = 0.0
    """CPUs that all of the kit may have together; 0: all."""
    loops: int = 0
    """Busy loops beside it."""


MACHINES = {"quiet": Machine(), "half": Machine(0.5), "quarter": Machine(0.25), "busy": Machine(loops=30)}


@contextlib.contextmanager
def made(machine: Machine) -> Iterator[list[str]]:
    """Make it, and give the words of a command that run another command on it.

    Raises:
        OSError: no control group can be made.
    """
    loops = [subprocess.Popen([sys.executable, "-c", BUSY], stdin=subprocess.PIPE) for _ in range(machine.loops)]
    try:
        if not machine.quota:
            yield []
            return
        old = (V1 / "cpu.cfs_quota_us").exists() or (V1 / "tasks").exists()
        group = (V1 if old else V2) / f"autograder-machines-{os.getpid()}"
        group.mkdir()
        try:
            quota = int(machine.quota * PERIOD)
            if old:
                (group / "cpu.cfs_period_us").write_text(str(PERIOD))
                (group / "cpu.cfs_quota_us").write_text(str(quota))
            else:
                (group / "cpu.max").write_text(f"{quota} {PERIOD}")
            yield ["sh", "-c", f'echo $$ > {group / "cgroup.procs"} && exec "$@"', "sh"]
        finally:
            _remove(group)
    finally:
        for loop in loops:
            loop.kill()
            loop.communicate()


def _remove(group: Path) -> None:
    """Remove a control group once what ran in it has ended."""
    deadline = time.monotonic() + 60
    while group.exists():
        try:
            group.rmdir()
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)


def graded(lab: Lab, students: Sequence[str]) -> dict[str, list[CheckResult]]:
    """Grade students of the sample class, as a class, on the machine that this process has."""
    with tempfile.TemporaryDirectory(prefix="machines-") as folder:
        notebooks = {}
        for student in students:
            home = sample_class.build_student(lab, student, Path(folder, "submitted"))
            notebooks[student] = next(iter(sorted(home.glob("*.ipynb"))), home / f"{lab.name}.ipynb")
        results = run_class(notebooks, Path(folder), lab, Settings(force=True), lambda _: None)
    return {student: result.checks for student, result in results.items()}


def compared(lab: Lab, results: dict[str, list[CheckResult]], console: Console) -> tuple[int, int, int, int]:
    """Print verdicts that differ; return how many checks there are, differ, are undecided, and were run again."""
    number = differ = unknown = again = 0
    for student, checks in sorted(results.items()):
        points = sample_class.expected(lab, student).points
        for check in checks:
            wanted = points[check.grade_id]
            number, again = number + 1, again + check.run_again
            if check.points == wanted:
                continue
            failure = check.first_failure
            unknown, differ = unknown + (check.points is None), differ + (check.points is not None)
            why = f"{failure.code}: {failure.title}: {failure.because}" if failure is not None else ""
            console.print(f"  {student} {check.grade_id}: {check.points} for {wanted}. {why}", markup=False)
    return number, differ, unknown, again


def run(lab: Lab, name: str, students: Sequence[str], console: Console) -> int:
    """Grade on one machine, tell what came of it, and return how many verdicts differ."""
    began = time.monotonic()
    here = [sys.executable, __file__, lab.name, *students, "--here"]
    with made(MACHINES[name]) as on_it:
        said = subprocess.run([*on_it, *here], stdout=subprocess.PIPE, check=True).stdout
    results = {
        student: [CheckResult.model_validate(check) for check in checks] for student, checks in json.loads(said).items()
    }
    number, differ, unknown, again = compared(lab, results, console)
    console.print(
        f"{lab.name}, {name}: {number} checks in {time.monotonic() - began:.0f} s, {differ} differ, {unknown} could not"
        f" be decided ({unknown / number:.1%}), {again} were run again alone ({again / number:.1%})"
    )
    return differ


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("lab")
    parser.add_argument("students", nargs="*", help="default: the whole sample class")
    parser.add_argument("--on", nargs="+", choices=MACHINES, default=list(MACHINES), help="default: all machines")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    lab = load_lab(sample_class.ROOT, options.lab)
    everyone = sample_class.students(lab.name)
    if unknown := sorted(set(options.students) - set(everyone)):
        parser.error(f"{lab.name} has no sample student {', '.join(unknown)}")
    students = options.students or everyone
    if options.here:
        checks = graded(lab, students)
        out = {student: [check.model_dump(mode="json") for check in one] for student, one in checks.items()}
        print(json.dumps(out))
        return 0
    console = Console(width=None if sys.stdout.isatty() else 240, highlight=False)
    differ = 0
    for name in options.on:
        try:
            differ += run(lab, name, students, console)
        except PermissionError as error:
            console.print(f"{name}: left out, because no control group can be made here: {error}.")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
