"""The module that the preflight runs in the grading sandbox: it starts a program in the node sandbox."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.sandbox.node_sandbox import NodeSandbox


def main() -> int:
    """Start a program in the node sandbox and print its output.

    Return 1 if the sandbox cannot be started, otherwise 0.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "word.py").write_text("print('isolated')\n")
        try:
            with NodeSandbox(folder, Isolation.FULL) as sandbox, sandbox.group() as group:
                program = group.start("word")
                program.wait(30)
                sys.stdout.write(program.output())
        except (KitError, OSError) as error:
            sys.stderr.write(str(error).splitlines()[0])
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
