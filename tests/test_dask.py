"""A class on a Dask cluster: scheduler and workers are processes of their own, one of them is killed meanwhile."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil
import pytest
import toy

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.course.lab import load_lab
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings
from autograder.sandbox.isolation import preflight

KIT = Path(__file__).resolve().parent.parent
SLOW = "%%node talker\nimport time\ntime.sleep(3)\nprint('hello')\n"


def until(ready: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + 120
    while not ready():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


class Cluster:
    """A scheduler, and the workers that are started."""

    def __init__(self, folder: Path, ending: ExitStack) -> None:
        self._file, self._ending, self._folder = folder / "scheduler.json", ending, folder
        self._start(KIT, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(self._file))
        until(self._file.exists, "the scheduler does not start")
        self.address = json.loads(self._file.read_text())["address"]

    def worker(self, name: str, kit: Path = KIT) -> psutil.Process:
        """Start a worker with one thread; it takes jobs as soon as it is known to the scheduler."""
        options = ("--no-nanny", "--nthreads", "1", "--name", name, "--local-directory", str(self._folder))
        process = self._start(kit, "worker", self.address, *options)
        until(lambda: name in self._known(), f"the worker {name} does not start")
        return psutil.Process(process.pid)

    def _known(self) -> set[str]:
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            return {str(worker["name"]) for worker in client.scheduler_info(n_workers=-1)["workers"].values()}

    def _start(self, kit: Path, *command: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *command, "--no-dashboard"],
            cwd=self._folder, env=os.environ | {"PYTHONPATH": str(kit)},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._ending.callback(process.wait, 30)
        self._ending.callback(process.kill)
        return process


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    with ExitStack() as ending:
        yield Cluster(folder, ending)


def test_a_killed_worker_costs_no_result_and_another_kit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    course = toy.make_course(tmp_path / "course")
    lab = load_lab(course, toy.LAB)
    cells = lab.clean_notebook({"talker": SLOW, "answers": "%%file answers.yaml\nanswer: 42"})["cells"]
    class_ = {f"s{number}": toy.hand_in(tmp_path / "class", f"s{number}", cells) for number in range(4)}
    isolation = Isolation.FULL if preflight().full else Isolation.NONE
    with cluster(tmp_path) as dask:
        settings = Settings(isolation, executor=f"dask://{dask.address}")
        first = dask.worker("first")
        dask.worker("second")
        family: list[psutil.Process] = []

        def kill_the_first(_: object) -> None:
            if not family:  # it has run one, or is running it
                until(lambda: first.children(recursive=True), "the worker runs nothing")
                family.extend(first.children(recursive=True))
                first.kill()

        begun: list[str] = []
        results = run_class(class_, course, lab, settings, kill_the_first, begun.append)
        assert set(begun) == set(class_)  # whose names are shown while they run
        assert {student: result.points for student, result in results.items()} == dict.fromkeys(class_, 5.0)
        assert psutil.wait_procs(family, timeout=30)[1] == []

        other = tmp_path / "other"
        shutil.copytree(KIT / "autograder", other / "autograder", ignore=shutil.ignore_patterns("__pycache__"))
        (other / "autograder" / "core" / "version.py").write_text('VERSION = "0.0"\n')
        dask.worker("third", other)
        with pytest.raises(KitError, match=r"1 of 2 workers have no kit, or another one"):
            run_class(class_, course, lab, Settings(isolation, executor=settings.executor, force=True), lambda _: None)
    monkeypatch.setattr("autograder.grading.executors.dask._SECONDS_TO_ANSWER", 1.0)
    with pytest.raises(KitError, match="No Dask scheduler answers"):
        run_class(class_, course, lab, Settings(isolation, executor="dask://tcp://127.0.0.1:1", force=True), print)
