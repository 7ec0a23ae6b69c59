"""Simulates a class of thousands: everything is real except the runs, whose results were recorded before.

`python tests/tools/bench_many.py --students 10000`. Ten sample students of lab 2 are graded once. Then a class of
thousands hands in their notebooks, and an executor gives the recorded results to the scheduler, which stores them in
the result store and records them with nbgrader. In the middle, the command is killed and started again. At the end, the
page of the class and the exports are made. The figures say what each step took, so that the first thing that does not
bear so many students can be found.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import bench
import sample_class
from machine_speed import machine_speed

from autograder.core.results import SubmissionResult
from autograder.course.lab import load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.class_run import grade_class
from autograder.gradebook.own_courses import TEMPLATE
from autograder.grading import executors
from autograder.grading.job import Job
from autograder.grading.runner import Settings
from autograder.grading.store import ResultStore

RECORDED = "recorded"
"""The name of the executor, and of the class whose results it gives."""
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


class Recorded:
    """Gives each job the result that a submission with the same answers got before."""

    def __init__(self, folder: str) -> None:
        """Read the results in a folder."""
        results = map(SubmissionResult.load, Path(folder).glob("*.json"))
        self._results = {result.digest: result for result in results}

    def run(self, jobs: Sequence[Job], started: Callable[[str], None]) -> Generator[SubmissionResult, None, None]:
        """Run jobs as described in `Executor.run`."""
        for job in jobs:
            started(job.student)
            yield self._results[job.digest].model_copy(update={"student": job.student, "seed": job.seed}, deep=True)


def grade(root: Path, source: Path, results: Path) -> None:
    """Grade a class with recorded results. This is a process of its own, so that it can be killed."""
    executors.EXECUTORS[RECORDED] = lambda folder, _: Recorded(folder)
    settings = Settings(executor=f"{RECORDED}://{results}", canaries=False)
    grade_class(root, bench.LAB, source, settings)


def hand_in(root: Path, mix: Sequence[str], size: int) -> Path:
    """Write the class: links to the notebooks of a few students, so that it takes no disk."""
    folder = root / f"class of {size}"
    for number in range(size):
        there = folder / f"s{number:05d}" / f"{bench.LAB}.ipynb"
        there.parent.mkdir(parents=True)
        os.link(root / "few" / mix[number % len(mix)] / there.name, there)
    return folder


@contextlib.contextmanager
def told(what: str, size: int) -> Iterator[None]:
    """Print what a step took: all processes that this one waited for meanwhile."""

    def cpu() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    began, before = time.monotonic(), cpu()
    yield
    seconds, used = time.monotonic() - began, cpu() - before
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(
        f"{what}: {used:.1f} CPU s, {1000 * used / size:.1f} ms a student, {seconds:.0f} s by the clock;"
        f" the largest process so far had {peak:.0f} MiB",
        flush=True,
    )


def command(root: Path, *words: str | Path) -> None:
    """Run the command `autograder` in the course."""
    done = subprocess.run([bench.BIN / "autograder", *words], cwd=root, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        sys.exit(f"{words} failed:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")


def graded(root: Path, source: Path, *, until: int = 0) -> None:
    """Grade in a process of its own, and kill it as soon as so many students are recorded; 0: let it finish."""
    words = [sys.executable, __file__, "--grade", root, source, root / RECORDED]
    pages = CoursePaths(root).feedback
    with (root / "log").open("w") as log, subprocess.Popen(words, stdout=log, stderr=log) as process:
        while process.poll() is None:
            if until and sum(1 for _ in pages.glob("*")) >= until:
                process.kill()
            time.sleep(0.2)
    if process.returncode and not until:
        sys.exit(f"Grading failed:\n{(root / 'log').read_text()[-4000:]}")


def size_of(folder: Path) -> float:
    """Return the megabytes of everything in a folder."""
    done = subprocess.run(["du", "-sm", folder], capture_output=True, text=True, check=True)
    return float(done.stdout.split()[0])


def page_seconds(page: Path) -> float:
    """Return the seconds until a browser has loaded and drawn a page."""
    from playwright.sync_api import sync_playwright

    drawn = "() => new Promise(done => requestAnimationFrame(() => setTimeout(() => done(performance.now()))))"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        shown = browser.new_page()
        shown.goto(page.as_uri(), wait_until="load", timeout=300_000)
        return float(shown.evaluate(drawn)) / 1000


def simulate(root: Path, size: int, address: str) -> None:
    """Grade a class of this size, and print what each step took."""
    bench.course(root, plain=False)
    if address:
        text = TEMPLATE.read_text(encoding="utf-8") + f"get_config().CourseDirectory.db_url = {address!r}\n"
        (root / "nbgrader_config.py").write_text(text, encoding="utf-8")
        command(root, "trust", root)
    lab, mix = load_lab(root, bench.LAB), bench.tame_students(10)
    for student in mix:
        sample_class.build_student(lab, student, root / "few")
    few = root.parent / "graded"
    bench.course(few, plain=False)
    command(few, "grade", bench.LAB, root / "few", "--no-canaries")
    ResultStore(few).path(lab.name, "x").parent.rename(root / RECORDED)
    source = hand_in(root, mix, size)
    print(f"{size} students of {lab.name}, {address or 'SQLite'}; {machine_speed()}", flush=True)
    with told("the first half, then killed", size // 2):
        graded(root, source, until=size // 2)
    with told("from there to the end", size - size // 2):
        graded(root, source)
    with told("grading again, with nothing changed", size):
        graded(root, source)
    paths = CoursePaths(root)
    with told("the class page", size):
        command(root, "report")
    print(f"the page in a browser: {page_seconds(paths.class_page(lab.name)):.1f} s", flush=True)
    for form in ("csv", "gradescope", "junit"):
        with told(f"export {form}", size):
            command(root, "export", form, "--lab", lab.name, "-o", root / f"export.{form}")
    print(
        f"disk: {size_of(paths.build):.0f} MB in build,"
        f" {size_of(paths.gradebook.parent):.0f} MB in gradebook; {machine_speed()}"
    )


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--students", type=int, default=10_000)
    parser.add_argument("--address", default="", help="of the gradebook on a server; default: SQLite in the course")
    parser.add_argument("--grade", nargs=3, type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.grade:
        grade(*options.grade)
        return
    with tempfile.TemporaryDirectory(prefix="many-") as folder:
        simulate(Path(folder) / "course", options.students, options.address)


if __name__ == "__main__":
    main()
