"""A Dask cluster on this machine: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import psutil
from places import ROOT


def until(ready: Callable[[], object], what: str) -> None:
    """Wait until something is so; an AssertionError says what is not."""
    deadline = time.monotonic() + 600
    while not ready():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


class Cluster:
    """A scheduler, and the workers that are started."""

    def __init__(self, folder: Path, ending: ExitStack, before: Sequence[str]) -> None:
        """Start the scheduler."""
        self._file, self._ending, self._folder, self._before = folder / "scheduler.json", ending, folder, before
        self._start(ROOT, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(self._file))
        until(self._address, "the scheduler does not start")
        self.address = self._address()

    def _address(self) -> str:
        """Where the scheduler listens; empty until it has written all of its file."""
        with suppress(OSError, ValueError):
            return str(json.loads(self._file.read_text())["address"])
        return ""

    def worker(self, name: str, kit: Path = ROOT, jobs: int = 1, core: int | None = None) -> psutil.Process:
        """Start a worker for so many jobs at once; it takes them as soon as it is known to the scheduler.

        Args:
            name: its name.
            kit: the folder of its kit.
            jobs: how many it runs at once.
            core: the only core on which it and its jobs run; None for all of them.
        """
        options = ("--no-nanny", "--nthreads", str(jobs), "--name", name, "--local-directory", str(self._folder))
        process = self._start(kit, "worker", self.address, *options, core=core)
        until(lambda: name in self._known(), f"the worker {name} does not start")
        return psutil.Process(process.pid)

    def _known(self) -> set[str]:
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            return {str(worker["name"]) for worker in client.scheduler_info(n_workers=-1)["workers"].values()}

    def _start(self, kit: Path, *command: str, core: int | None = None) -> subprocess.Popen[bytes]:
        pinned = [] if core is None else ["taskset", "--cpu-list", str(core)]
        process = subprocess.Popen(
            [*self._before, *pinned, sys.executable, "-m", "dask", *command, "--no-dashboard"],
            cwd=self._folder, env=os.environ | {"PYTHONPATH": str(kit)},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._ending.callback(process.wait, 120)
        self._ending.callback(process.kill)
        return process


@contextmanager
def cluster(folder: Path, before: Sequence[str] = ()) -> Iterator[Cluster]:
    """Give a cluster without workers; all of it ends with the block.

    Args:
        folder: for its files.
        before: words that are put before each command.
    """
    with ExitStack() as ending:
        yield Cluster(folder, ending, before)
