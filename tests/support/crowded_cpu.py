"""A CPU that strangers compute on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

STRANGER = """
import os, sys
if os.fork(): os._exit(0)
os.setsid()
os.sched_setaffinity(0, {int(sys.argv[1])})
print(os.getpid(), flush=True)
os.close(1)
while True: pass
"""


@pytest.fixture
def crowded_cpu() -> Iterator[str]:
    """Sixteen strangers that compute on one CPU; gives its number."""
    cpu = str(max(os.sched_getaffinity(0)))
    command = [sys.executable, "-c", STRANGER, cpu]
    strangers = [int(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout) for _ in range(16)]
    yield cpu
    for stranger in strangers:
        os.kill(stranger, signal.SIGKILL)
