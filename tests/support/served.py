"""Where a Jupyter server that a test has started can be reached."""

from __future__ import annotations

import contextlib
import json
import subprocess
import time
import urllib.request
from pathlib import Path

START_SECONDS = 180
"""Far beyond what a start takes on a busy machine (5 s on two cores)."""


def address_of(server: subprocess.Popen[bytes], runtime: Path, log: Path | None = None) -> str:
    """Wait until a server answers, and return its address: it writes where it will listen before it does.

    Args:
        server: the process.
        runtime: the folder that JUPYTER_RUNTIME_DIR names for it, which is its own.
        log: what it prints, if that is kept.
    """
    deadline = time.monotonic() + START_SECONDS
    while server.poll() is None and time.monotonic() < deadline:
        for path in runtime.glob("jpserver-*.json"):
            with contextlib.suppress(OSError, ValueError, KeyError):
                address = str(json.loads(path.read_text())["url"])
                with urllib.request.urlopen(f"{address}api", timeout=10):
                    return address
        time.sleep(0.1)
    raise AssertionError(f"The server did not start:\n{log.read_text()[-3000:] if log else ''}")
