# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""Leads the Jupyter programs of a checkout's environment to the course's configuration; a wheel brings it along."""

import contextlib

from autograder.setup.places import ROOT, VENV, WHEEL


def lead_jupyter() -> None:
    """Let nbgrader, nbconvert and kernels of this environment use the course's configuration, wherever they start.

    Started elsewhere than in the course, nbgrader would go on with its own stages, which run what students wrote.
    nbconvert would write reports into Markdown as HTML, though they have a plain text. Kernels would not know what to
    say when a notebook's first cell was not run.
    """
    if WHEEL:
        return
    ours = ROOT / "autograder" / "notebook" / "jupyter"
    for folder, config in (
        ("jupyter", ROOT / "nbgrader_config.py"),
        ("jupyter", ours / "jupyter_nbconvert_config.json"),
        ("ipython", ours / "ipython_kernel_config.json"),
    ):
        link = VENV / "etc" / folder / config.name
        if not link.exists() or link.resolve() != config:
            with contextlib.suppress(OSError):
                link.unlink()
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(config)
