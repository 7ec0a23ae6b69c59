"""Build the kit's wheel like any other, but with the file that each Python of its environment reads first."""

import runpy
from pathlib import Path

from setuptools.command.build_py import build_py  # type: ignore[import-untyped]


class WithFirstLines(build_py):  # type: ignore[misc]
    """Adds a file beside the package, which setuptools alone cannot do."""

    def run(self) -> None:
        """Build the package, and write the file."""
        super().run()
        first = runpy.run_path(str(Path(__file__).with_name("first_lines.py")))  # the kit need not be importable
        Path(self.build_lib, first["FILE"]).write_text(first["TEXT"], encoding="utf-8")
