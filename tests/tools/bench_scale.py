"""Measures how grading scales: with the jobs at once, with the size of the class, and on a Dask cluster.

`make bench` runs it. What is measured is kept in build/bench_scale.json, so that a part can be measured alone (such as
`--sizes 500 --jobs`), and the picture build/bench_scale.svg shows all of it. A class is the same ten sample students of
lab 2 again and again, so that classes of every size cost the same for each.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import json
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import bench
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
    date: str = ""
    load: float = 0.0
    """Of the machine in the last minute of it: above the number of cores, something else ran, too."""

    def __str__(self) -> str:
        """A line for people."""
        quarter = max(1, len(self.command) // 4)
        early, late = self.command[quarter : 2 * quarter] or [0.0], self.command[-quarter:] or [0.0]
        return (
            f"{self.kind}: {self.size} submissions, {self.jobs} at once: {60 * self.size / self.seconds:.1f} a minute,"
            f" {self.cpu / self.size:.2f} CPU s each; the command has {sum(early) / len(early):.0f} MiB in the second"
            f" quarter and {sum(late) / len(late):.0f} in the last, everything at most {self.together:.0f}"
            f" ({self.date}, load {self.load:.0f})"
        )


def hand_in(root: Path, size: int) -> Path:
    """Write a class into a course and return its folder."""
    lab, folder = load_lab(root, bench.LAB), root / f"class of {size}"
    mix = bench.tame_students(MIX)
    for number in range(size):
        made = sample_class.build_student(lab, mix[number % MIX], root / "made")
        folder.mkdir(exist_ok=True)
        made.rename(folder / f"s{number:03d}")
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
        seconds, cpu = bench.timed(
            [bench.BIN / "autograder", "grade", bench.LAB, source, "--force", "--jobs", str(jobs), *options], root
        )
    return Run(
        kind, size, jobs, round(seconds, 1), round(cpu, 1), [round(alone) for alone, _ in looks],
        round(max((all_ for _, all_ in looks), default=0.0)), f"{datetime.date.today()}", round(os.getloadavg()[0], 1),
    )  # fmt: skip


def on_dask(root: Path, size: int, jobs: int) -> Run:
    """Grade a class on a cluster of one worker, whose CPU time counts, too."""
    with cpu_meter() as (before, cpu), cluster(root, before) as dask:
        dask.worker("one", jobs=jobs)
        began = cpu()
        run = graded("dask", root, size, jobs, "--scheduler", dask.address)
        run.cpu += cpu() - began if before else 0.0  # without a control group it was the whole machine's already
    return run


def plot(runs: list[Run], path: Path) -> None:
    """Draw what was measured, the latest run of each kind, size and number of jobs."""
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
    for run in (run for run in runs if run.kind == "dask"):
        here = [one for one in jobs if (one.size, one.jobs) == (run.size, run.jobs)][-1:]
        pair = [*here, run]
        names = ["Dask" if one.kind == "dask" else "local" for one in pair]
        bars = where.bar(names, [60 * one.size / one.seconds for one in pair], color="#0072B2")
        where.bar_label(bars, [f"{one.cpu / one.size:.2f} CPU s each" for one in pair])
    where.set(title="Submissions a minute", xlabel="one machine, as many jobs", ylim=(0, None))
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, nargs="*", default=[1, 2, 4, 8, 16], help="jobs at once")
    parser.add_argument("--students", type=int, default=20, help="submissions with which jobs and Dask are measured")
    parser.add_argument("--sizes", type=int, nargs="*", default=[10, 50, 100], help="sizes of classes")
    parser.add_argument("--dask", type=int, nargs="*", default=[8], help="jobs at once on a Dask cluster")
    asked = parser.parse_args()
    kept = BUILD / "bench_scale.json"
    known: list[dict[str, Any]] = json.loads(kept.read_text()) if kept.is_file() else []
    runs = {(run.kind, run.size, run.jobs): run for run in (Run(**one) for one in known)}
    wanted = [("size", size, 0) for size in asked.sizes]
    wanted += [("jobs", asked.students, jobs) for jobs in asked.jobs]
    wanted += [("dask", asked.students, jobs) for jobs in asked.dask]
    BUILD.mkdir(exist_ok=True)
    for kind, size, jobs in wanted:
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            root = bench.course(Path(folder) / "course", plain=False)
            run = on_dask(root, size, jobs) if kind == "dask" else graded(kind, root, size, jobs)
        runs[kind, size, jobs] = run
        print(run, flush=True)
        kept.write_text(json.dumps([asdict(one) for one in runs.values()], indent=1))
    plot(list(runs.values()), BUILD / "bench_scale.svg")
    print(BUILD / "bench_scale.svg")


if __name__ == "__main__":
    main()
