"""What a lecture's cells share: the programs of another page, and cells that need a compiler."""

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


def skip_without_compiler(word: str) -> None:
    """Where nothing can compile interfaces, let each cell with a word in it say so in a sentence, and do nothing else.

    Args:
        word: the name of the package that is compiled.
    """
    from IPython import get_ipython

    from autograder.packages.workspace import INSTALL, missing_tools

    lacking = missing_tools()
    if not lacking:
        return
    sentence = f"Not run here: building `{word}` needs {', '.join(lacking)}, which this machine lacks. {INSTALL}"

    def spoken(lines: list[str]) -> list[str]:
        writes_a_file = lines and lines[0].startswith("%%")
        return lines if writes_a_file or word not in "".join(lines) else [f"print({sentence!r})\n"]

    get_ipython().input_transformers_cleanup.append(spoken)
