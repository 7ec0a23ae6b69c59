"""The Validate of nbgrader, as a command and in JupyterLab: what `autograder check` says, in its words.

nbgrader's own validation runs the notebook in the session of whoever asks, an instructor's too, judges by outputs, and
shows the source of the checks. Instructors' environments come here by their course's configuration, students' by
`environment/nbgrader_config.py`.
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
from autograder.grading.runner import WORKERS_FOR_ONE, Settings, run_submission
from autograder.report import words
from autograder.report.audience import result_for
from autograder.report.terminal import plain
from autograder.sandbox.isolation import choose, most
from autograder.setup.refusals import SetUpError, refuse_foreign_ros
from autograder.submission.reader import lab_of

Verdicts = dict[str, list[dict[str, str]]]
"""What did not pass, or what did, in the form that nbgrader's validator shows."""
HEADING = "{num_failed} part(s) did not pass, or could not be checked:"
"""What nbgrader says above them."""
_WIDTH = 80
"""Columns; nbgrader cuts what is longer."""


def replace_validator(validate: Callable[[Path, bool], Verdicts]) -> None:
    """Put another way in place of nbgrader's validation, for this process; it has no setting for that.

    Args:
        validate: gets a notebook, and whether what passed is asked for.
    """
    from nbgrader.validator import Validator

    def validated(self: Any, filename: str) -> Verdicts:
        return validate(Path(filename), self.invert)

    Validator.validate = validated


def use_own_course(config: Any) -> None:
    """Let Validate check with the course that this environment belongs to, as a student's kit does.

    Args:
        config: traitlets' Config, as `get_config()` gives it.
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
    """Check a notebook in the sandbox, and return what did not pass in the form that nbgrader shows.

    Args:
        root: of the course.
        notebook: to check.
        invert: return what passed instead.
    """
    try:
        refuse_foreign_ros(os.environ)
        lab = lab_of(notebook, None, root)
        isolation = most()[0] if is_students_kit() else choose(Isolation.FULL)
        student = notebook.resolve().parent.name
        result = run_submission(notebook, student, lab, Settings(isolation=isolation), workers=WORKERS_FOR_ONE)
    except (KitError, SetUpError) as error:
        return not_checked(notebook, error.what, error.do)
    result = result_for(result, "student")
    if invert:
        return {"passed": [{"source": check.title} for check in result.checks if check.status is Status.PASSED]}
    failed = [_entry(problem.title, _lines(problem)) for problem in result.problems]
    for check in result.checks:
        if check.status is not Status.PASSED:
            untouched = [text for text in (words.not_attempted(check),) if text]
            said = [found for found in check.outcomes if found.status in (Status.FAILED, Status.UNKNOWN)]
            lines = untouched or [line for found in said or check.outcomes for line in _lines(found)]
            title = check.title or check.grade_id
            failed.append(_entry(f"{title}: {words.verdict(check)}, {words.points(check)}", lines))
    return {"failed": failed} if failed else {}


def not_checked(notebook: Path, *why: str) -> Verdicts:
    """Say that a notebook was not checked, and why."""
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
