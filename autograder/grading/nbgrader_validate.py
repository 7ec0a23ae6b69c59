"""Replace nbgrader's Validate, as a command and in JupyterLab, so that it shows what `autograder check` shows.

nbgrader's own validation runs the notebook in the session of the person who asks, even of an instructor. It also judges
by outputs and shows the source of the checks. The configuration of a course installs this replacement in instructors'
environments, and `environment/nbgrader_config.py` installs it in students' environments.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.core.results import Isolation, Outcome, Status
from autograder.course.paths import is_students_kit, trusted_course
from autograder.grading.runner import Settings, run_submission, workers_for_one
from autograder.report import words
from autograder.report.audience import result_for
from autograder.report.terminal import plain
from autograder.sandbox.isolation import choose, most
from autograder.setup.refusals import SetUpError, refuse_foreign_ros
from autograder.submission.reader import lab_of

Verdicts = dict[str, list[dict[str, str]]]
"""The checks that did not pass, or those that did, in the form that nbgrader's validator shows."""
HEADING = "{num_failed} part(s) did not pass, or could not be checked:"
"""The heading that nbgrader shows above them."""
_WIDTH = 80
"""The number of columns in a line. nbgrader cuts off longer lines."""


def replace_validator(validate: Callable[[Path, bool], Verdicts]) -> None:
    """Replace nbgrader's validation in this process. nbgrader has no setting for that.

    Args:
        validate: a function that gets a notebook, and whether to return the cells that passed.
    """
    from nbgrader.validator import Validator

    def validated(self: Any, filename: str) -> Verdicts:
        return validate(Path(filename), self.invert)

    Validator.validate = validated


def use_own_course(config: Any) -> None:
    """Make Validate use the checks of the course that belongs to this environment, as in a student's kit.

    Args:
        config: the Config of traitlets that `get_config()` returns.
    """
    config.Validator.failed_warning = HEADING

    def validate(notebook: Path, invert: bool) -> Verdicts:
        try:
            root = trusted_course(None)
        except KitError as error:
            return not_checked(notebook, error.what, error.do)
        return verdicts(root, notebook, invert)

    replace_validator(validate)


def verdicts(root: Path, notebook: Path, invert: bool) -> Verdicts:
    """Check a notebook in the sandbox, and return the checks that did not pass in the form that nbgrader shows.

    Args:
        root: the course's folder.
        notebook: the notebook to check.
        invert: whether to return the checks that passed instead.
    """
    try:
        refuse_foreign_ros(os.environ)
        lab = lab_of(notebook, None, root)
        isolation = most()[0] if is_students_kit() else choose(Isolation.FULL)
        student = notebook.resolve().parent.name
        result = run_submission(notebook, student, lab, Settings(isolation=isolation), workers=workers_for_one())
    except (KitError, SetUpError) as error:
        return not_checked(notebook, error.what, error.do)
    result = result_for(result, "student")
    if invert:
        return {"passed": [{"source": check.title} for check in result.checks if check.status is Status.PASSED]}
    failed = [_entry(problem.title, _lines(problem)) for problem in result.real_problems]
    for check in result.checks:
        if check.status is not Status.PASSED:
            untouched = [text for text in (words.not_attempted(check),) if text]
            said = [found for found in check.outcomes if found.status in (Status.FAILED, Status.UNKNOWN)]
            lines = untouched or [line for found in said or check.outcomes for line in _lines(found)]
            title = check.title or check.grade_id
            failed.append(_entry(f"{title}: {words.verdict(check)}, {words.points(check)}", lines))
    return {"failed": failed} if failed else {}


def not_checked(notebook: Path, *why: str) -> Verdicts:
    """Return an entry that says that a notebook was not checked, and why."""
    return {"failed": [_entry(f"{notebook.name} was not checked", list(why))]}


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
    from nbconvert.filters import ansi2html

    rows = [row for line in lines for part in plain(line).splitlines() for row in textwrap.wrap(part, _WIDTH)]
    text = "\n".join(rows)
    return {"source": plain(title), "error": ansi2html(text), "raw_error": text}
