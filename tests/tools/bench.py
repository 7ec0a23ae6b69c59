"""Measures `autograder grade` against stock `nbgrader autograde`, in one run, on the same submissions of lab 2.

`make bench`. The stock course has the same check cells, but its `launch` starts each program by subprocess in the
kernel, and nbgrader runs one notebook after another. Hostile students are left out: stock execution would run them
unprotected. Both must give the same points for every check.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from boxes import RUN_STDIN
from cpu_meter import cpu_meter, shares_of_cpu
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from autograder.core.results import Isolation, SubmissionResult
from autograder.course.cells import grade_id_of
from autograder.course.lab import lab_names, load_lab
from autograder.gradebook.own_courses import prepare_nbgrader
from autograder.grading.store import ResultStore
from autograder.sandbox.grading_sandbox import run_in_sandbox

prepare_nbgrader()
from nbgrader.api import Gradebook  # noqa: E402

LAB = "lab2_executors"
SET_UP = "setup"
BIN = Path(sys.prefix) / "bin"
# What a course without this kit's sandbox does: every program is a fresh process, its output goes to a file.
PLAIN_LAUNCH = """
import os, signal, subprocess, sys, tempfile
from pathlib import Path
from autograder.checks import current


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


current.check._sandbox = PlainPrograms()
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
    if command[0] == BIN / "nbgrader":  # stock: otherwise this environment leads it to the kit
        environ["JUPYTER_NO_CONFIG"] = "1"
    with cpu_meter() as (prefix, cpu_seconds):
        began = time.monotonic()
        done = subprocess.run([*prefix, *command], cwd=course, env=environ, capture_output=True, text=True, check=False)
        seconds, cpu = time.monotonic() - began, cpu_seconds()
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return seconds, cpu


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


def tame_students(count: int) -> list[str]:
    """So many of the sample class, evenly chosen, and nobody hostile; 0: all of them."""
    tame = [name for name in sample_class.students(LAB) if name.startswith(("solution", "correct", "blank", "e", "m"))]
    tame.remove("correct_own_module")  # the cell of the module is the notebook's last: stock nbgrader runs it too late
    count = min(count or len(tame), len(tame))
    return [tame[index * len(tame) // count] for index in range(count)]


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


def stock(folder: Path, students: list[str], at_once: int) -> Measured:
    """Grade by nbgrader's own pipeline, in as many courses side by side as are asked for: one gradebook takes one."""
    shares = [students[number::at_once] for number in range(at_once) if students[number::at_once]]
    roots = [course(folder / str(number), plain=True) for number in range(len(shares))]
    lab = load_lab(roots[0], LAB)
    source = "--CourseDirectory.source_directory=solutions"
    for root, share in zip(roots, shares, strict=True):
        for student in share:
            sample_class.build_student(lab, student, root / "handed_in")
            (root / "submitted" / student).mkdir(parents=True)
            (root / "handed_in" / student).rename(root / "submitted" / student / LAB)
        timed([BIN / "nbgrader", "generate_assignment", LAB, source], root)
    began = time.monotonic()
    with ThreadPoolExecutor(len(roots)) as pool:
        took = list(pool.map(lambda root: timed([BIN / "nbgrader", "autograde", LAB, source], root), roots))
    seconds = time.monotonic() - began
    points: dict[str, dict[str, float | None]] = {}
    for root, share in zip(roots, shares, strict=True):
        with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as gradebook:
            for student in share:
                notebooks = gradebook.find_submission(LAB, student).notebooks
                points[student] = {grade.name: grade.auto_score for book in notebooks for grade in book.grades}
    return Measured(seconds, sum(cpu for _, cpu in took), points)


def recording(root: Path, students: list[str]) -> Measured:
    """Record results that are there already, as after a gradebook was lost: nbgrader's stage and the feedback."""
    shutil.rmtree(root / "build" / "autograded")
    (root / "gradebook" / "gradebook.db").unlink()
    seconds, cpu = timed([BIN / "autograder", "grade", LAB, root / "handed_in"], root)
    return Measured(seconds, cpu, {student: {} for student in students})


def alone(folder: Path, lab_name: str) -> Measured:
    """Check one complete solution, as a student or an instructor does who waits for it."""
    lab = load_lab(sample_class.ROOT, lab_name)
    path = sample_class.build_student(lab, "solution", folder) / f"{lab_name}.ipynb"
    seconds, cpu = timed([BIN / "autograder", "check", path, "--course", sample_class.ROOT], sample_class.ROOT)
    return Measured(seconds, cpu, {})


def observers(launches: int, seconds: float) -> float:
    """CPU seconds of the observers of so many launches, each of which sees nothing for so long."""
    watch = (
        "import time\nfrom autograder.checks import current\nfrom autograder.graph.observer import Observer\n"
        f"began = time.process_time()\nfor _ in range({launches}):\n"
        f"    one = Observer(7)\n    one.pause({seconds})\n    one.close()\nprint(time.process_time() - began)\n"
    )
    run = run_in_sandbox([*RUN_STDIN], watch.encode(), Isolation.FULL, 60.0 + 2 * launches * seconds)
    return float(run.stdout.split()[0])


def rows(mine: Measured, recorded: Measured, one: Measured, many: Measured, size: int) -> Iterator[tuple[str, ...]]:
    """The figures that the project aims at, with what was measured."""
    yield "throughput, stock one after another", f"{one.seconds / mine.seconds:.1f} x", "25 x"
    yield "throughput, stock as many at once as fill the machine", f"{many.seconds / mine.seconds:.1f} x", "5 x"
    yield "CPU seconds a submission", f"{mine.cpu / size:.2f} (stock {one.cpu / size:.2f})", "2.0"
    yield "nbgrader's stage with feedback, CPU seconds a submission", f"{recorded.cpu / size:.2f}", "0.2"


def main() -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--students", type=int, default=20, help="how many of the class, evenly chosen; 0: all")
    options = parser.parse_args()
    students = tame_students(options.students)
    size, cores = len(students), len(os.sched_getaffinity(0))
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        with shares_of_cpu() as parts:
            mine = ours(folder / "ours", students)
        recorded = recording(folder / "ours", students)
        one = stock(folder / "stock", students, 1)
        many = stock(folder / "many", students, min(size, 2 * cores))
        solutions = {lab: alone(folder, lab) for lab in lab_names(sample_class.ROOT)}
    parts["not seen: ended between two looks"] = max(0.0, mine.cpu - sum(parts.values()))
    table = Table("", "measured", "aim", box=None)
    for row in rows(mine, recorded, one, many, size):
        table.add_row(*row)
    for lab, measured in solutions.items():
        table.add_row(f"complete solution alone, {lab}", f"{measured.seconds:.1f} s, {measured.cpu:.1f} CPU s", "7 s")
    floor = parts["students' programs"] / size + observers(9, 1.2)
    over = mine.cpu / size / floor
    table.add_row(
        "CPU over the floor: programs, and the observers of nine launches", f"{over:.1f} x of {floor:.2f} s", "1.5 x"
    )
    load = os.getloadavg()[1]
    console.print(f"{size} submissions of {LAB}, {cores} cores, load {load:.0f}: {', '.join(students)}")
    console.print(table)
    console.print("CPU seconds a submission by part: " + ", ".join(f"{n} {s / size:.2f}" for n, s in parts.items()))
    console.print(
        f"By CPU alone: {60 * cores * size / mine.cpu:.1f} submissions a minute. Picture: {plot(parts, size)}"
    )
    different = [
        f"{student}: {check}: {points} here, {theirs.points[student].get(check)} there"
        for theirs in (one, many)
        for student, checks in mine.points.items()
        for check, points in checks.items()
        if points != theirs.points[student].get(check)
    ]
    console.print("The points are the same everywhere." if not different else "\n".join(different))
    return 1 if different else 0


def plot(parts: dict[str, float], size: int) -> Path:
    """Draw where the CPU seconds of a submission go; return where the picture is."""
    figure = Figure(figsize=(8, 0.5 * len(parts) + 1), layout="constrained")
    axes = figure.subplots()
    bars = axes.barh(list(parts), [seconds / size for seconds in parts.values()], color="#0072B2")
    axes.bar_label(bars, fmt="%.2f", padding=3)
    axes.invert_yaxis()
    axes.set_xlabel("CPU seconds a submission")
    path = sample_class.ROOT / "build" / "bench.svg"
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    sys.exit(main())
