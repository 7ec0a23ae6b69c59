"""How the kit's wheel is built: as others are, and with what each Python of its environment reads first."""

import runpy
from pathlib import Path

from setuptools.command.build_py import build_py  # type: ignore[import-untyped]


class WithFirstLines(build_py):  # type: ignore[misc]
    """Puts a file beside the package, which setuptools alone cannot."""

    def run(self) -> None:
        """Build the package, and write that file."""
        super().run()
        first = runpy.run_path(str(Path(__file__).with_name("first_lines.py")))  # the kit need not be importable
        Path(self.build_lib, first["FILE"]).write_text(first["TEXT"], encoding="utf-8")
