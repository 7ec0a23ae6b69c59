"""Measures what a class of thousands costs besides its runs: scheduler, store, gradebook, feedback, pages, exports.

`make bench ARGS="--many 10000"`, and with `--postgresql` on a server that is started for it. Everything is the real
thing except the executor: it answers each job with what one of ten sample students of lab 2 got in a real run. In the
middle of the recording the command is killed, and started again.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import bench_scale
import bench_stock
import psutil
from cpu_meter import cpu_meter
from postgresql_server import postgresql

from autograder.course.paths import CoursePaths
from autograder.gradebook.own_courses import TEMPLATE, trust

EXPORTS = ("csv", "gradescope", "junit")
MOST_SECONDS = 6 * 3600.0
"""For half of the recording."""
PAGE_SECONDS = 600
LOOK_EVERY = 0.2
"""Seconds between two looks at how much is recorded."""


def command(root: Path, *words: str | Path) -> list[str]:
    """Return the kit's command in which this executor is known."""
    return [
        sys.executable,
        str(Path(__file__).with_name("recorded_results.py")),
        *map(str, words),
        "--course",
        str(root),
    ]


def measured(root: Path, *words: str | Path) -> str:
    """Run a command of the kit, and say what it took."""
    seconds, cpu = bench_stock.timed(command(root, *words), root)
    return f"{seconds:.1f} s, {cpu:.1f} CPU s"


def killed_in_the_middle(root: Path, size: int, *words: str | Path) -> str:
    """Grade until half of the class is recorded, kill the command, and say what it took."""
    recorded = CoursePaths(root).autograded
    log = root / "killed.log"
    with cpu_meter() as (prefix, cpu_seconds), bench_scale.memory() as looks, log.open("w") as output:
        began = time.monotonic()
        process = subprocess.Popen([*prefix, *command(root, *words)], cwd=root, stdout=output, stderr=output)
        while process.poll() is None and _entries(recorded) < size // 2 and time.monotonic() - began < MOST_SECONDS:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(LOOK_EVERY)  # its end, which would be too early, is not waited past
        ended = process.poll()
        process.kill()
        process.wait()
        done, seconds, cpu = _entries(recorded), time.monotonic() - began, cpu_seconds()
    if ended is not None or done < size // 2:
        what = "ended before it was killed" if ended is not None else f"recorded only {done} in {MOST_SECONDS:.0f} s"
        sys.exit(f"the command {what}:\n{log.read_text()[-3000:]}")
    each = f"{1000 * cpu / max(1, done):.0f} CPU ms each"
    return f"{done} recorded, {seconds:.1f} s, {cpu:.1f} CPU s, {each}; {_memory(looks)}"


def _entries(folder: Path) -> int:
    return sum(1 for _ in folder.iterdir()) if folder.is_dir() else 0


def _memory(looks: list[tuple[float, float]]) -> str:
    early, late = bench_scale.early_and_late([command for command, _ in looks])
    return f"the command has {early:.0f} MiB in the second quarter and {late:.0f} in the last"


def opened(page: Path) -> str:
    """Open a class page in chromium until its rows can be read, and say what it took."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        window = browser.new_page()
        window.set_default_timeout(1000 * PAGE_SECONDS)
        began = time.monotonic()
        window.goto(page.as_uri())
        rows = window.locator("tbody tr:visible").count()
        window.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done)))")  # it has been drawn
        seconds = time.monotonic() - began
        window.fill("#search", "s00001")
        found = window.inner_text("#shown")
        browser.close()
    return f"{seconds:.1f} s, {page.stat().st_size / 1e6:.1f} MB ({rows} rows; a search: {found})"


@contextlib.contextmanager
def _gradebook(root: Path, on_server: bool) -> Iterator[Path | None]:
    """Give the folder of the server's data; None if the gradebook is a file."""
    if not on_server:
        yield None
        return
    with postgresql() as address:
        setting = f"get_config().CourseDirectory.db_url = {address!r}  # noqa: F821\n"
        (root / "nbgrader_config.py").write_text(TEMPLATE.read_text(encoding="utf-8") + setting, encoding="utf-8")
        trust(root)
        yield Path(address.partition("host=")[2], "data")


def _server_seconds(data: Path) -> float:
    """CPU seconds of a PostgreSQL server so far, with those of its processes that have ended."""
    server = psutil.Process(int((data / "postmaster.pid").read_text().split()[0]))
    return sum(server.cpu_times()[:4]) + sum(sum(one.cpu_times()[:2]) for one in server.children())


def prepare(folder: Path, size: int) -> tuple[Path, Path]:
    """Make a course whose executor knows the results of the sample students; return it and a class of this size."""
    root, known = bench_stock.course(folder / "course", plain=False), folder / "known"
    few, paths = bench_scale.hand_in(root, bench_scale.MIX), CoursePaths(root)
    bench_stock.timed([bench_stock.BIN / "autograder", "grade", bench_stock.LAB, few, "--no-canaries"], root)
    shutil.copytree(paths.results / bench_stock.LAB, known)
    for made in (paths.build, paths.gradebook.parent):
        shutil.rmtree(made)
    (root / "course.toml").write_text(f'executor = "recorded://{known}"\n')
    return root, bench_scale.hand_in(root, size)


def figures(size: int, on_server: bool) -> Iterator[tuple[str, str, str]]:
    """Measure a class of a size; give a figure as soon as it is known: what it is, what was measured, and the aim."""
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        root, source = prepare(Path(name), size)
        paths, grade = CoursePaths(root), ("grade", bench_stock.LAB, source, "--no-canaries")
        with _gradebook(root, on_server) as data:
            of = f"{size} on {'PostgreSQL' if data else 'SQLite'}"
            yield f"{of}, killed in the middle", killed_in_the_middle(root, size, *grade), ""
            with bench_scale.memory() as looks:
                other_half = measured(root, *grade)
            yield f"{of}, the rest after it was killed", f"{other_half}; {_memory(looks)}", ""
            yield f"{of}, again with nothing to do", measured(root, *grade), ""
            yield f"{of}, class page", measured(root, "report"), ""
            for form in EXPORTS:
                file = root / f"export.{form}"
                took = measured(root, "export", form, "-o", file)
                yield f"{of}, export {form}", f"{took}, {file.stat().st_size / 1e6:.1f} MB", ""
            yield f"{of}, class page in chromium", opened(paths.class_page(bench_stock.LAB)), "2 s"
            if data:
                yield f"{of}, the server", f"{_server_seconds(data):.1f} CPU s in all", ""
            kept = {"build": paths.build, "gradebook": data or paths.gradebook.parent}
            disk = (f"{what} {_bytes(where) / 1e6:.1f} MB" for what, where in kept.items())
            yield f"{of}, disk", ", ".join(disk), ""


def _bytes(folder: Path) -> int:
    return sum(512 * path.stat().st_blocks for path in folder.rglob("*") if path.is_file())
