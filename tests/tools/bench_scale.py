"""Measures how grading scales: with the jobs at once, with the size of the class, and on a Dask cluster.

For `make bench`; the picture build/bench_scale.svg shows what one run of it measured. A class is the same ten sample
students of lab 2 again and again, so that classes of every size cost the same for each.
"""

from __future__ import annotations

import contextlib
import datetime
import os
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import bench_stock
import matplotlib
import psutil
import sample_class
from cpu_meter import cpu_meter
from dask_cluster import cluster
from matplotlib.figure import Figure

from autograder.course.lab import load_lab

MIX = 10
"""Different students in a class."""
LOOK_EVERY = 3.0
"""Seconds between two looks at the memory: adding it up costs CPU, too."""
BUILD = sample_class.ROOT / "build"
MIB = 1024 * 1024
JOBS_A_CORE = 5
"""On a Dask worker, as `autograder grade` takes them on a machine."""


@dataclass
class Run:
    """What grading a class once took."""

    kind: str
    """What was varied: `jobs`, `size` or `dask`."""
    size: int
    jobs: int
    seconds: float
    cpu: float
    command: list[float] = field(default_factory=list)
    """MiB of the command alone, from the beginning to the end."""
    together: float = 0.0
    """MiB of all processes, at most; shared pages count once."""
    workers: int = 0
    """Of the Dask cluster; 0 without one."""
    date: str = ""
    load: float = 0.0
    """Of the machine in the last minute of it: above the number of cores, something else ran, too."""

    def __str__(self) -> str:
        """A line for people."""
        early, late = early_and_late(self.command)
        at_once = f"{self.jobs} at once" if self.jobs else "as many at once as the cores carry"
        return (
            f"{self.kind}: {self.size} submissions, {at_once}: {60 * self.size / self.seconds:.1f} a minute,"
            f" {self.cpu / self.size:.2f} CPU s each; the command has {early:.0f} MiB in the second"
            f" quarter and {late:.0f} in the last, everything at most {self.together:.0f}"
            f" ({self.date}, load {self.load:.0f})"
        )


def early_and_late(looks: list[float]) -> tuple[float, float]:
    """The means of the second quarter, when everything is loaded, and of the last."""
    quarter = max(1, len(looks) // 4)
    early, late = looks[quarter : 2 * quarter] or [0.0], looks[-quarter:] or [0.0]
    return sum(early) / len(early), sum(late) / len(late)


def hand_in(root: Path, size: int) -> Path:
    """Write a class into a course and return its folder."""
    lab, folder = load_lab(root, bench_stock.LAB), root / f"class of {size}"
    mix = bench_stock.tame_students(MIX)
    for number in range(size):
        made = sample_class.build_student(lab, mix[number % MIX], root / "made")
        folder.mkdir(exist_ok=True)
        made.rename(folder / f"s{number:05d}")
    return folder


@contextlib.contextmanager
def memory() -> Iterator[list[tuple[float, float]]]:
    """Give a list that fills with the memory of this process's children that grade: alone, and with all below them."""
    looks: list[tuple[float, float]] = []
    over = threading.Event()

    def look() -> None:
        while not over.wait(LOOK_EVERY):
            with contextlib.suppress(psutil.Error, ValueError):
                (command,) = [one for one in psutil.Process().children() if "grade" in one.cmdline()]
                family = [command, *command.children(recursive=True)]
                looks.append((command.memory_info().rss / MIB, sum(map(_shared_once, family)) / MIB))

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield looks
    finally:
        over.set()
        thread.join()


def _shared_once(process: psutil.Process) -> float:
    try:
        return float(process.memory_full_info().pss)
    except psutil.Error:  # it has just ended
        return 0.0


def graded(kind: str, root: Path, size: int, jobs: int, *options: str) -> Run:
    """Grade a class of a course from the beginning."""
    source = hand_in(root, size)
    with memory() as looks:
        seconds, cpu = bench_stock.timed(
            [
                bench_stock.BIN / "autograder",
                "grade",
                bench_stock.LAB,
                source,
                "--force",
                "--jobs",
                str(jobs),
                *options,
            ],
            root,
        )
    return Run(
        kind, size, jobs, round(seconds, 1), round(cpu, 1), [round(alone) for alone, _ in looks],
        round(max((all_ for _, all_ in looks), default=0.0)), date=f"{datetime.date.today()}",
        load=round(os.getloadavg()[0], 1),
    )  # fmt: skip


def on_dask(root: Path, size: int, workers: int) -> Run:
    """Grade a class on a cluster of so many workers, each with a core of its own; their CPU time counts, too."""
    cores = sorted(os.sched_getaffinity(0))[:workers]
    with cpu_meter() as (before, cpu), cluster(root, before) as dask:
        for core in cores:
            dask.worker(f"core {core}", jobs=JOBS_A_CORE, core=core)
        began = cpu()
        run = graded("dask", root, size, JOBS_A_CORE * workers, "--scheduler", dask.address)
        run.workers = workers
        run.cpu += cpu() - began if before else 0.0  # without a control group it was the whole machine's already
    return run


def measured(kind: str, size: int, number: int) -> Run:
    """Grade a class.

    Args:
        kind: what is varied: `jobs`, `size` or `dask`.
        size: the number of submissions.
        number: the jobs at once, or the workers on Dask.
    """
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        root = bench_stock.course(Path(folder) / "course", plain=False)
        return on_dask(root, size, number) if kind == "dask" else graded(kind, root, size, number)


def plot(runs: Sequence[Run]) -> Path:
    """Draw what was measured; return where the picture is."""
    path = BUILD / "bench_scale.svg"
    path.parent.mkdir(exist_ok=True)
    matplotlib.rcParams |= {"svg.fonttype": "none", "svg.hashsalt": "scale", "font.size": 9}
    figure = Figure(figsize=(8, 2.8), layout="constrained")
    by_jobs, by_size, where = figure.subplots(1, 3)
    for axes in (by_size, where):
        axes.margins(y=0.15)  # for what stands above the bars
    jobs = sorted((run for run in runs if run.kind == "jobs"), key=lambda run: run.jobs)
    sizes = sorted((run for run in runs if run.kind == "size"), key=lambda run: run.size)
    by_jobs.plot([f"{run.jobs}" for run in jobs], [60 * run.size / run.seconds for run in jobs], "o-", color="#0072B2")
    by_jobs.set(title="Submissions a minute", xlabel="jobs at once", ylim=(0, None))
    bars = by_size.bar([f"{run.size}" for run in sizes], [run.cpu / run.size for run in sizes], color="#0072B2")
    by_size.bar_label(bars, fmt="%.2f")
    by_size.set(title="CPU seconds a submission", xlabel="submissions in the class", ylim=(0, None))
    dask = sorted((run for run in runs if run.kind == "dask"), key=lambda run: run.workers)
    bars = where.bar([f"{run.workers}" for run in dask], [60 * run.size / run.seconds for run in dask], color="#0072B2")
    where.bar_label(bars, [f"{run.cpu / run.size:.2f} CPU s each" for run in dask])
    where.set(title="Submissions a minute", xlabel="Dask workers, each on a core of its own", ylim=(0, None))
    figure.savefig(path, metadata={"Date": None})
    return path
