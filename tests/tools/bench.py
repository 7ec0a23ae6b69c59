"""Measures every figure that the project aims at. `make bench`; `make bench ARGS=--short` for a few submissions only.

`ARGS="--many 500 10000"` measures instead what classes of these sizes cost besides their runs (`bench_many`), and with
`--postgresql` on a server. Beside each figure stands how long a fixed loop took just then: where it takes longer, the
machine was slower. `time make grade` and `time make test` on a fresh clone measure the other two figures.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import bench_many
import bench_scale
import sample_class
from bench_stock import BIN, LAB, Measured, ours, recording, stock, tame_students, timed
from boxes import RUN_STDIN
from cpu_meter import shares_of_cpu
from kernels import SET_UP, TALKER, Notebook
from matplotlib.figure import Figure

from autograder.core.results import Isolation
from autograder.course.lab import lab_names, load_lab
from autograder.sandbox.grading_sandbox import run_in_sandbox

STUDENTS, STUDENTS_SHORT = 20, 3
SIZES, JOBS, WORKERS = [10, 500], [1, 2, 4, 8, 16], [1, 2, 4]
WATCHED = 1.0
"""Seconds for which the warm check watches a topic on which nothing comes."""
VERDICT = 'with launch("talker") as ros:\n    ros.topic("/chatter", String).expect_messages(at_least=1)\nros.score(1)'
SILENCE = (
    f'with launch() as ros:\n    ros.topic("/nothing", String).expect_silence(for_seconds={WATCHED})\nros.score(1)'
)

Figures = Iterator[tuple[str, str, str]]
"""What is measured, what it was, and the aim."""


def fixed_loop() -> float:
    """CPU seconds of a loop that is always the same, of several the least."""

    def once() -> float:
        began = time.process_time()
        sum(number * number % 7 for number in range(1_000_000))
        return time.process_time() - began

    return min(once() for _ in range(3))


def alone(lab_name: str) -> Measured:
    """Check one complete solution, as a student or an instructor does who waits for it."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        path = sample_class.build_student(load_lab(sample_class.ROOT, lab_name), "solution", Path(folder))
        command: list[str | Path] = [BIN / "autograder", "check", path / f"{lab_name}.ipynb"]
        seconds, cpu = timed([*command, "--course", sample_class.ROOT], sample_class.ROOT)
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


def against_stock(students: list[str]) -> Figures:
    """Grade the same submissions by this kit and by stock nbgrader.

    Raises:
        SystemExit: the two give different points.
    """
    size, cores = len(students), len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        with shares_of_cpu() as parts:
            mine = ours(folder / "ours", students)
        recorded = recording(folder / "ours", students)
        programs = parts["students' programs"] / size + observers(9, 1.2)
        floor = programs + recorded.cpu / size
        parts["not seen: ended between two looks"] = max(0.0, mine.cpu - sum(parts.values()))
        yield "CPU seconds a submission", f"{mine.cpu / size:.2f}", "1.9"
        shares = ", ".join(f"{part} {seconds / size:.2f}" for part, seconds in parts.items())
        yield "of that, by part", f"{shares}; picture: {plot(parts, size)}", ""
        over, above = mine.cpu / size / floor, mine.cpu / size / programs
        yield "over the floor: programs, nine observers, gradebook", f"{over:.2f} x of {floor:.2f} s", "1.5 x"
        yield "over the same floor without the gradebook", f"{above:.2f} x of {programs:.2f} s", ""
        yield "nbgrader and feedback, CPU seconds a submission", f"{recorded.cpu / size:.2f}", "0.2"
        one = stock(folder / "stock", students, 1)
        yield "throughput against stock, one after another", f"{one.seconds / mine.seconds:.1f} x", "25 x"
        yield "CPU seconds a submission, stock", f"{one.cpu / size:.2f}", ""
        many = stock(folder / "many", students, min(size, 2 * cores))
        yield "throughput against stock that fills the machine", f"{many.seconds / mine.seconds:.1f} x", "5 x"
    different = [
        f"{student}: {check}: {points} here, {theirs.points[student].get(check)} there"
        for theirs in (one, many)
        for student, checks in mine.points.items()
        for check, points in checks.items()
        if points != theirs.points[student].get(check)
    ]
    if different:
        sys.exit("\n".join(different))
    yield "points of all checks, here and in stock", "the same", "the same"


def in_a_notebook() -> Figures:
    """Run checks in a kernel, as students do."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        notebook = Notebook(Path(folder))
        try:
            cells = [notebook.run(cell) for cell in (SET_UP, TALKER, VERDICT)]
            assert "✓ passed" in cells[-1].text, cells[-1]
            warm = [notebook.run(SILENCE) for _ in range(3)]
            assert all("✓ passed" in shown.text for shown in warm), warm[0]
        finally:
            notebook.close()
    yield "fresh kernel to the first verdict", f"{sum(shown.seconds for shown in cells):.2f} s", "0.5 s"
    least = min(shown.seconds for shown in warm) - WATCHED
    yield f"a warm check over its evidence, {WATCHED:g} s of silence", f"{least:.2f} s", "0.2 s"


def complete(labs: list[str]) -> Figures:
    """Check the solution of each lab, alone."""
    for lab in labs:
        one = alone(lab)
        aim = "10 s" if lab.startswith("lab7") else "7 s"
        yield f"complete solution alone, {lab}", f"{one.seconds:.1f} s, {one.cpu:.1f} CPU s", aim


def scaling(sizes: list[int], jobs: list[int], workers: list[int], students: int) -> Figures:
    """Grade classes of several sizes, with several jobs at once, and on several Dask workers."""
    runs: dict[tuple[str, int, int], bench_scale.Run] = {}
    wanted = [("size", size, 0) for size in sizes]
    wanted += [("jobs", students, count) for count in jobs] + [("dask", students, count) for count in workers]
    for kind, size, number in wanted:
        runs[kind, size, number] = run = bench_scale.measured(kind, size, number)
        yield f"{kind} {size if kind == 'size' else number}", str(run), ""
    if len(sizes) > 1:
        small, large = (runs["size", size, 0] for size in (min(sizes), max(sizes)))
        ratio = (large.cpu / large.size) / (small.cpu / small.size)
        yield f"CPU seconds of each of {large.size} over those of {small.size}", f"{ratio:.2f}", "1.0"
    for count in workers if 1 in workers else []:
        share = runs["dask", students, 1].seconds / runs["dask", students, count].seconds / count
        yield f"throughput of {count} Dask workers over {count} times that of one", f"{share:.2f}", "0.9"
    yield "picture", f"{bench_scale.plot(list(runs.values()))}", ""


def figures(options: argparse.Namespace) -> Figures:
    """Measure what was asked for."""
    cores = len(os.sched_getaffinity(0))
    if options.many:
        for size in options.many:
            yield from bench_many.figures(size, options.postgresql)
        return
    yield from in_a_notebook()
    yield from complete([LAB] if options.short else lab_names(sample_class.ROOT))
    if not options.short:
        sizes, jobs, dask = (
            default if chosen is None else chosen
            for chosen, default in ((options.sizes, SIZES), (options.jobs, JOBS), (options.dask, WORKERS))
        )
        yield from scaling(sizes, jobs, [count for count in dask if count <= cores], options.students or STUDENTS)
    # The last, because it ends the run if any points differ.
    yield from against_stock(tame_students(options.students or (STUDENTS_SHORT if options.short else STUDENTS)))


def plot(parts: dict[str, float], size: int) -> Path:
    """Draw where the CPU seconds of a submission go; return where the picture is."""
    figure = Figure(figsize=(8, 0.5 * len(parts) + 1), layout="constrained")
    axes = figure.subplots()
    bars = axes.barh(list(parts), [seconds / size for seconds in parts.values()], color="#0072B2")
    axes.bar_label(bars, fmt="%.2f", padding=3)
    axes.invert_yaxis()
    axes.set_xlabel("CPU seconds a submission")
    path = bench_scale.BUILD / "bench.svg"
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path)
    return path


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="a few submissions of lab 2 only")
    parser.add_argument("--students", type=int, default=0, help=f"submissions of lab 2; default: {STUDENTS}")
    parser.add_argument("--sizes", type=int, nargs="*", help="sizes of classes; default: 10 500")
    parser.add_argument("--jobs", type=int, nargs="*", help="jobs at once; default: 1 2 4 8 16")
    parser.add_argument("--dask", type=int, nargs="*", help="Dask workers, at most one a core; default: 1 2 4")
    parser.add_argument("--many", type=int, nargs="+", default=[], help="sizes of classes with recorded results")
    parser.add_argument("--postgresql", action="store_true", help="with --many: the gradebook is on a server")
    options = parser.parse_args()
    scaled = [options.sizes, options.jobs, options.dask]
    if options.postgresql and not options.many:
        parser.error("--postgresql belongs to --many")
    if options.many and (options.short or options.students or any(one is not None for one in scaled)):
        parser.error("--many measures classes with recorded results only, so the other options do not apply")
    if options.short and any(one is not None for one in scaled):
        parser.error("--short measures no classes of several sizes, jobs or workers")
    cores = len(os.sched_getaffinity(0))
    print(f"{cores} cores, load {os.getloadavg()[0]:.0f}; in brackets: CPU seconds of a fixed loop", flush=True)
    for what, found, aim in figures(options):
        print(f"{what}: {found}{f', aim {aim}' if aim else ''} [{fixed_loop():.3f}]", flush=True)


if __name__ == "__main__":
    main()
