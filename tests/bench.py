"""Measures `autograder grade` against stock `nbgrader autograde`, in one run, on the same submissions of lab 2.

`make bench`. The stock course has the same check cells, but its `launch` starts each program by subprocess in the
kernel, and nbgrader runs one notebook after another. Hostile students are left out: stock execution would run them
unprotected. Both must give the same points for every check.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import sample_class
from rich.console import Console
from rich.table import Table

from autograder.core.results import SubmissionResult
from autograder.course.lab import grade_id_of, load_lab
from autograder.grading.store import ResultStore

LAB = "lab2_executors"
SET_UP = "setup"
BIN = Path(sys.prefix) / "bin"
# What a course without this kit's sandbox does: every program is a fresh process, its output goes to a file.
PLAIN_LAUNCH = """
import os, signal, subprocess, sys, tempfile
from pathlib import Path
from autograder.checks import runtime


class PlainProgram:
    def __init__(self, name, arguments, environment):
        self.name, self.began = name, 0.0
        self.file = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [sys.executable, f"{name}.py", *arguments], cwd="nodes", env={**os.environ, **environment},
            stdin=subprocess.DEVNULL, stdout=self.file, stderr=subprocess.STDOUT)
        self.pid = self.process.pid

    def running(self):
        return self.process.poll() is None

    def exit_status(self):
        return self.process.poll()

    def wait(self, timeout):
        try:
            self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            return False
        return True

    def signal(self, number):
        self.process.send_signal(number)

    def stop(self, grace=1.0):
        self.process.terminate()
        if not self.wait(grace):
            self.process.kill()
            self.process.wait()

    def output(self):
        self.file.seek(0)
        return self.file.read()

    def stopped_by(self):
        return ""

    def truncated(self):
        return False

    def events(self):
        return []

    def stacks(self, timeout=1.0):
        return ""


class PlainPrograms:
    def __init__(self):
        self.programs = []

    def start(self, program, args=(), env=None, cores=2):
        self.programs.append(PlainProgram(program, args, env or {}))
        return self.programs[-1]

    def group(self):
        return self

    def end(self):
        for program in self.programs:
            program.stop()
        self.programs.clear()

    close = end


runtime.current._sandbox = PlainPrograms()
"""


@dataclass
class Measured:
    """What one way of grading took."""

    seconds: float
    cpu: float
    points: dict[str, dict[str, float | None]]


def timed(command: list[str | Path], course: Path) -> tuple[float, float]:
    """Run a command in a course; return its wall-clock and CPU seconds, all its descendants included."""
    environ = os.environ | {"PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    with cpu_meter() as (prefix, cpu_seconds):
        began = time.monotonic()
        done = subprocess.run([*prefix, *command], cwd=course, env=environ, capture_output=True, text=True, check=False)
        seconds, cpu = time.monotonic() - began, cpu_seconds()
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return seconds, cpu


@contextlib.contextmanager
def cpu_meter() -> Iterator[tuple[list[str], Callable[[], float]]]:
    """Give the words to put before a command, and what tells the CPU seconds of it and its descendants.

    A control group counts them all. Where none can be made (it takes root), the machine's own count is taken, which is
    right only if nothing else runs: the kernel forgets the time of processes that end with their process namespace.
    """
    for hierarchy in (Path("/sys/fs/cgroup/cpuacct"), Path("/sys/fs/cgroup")):
        group = hierarchy / f"bench-{os.getpid()}"
        if not (hierarchy / "cgroup.procs").exists():
            continue
        try:
            group.mkdir()
        except OSError:
            continue
        join = ["/bin/sh", "-c", f'echo $$ > {group}/cgroup.procs; exec "$@"', "join"]
        try:
            yield join, functools.partial(_group_seconds, group)
        finally:
            wait_until_empty(group)
            group.rmdir()
        return
    before = machine_seconds()
    yield [], lambda: machine_seconds() - before


def _group_seconds(group: Path) -> float:
    nanoseconds = group / "cpuacct.usage"
    if nanoseconds.exists():
        return int(nanoseconds.read_text()) / 1e9
    return int((group / "cpu.stat").read_text().split("usage_usec ")[1].split()[0]) / 1e6


def wait_until_empty(group: Path) -> None:
    """Wait, at most 30 s, until no process is left in the group: only then can it be removed."""
    deadline = time.monotonic() + 30
    while (group / "cgroup.procs").read_text() and time.monotonic() < deadline:
        time.sleep(0.05)


def machine_seconds() -> float:
    """CPU seconds since the machine started, of all that ran on it."""
    user, nice, system, _idle, _iowait, *interrupts = map(
        int, Path("/proc/stat").read_text().splitlines()[0].split()[1:]
    )
    return (user + nice + system + sum(interrupts[:2])) / os.sysconf("SC_CLK_TCK")


def course(folder: Path, *, plain: bool) -> Path:
    """Make a course with lab 2 alone; a plain one starts programs by subprocess."""
    source = folder / "solutions" / LAB / f"{LAB}.ipynb"
    source.parent.mkdir(parents=True)
    shutil.copyfile(sample_class.ROOT / "solutions" / LAB / source.name, source)
    if plain:
        notebook = json.loads(source.read_text())
        cell = next(cell for cell in notebook["cells"] if grade_id_of(cell) == SET_UP)
        cell["source"] = "".join(cell["source"]) + "\n" + PLAIN_LAUNCH
        source.write_text(json.dumps(notebook))
    return folder


def ours(folder: Path, students: list[str]) -> Measured:
    """Grade by this kit."""
    root = course(folder, plain=False)
    lab = load_lab(root, LAB)
    for student in students:
        sample_class.build_student(lab, student, root / "handed_in")
    seconds, cpu = timed([BIN / "autograder", "grade", LAB, root / "handed_in", "--force"], root)
    results = {student: SubmissionResult.load(ResultStore(root).path(LAB, student)) for student in students}
    return Measured(
        seconds, cpu, {name: {c.grade_id: c.points for c in result.checks} for name, result in results.items()}
    )


def stock(folder: Path, students: list[str]) -> Measured:
    """Grade by nbgrader's own pipeline."""
    root = course(folder, plain=True)
    lab = load_lab(root, LAB)
    for student in students:
        sample_class.build_student(lab, student, root / "handed_in")
        (root / "submitted" / student).mkdir(parents=True)
        (root / "handed_in" / student).rename(root / "submitted" / student / LAB)
    source = "--CourseDirectory.source_directory=solutions"
    timed([BIN / "nbgrader", "generate_assignment", LAB, source], root)
    seconds, cpu = timed([BIN / "nbgrader", "autograde", LAB, source], root)
    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as gradebook:
        points = {
            student: {
                grade.name: grade.auto_score
                for notebook in gradebook.find_submission(LAB, student).notebooks
                for grade in notebook.grades
            }
            for student in students
        }
    return Measured(seconds, cpu, points)


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--students", type=int, default=20, help="how many of the class, evenly chosen; 0: all")
    options = parser.parse_args()
    tame = [name for name in sample_class.students(LAB) if name.startswith(("solution", "correct", "blank", "e", "m"))]
    count = options.students or len(tame)
    students = [tame[index * len(tame) // count] for index in range(min(count, len(tame)))]
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        mine = ours(Path(folder, "ours"), students)
        theirs = stock(Path(folder, "stock"), students)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    table = Table("", "this kit", "stock nbgrader", "ratio", box=None)
    size = len(students)
    rows = (
        ("submissions a minute", 60 * size / mine.seconds, 60 * size / theirs.seconds, theirs.seconds / mine.seconds),
        ("CPU seconds a submission", mine.cpu / size, theirs.cpu / size, theirs.cpu / mine.cpu),
        ("seconds in all", mine.seconds, theirs.seconds, theirs.seconds / mine.seconds),
    )
    for name, a, b, ratio in rows:
        table.add_row(name, f"{a:.2f}", f"{b:.2f}", f"{ratio:.1f}x")
    console.print(f"{size} submissions of {LAB}, {len(os.sched_getaffinity(0))} cores: {', '.join(students)}")
    console.print(table)
    cores = len(os.sched_getaffinity(0))
    console.print(f"Floor by CPU alone: {60 * cores * size / mine.cpu:.1f} submissions a minute on {cores} cores.")
    different = [
        f"{student}: {check}: {points} here, {theirs.points[student].get(check)} there"
        for student, checks in mine.points.items()
        for check, points in checks.items()
        if points != theirs.points[student].get(check)
    ]
    console.print("The points are the same everywhere." if not different else "\n".join(different))
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
