"""nbgrader's Validate, as a command and in JupyterLab: the verdicts of `autograder check`, found in the same way.

nbgrader's own validation runs the notebook in the session of whoever asks, an instructor's too, and judges by outputs.
"""

from __future__ import annotations

import os
import textwrap
from pathlib import Path

from nbconvert.filters import ansi2html

from autograder.core.errors import KitError
from autograder.core.results import Isolation, Outcome, Status
from autograder.gradebook.private_nbgrader import Verdicts, replace_execution
from autograder.grading.runner import WORKERS_FOR_ONE, Settings, run_submission
from autograder.report import words
from autograder.report.audience import result_for
from autograder.report.terminal import plain
from autograder.sandbox.isolation import choose
from autograder.setup.refusals import SetUpError, refuse_foreign_ros
from autograder.submission.reader import lab_of

_WIDTH = 80
"""Columns; nbgrader cuts what is longer."""


def install(root: Path) -> None:
    """Put the course's way in place of nbgrader's, for this process, so that no setting and no other door leads there.

    Args:
        root: of the course whose checks are run.
    """
    replace_execution(
        lambda notebook, invert: verdicts(root, notebook, invert),
        lambda: KitError(
            "nbgrader's own execution is closed in this course: it would run students' code in your session.",
            "Use `autograder grade`, or nbgrader's commands without settings for their stages.",
        ),
    )


def close() -> None:
    """Close nbgrader's execution for this process, outside of any course."""
    what, do = "nbgrader executes nothing outside of a course.", "Start it in the folder of your course."

    def closed(notebook: Path, _: bool) -> Verdicts:
        return {"failed": [_entry(f"{notebook.name} was not checked", [what, do])]}

    replace_execution(closed, lambda: KitError(what, do))


def verdicts(root: Path, notebook: Path, invert: bool) -> Verdicts:
    """Check a notebook in the sandbox, and return what did not pass in the form that nbgrader shows.

    Args:
        root: of the course.
        notebook: to check.
        invert: return what passed instead.
    """
    try:
        refuse_foreign_ros(os.environ)
        lab = lab_of(notebook, None, root)
        settings = Settings(isolation=choose(Isolation.FULL))
        student = notebook.resolve().parent.name
        result = run_submission(notebook, student, lab, settings, workers=WORKERS_FOR_ONE)
    except (KitError, SetUpError) as error:
        return {"failed": [_entry(f"{notebook.name} was not checked", [error.what, error.do])]}
    result = result_for(result, "student")
    if invert:
        return {"passed": [{"source": check.title} for check in result.checks if check.status is Status.PASSED]}
    failed = [_entry(problem.title, _lines(problem)) for problem in result.problems]
    for check in result.checks:
        if check.status is not Status.PASSED:
            untouched = [text for text in (words.not_attempted(check),) if text]
            said = [found for found in check.outcomes if found.status in (Status.FAILED, Status.UNKNOWN)]
            lines = untouched or [line for found in said or check.outcomes for line in _lines(found)]
            failed.append(_entry(f"{check.title or check.grade_id}: {words.points(check)}", lines))
    return {"failed": failed} if failed else {}


def _lines(outcome: Outcome) -> list[str]:
    parts = {
        "": f"{outcome.title} ({outcome.status.value})",
        "expected: ": outcome.expected,
        "observed: ": outcome.observed,
        "because: ": outcome.because,
        "try: ": outcome.hint,
    }
    return [f"{label}{text}" for label, text in parts.items() if text]


def _entry(title: str, lines: list[str]) -> dict[str, str]:
    rows = [row for line in lines for part in plain(line).splitlines() for row in textwrap.wrap(part, _WIDTH)]
    text = "\n".join(rows)
    return {"source": plain(title), "error": ansi2html(text), "raw_error": text}
