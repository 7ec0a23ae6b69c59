"""Processes that a test starts, and that end with it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

import pytest

WITHIN = 120
"""Far beyond what a start takes on a busy machine, in seconds."""


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[str]]]:
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        process.terminate()  # who is killed leaves locks behind in shared memory, and others wait for them
    for process in processes:
        try:
            process.communicate(timeout=10)  # seconds
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
