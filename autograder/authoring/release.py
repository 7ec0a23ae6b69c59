"""Write `labs/`: each lab as students receive it, unless the lab has an error, and the page that lists the labs."""

from __future__ import annotations

import json
import re
from pathlib import Path

from autograder.authoring.bank import refuse_unexplained
from autograder.authoring.lint.static import read_findings, release_findings
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.cells import source_of
from autograder.course.lab import lab_names, load_lab
from autograder.course.paths import CoursePaths
from autograder.course.settings import read_settings
from autograder.course.versions import remember
from autograder.gradebook.release import released_files

START_PAGE = "README.md"

_TOP = """\
# {title}

Click on the name of a lab to open it, and work through it from the top: run each cell with Shift+Enter. A cell that
begins with `%%node NAME` or `%%file NAME` writes your program or file. The check below it runs the program and says
at once what works, and what does not work and why.

| Lab | What to expect |
|---|---|
"""

_BOTTOM = """
- After you have changed a cell, run the cell again, and then its check.
- The checks are folded, and the sentence above a check says what it looks at. Shift+Enter runs a folded cell as it runs
  any other; a click opens it. The arrow keys pass over it.
- After a restart of the kernel, run the first code cell and the folded cell below it again, and then the cells of your
  programs.
- Your programs are in the folder `nodes` of the lab, below the name of the notebook. Only what you write in cells is
  graded; a file that you put into that folder yourself stays there, but is not handed in.
- Code that several programs share can be in a cell of its own: what a cell `%%node my_helpers` defines, the other
  programs import with `from my_helpers import …`.
- `%%node?` and `%%file?` show an example. The tab key completes the names of your programs after `launch("`, commands
  and what is on the graph after `%ros2`, and what a launch can do after `ros.`.
- `%lab` at the end of a lab shows what is done and what is still open.
- To hand in a lab, save the notebook and hand in this file, which has the ending `.ipynb`. In a terminal, `autograder
  submit NOTEBOOK` first tells you if something is wrong with the notebook, and then puts a copy with a receipt into the
  folder `handed_in`.
"""


def start_page(labs: Path) -> str:
    """Return the page that lists the labs in a folder, with the first heading of each and the sentence below it."""
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
    """Return the first sentence of a paragraph in one line."""
    paragraph = " ".join(text.strip().split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s", paragraph, maxsplit=1)[0]


def release(root: Path, lab: str) -> Path:
    """Write `labs/<lab>` and return that folder.

    Raises:
        KitError: there is no such lab under `solutions`, nbgrader could not generate it, or the lab has an error. The
            message names the cell.
    """
    found = read_findings(root, lab)
    errors = [one for one in found if not one.warning]
    if not errors:
        files = released_files(root, lab)
        errors = release_findings(files)
    if errors:
        raise KitError(f"{lab} is not released:\n" + "\n".join(f"  {one}" for one in errors), "Repair these cells.")
    refuse_unexplained(root, load_lab(root, lab))
    remember(root, lab, load_lab(root, lab).released)
    folder = CoursePaths(root).labs / lab
    for path, content in files.items():
        write_beside(folder / path, content)
    return folder
