"""Grades submissions of lab 2 by this kit and by stock nbgrader, for `make bench`.

The stock course has the same check cells, but its `launch` starts each program by subprocess in the
kernel, and nbgrader runs one notebook after another. Hostile students are left out: stock execution would run them
unprotected. Both must give the same points for every check.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import sample_class
from cpu_meter import cpu_meter

from autograder.core.results import SubmissionResult
from autograder.course.cells import grade_id_of
from autograder.course.lab import load_lab
from autograder.gradebook.own_courses import prepare_nbgrader
from autograder.grading.store import ResultStore

prepare_nbgrader()
from nbgrader.api import Gradebook  # noqa: E402

LAB = "lab2_executors"
SET_UP = "setup"
BIN = Path(sys.prefix) / "bin"
# What a course without this kit's sandbox does: every program is a fresh process, its output goes to a file.
PLAIN_LAUNCH = """
import os, signal, subprocess, sys, tempfile, time
from pathlib import Path
from autograder.checks import current


class PlainProgram:
    def __init__(self, name, arguments, environment):
        self.name, self.began, self.told_to_end = name, time.monotonic(), False
        self.file = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [sys.executable, f"{name}.py", *arguments], cwd=current.check.folder, env={**os.environ, **environment},
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

    def start(self, program, args=(), env=None, cores=2, *, file="", prefixes=(), assume_success=False):
        self.programs.append(PlainProgram(program, args, env or {}))
        return self.programs[-1]

    def group(self):
        return self

    def end(self):
        for program in self.programs:
            program.stop()
        self.programs.clear()

    close = end


plain = PlainPrograms()
type(current.check).sandbox = property(lambda check: plain)  # whatever the extension prepares in the background
"""


@dataclass
class Measured:
    """What one way of grading took."""

    seconds: float
    cpu: float
    points: dict[str, dict[str, float | None]]


def timed(command: Sequence[str | Path], course: Path) -> tuple[float, float]:
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
    # The cell of the module is the notebook's last, which stock nbgrader runs too late. Nothing outside of the others
    # shows that they take the number of threads from the machine; only this kit looks inside.
    for name in ("correct_own_module", "m07_a_sixth_a_part", "m11_a_tenth_a_part", "m16_cpu_count"):
        tame.remove(name)
    count = min(count or len(tame), len(tame))
    return [tame[index * len(tame) // count] for index in range(count)]


def ours(folder: Path, students: list[str]) -> Measured:
    """Grade by this kit, without known answers: a class of any size has the same few of them, and stock has none."""
    root = course(folder, plain=False)
    lab = load_lab(root, LAB)
    for student in students:
        sample_class.build_student(lab, student, root / "handed_in")
    seconds, cpu = timed([BIN / "autograder", "grade", LAB, root / "handed_in", "--force", "--no-canaries"], root)
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
