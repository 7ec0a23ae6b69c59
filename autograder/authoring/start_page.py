"""`labs/README.md`: the page that a student's JupyterLab opens, made from the labs themselves."""

from __future__ import annotations

import json
import re
from pathlib import Path

from autograder.course.cells import source_of
from autograder.course.lab import lab_names
from autograder.course.settings import read_settings

START_PAGE = "README.md"

_TOP = """\
# {title}

Click on the name of a lab to open it, and work through it from the top: run each cell with Shift+Enter. A cell that
begins with `%%node NAME` or `%%file NAME` writes your program or file. The check below it runs the program and says
at once what works, and what does not work and why.

| Lab | About |
|---|---|
"""

_BOTTOM = """
- After you have changed a cell, run the cell again, and then its check.
- After a restart of the kernel, run the first code cell again, and then the cells of your programs.
- Your programs are in the folder `nodes` of the lab, below the name of the notebook. Only what you write in cells is
  graded; a file that you put into that folder yourself stays there, but is not handed in.
- `%%node?` and `%%file?` show an example. The tab key completes the names of your programs after `launch("`, commands
  and what is on the graph after `%ros2`, and what a launch can do after `ros.`.
- `%lab` at the end of a lab shows what is done and what is open.
- To hand in a lab, save the notebook and hand in this file, which has the ending `.ipynb`. In a terminal, `autograder
  submit NOTEBOOK` puts a copy with a receipt into the folder `handed_in`, and says what you should know before.
"""


def start_page(labs: Path) -> str:
    """Return the page for the labs in a folder, by the first heading of each and the sentence below it."""
    rows = []
    for path in [labs / name / f"{name}.ipynb" for name in lab_names(labs.parent)]:
        if not path.is_file():
            continue
        first = source_of(json.loads(path.read_text(encoding="utf-8"))["cells"][0])
        heading = re.search(r"^#\s+(.+?)\s*$", first, re.MULTILINE)
        below = _sentence(first[heading.end() :]) if heading else ""
        title = heading[1] if heading else path.stem
        rows.append(f"| [{title}]({path.stem}/{path.name}) | {below} |\n")
    return _TOP.format(title=read_settings(labs.parent).title) + "".join(rows) + _BOTTOM


def _sentence(text: str) -> str:
    """The first sentence of a paragraph, in one line."""
    paragraph = " ".join(text.strip().split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s", paragraph, maxsplit=1)[0]
