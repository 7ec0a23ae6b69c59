"""A student's server on a JupyterHub: the folder with the labs, and the page that is opened first."""

from __future__ import annotations

import os
from pathlib import Path

from autograder.core.files import write_beside
from autograder.course.paths import book_of_kit
from autograder.notebook.book_server import ROUTE
from autograder.setup.places import KIT_FOLDER, ROOT

_PREFIX = "JUPYTERHUB_SERVICE_PREFIX"
"""The variable with the path below which JupyterHub serves a user's server, `/user/ann/`."""
_GET = """\
To get a lab, choose *Nbgrader → Assignment List* in the menu and click on *Fetch*; its name in the table below then
leads to it. To hand it in, save it and click on *Submit* there. When it has been graded, *Fetch Feedback* brings the
feedback.
"""


def is_on_hub() -> bool:
    """Return whether a JupyterHub has started this process."""
    return _PREFIX in os.environ


def own_labs() -> Path:
    """Return the folder `labs` of the user's home, with the page of the labs in it.

    Nobody else can read the home then, because it holds the user's answers and programs.

    Raises:
        OSError: the home cannot be written.
    """
    home = Path.home()
    home.chmod(0o700)
    labs = home / "labs"
    labs.mkdir(exist_ok=True)
    page = (ROOT / KIT_FOLDER / "labs" / "README.md").read_text(encoding="utf-8")
    title, _, below = page.partition("\n")
    book = f"\n[Read the lectures]({os.environ[_PREFIX]}{ROUTE}/index.html).\n" if book_of_kit() else ""
    write_beside(labs / "README.md", f"{title}\n\n{_GET}{book}{below}")
    return labs
