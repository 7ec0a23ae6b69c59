"""What the preflight runs in the grading sandbox: a program in the node sandbox that must be able to say a word."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from autograder.sandbox import bubblewrap
from autograder.sandbox.environment import python_environment
from autograder.sandbox.limits import Limits
from autograder.sandbox.seccomp import filter_program


def main() -> int:
    """Return 0 if a process started in the node sandbox, having written its word."""
    with tempfile.TemporaryDirectory() as folder:
        filtered = bubblewrap.memory_file("seccomp", filter_program())
        process = bubblewrap.start_bwrap(
            bubblewrap.inner_options(Path(folder), Limits(), python_environment(), filtered),
            [sys.executable, "-I", "-S", "-c", "print('isolated')"],
            (filtered,),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        said, trouble = process.communicate(timeout=30)
    sys.stdout.write(said.decode())
    sys.stderr.write(trouble.decode("utf-8", "replace"))
    return process.returncode


if __name__ == "__main__":
    sys.exit(main())
