"""Build one package of a student inside the grading sandbox. Read `Sources` and write a `BuildRun`, both as JSON."""

from __future__ import annotations

import sys

from autograder.core.errors import KitError
from autograder.grading.builds import Sources
from autograder.packages.fair_build import build
from autograder.packages.workspace import SOURCES
from autograder.sandbox.scratch import Scratch


def main() -> int:
    """Read one package from standard input, build it, and write the result to standard output."""
    given = Sources.model_validate_json(sys.stdin.buffer.read())
    with Scratch() as scratch:
        scratch.chmod(0o755)  # the inner sandbox runs as another user
        folder = scratch / SOURCES / given.package
        for path, text in given.files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        try:
            run = build(scratch / SOURCES, given.package, given.isolation)
        except KitError as error:  # the worker tries again and reports the error
            print(error, file=sys.stderr)
            return 1
    sys.stdout.write(run.model_dump_json())
    return 0


if __name__ == "__main__":
    sys.exit(main())
