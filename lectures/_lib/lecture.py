"""What a lecture's cells share: the programs of another page, so that a talk runs what the book shows."""

from __future__ import annotations

import contextlib
import io
import os
import re
from pathlib import Path

_CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"(?:^|\n)%%(node|file) (\S+)\n(.*)", re.DOTALL)


def programs(page: Path) -> dict[str, str]:
    """The files that a page's cells write, by their names: `car.py`, `car.yaml`."""
    found = {}
    for cell in _CELL.findall(page.read_text(encoding="utf-8")):
        head = _FILE.search(cell)
        if head:
            found[f"{head[2]}.py" if head[1] == "node" else head[2]] = head[3]
    return found


def write_programs(page: str) -> None:
    """Write the programs of a page of the book, as if its cells had been run in this notebook."""
    from IPython import get_ipython

    for name, text in programs(Path(os.environ["LECTURES"]) / f"{page}.md").items():
        magic, argument = ("node", name.removesuffix(".py")) if name.endswith(".py") else ("file", name)
        with contextlib.redirect_stdout(io.StringIO()):
            get_ipython().run_cell_magic(magic, argument, text)
