"""The HTML view, for the notebook and the feedback: inline styles only, everything of a student's escaped.

Each status is a word, a symbol and a colour at once, so that it can be read in print and with any colour vision. The
colours are Okabe and Ito's, darkened until they can be read as text on white.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from autograder.report.audience import Audience, check_for, result_for
from autograder.results import CheckResult, NodeLog, Status, SubmissionResult

_LOOK = {
    Status.PASSED: {"symbol": "✓", "word": "passed", "colour": "#00553d", "border": "2px solid #009e73"},
    Status.FAILED: {"symbol": "✗", "word": "failed", "colour": "#8f3a00", "border": "4px double #d55e00"},
    Status.NOT_CHECKED: {"symbol": "-", "word": "not checked", "colour": "#555555", "border": "2px dotted #767676"},
    Status.UNKNOWN: {"symbol": "?", "word": "could not find out", "colour": "#7a3f63", "border": "2px dashed #cc79a7"},
}


def _code(text: str) -> Markup:
    """Escape, and set what stands between backticks in code type."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:
        return escape(text)
    marked = [
        Markup('<code style="white-space:pre-wrap">{}</code>').format(piece) if number % 2 else escape(piece)
        for number, piece in enumerate(pieces)
    ]
    return Markup("").join(marked)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("autograder.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["code"] = _code
    environment.globals["look"] = lambda status: _LOOK[status]
    return environment


def render(template: str, **values: Any) -> str:
    """Fill in a template of this package; every value is escaped."""
    return _environment().get_template(template).render(**values)


def check_html(check: CheckResult, audience: Audience = "student", logs: list[NodeLog] | None = None) -> str:
    """Return one check's report as an HTML fragment.

    Args:
        check: to show.
        audience: a student does not see what hidden tests look at.
        logs: output of the check's programs, shown if the check did not pass.
    """
    shown = check_for(check, audience)
    return render("check.html", check=shown, logs=logs if logs and check.status is not Status.PASSED else [])


def submission_html(result: SubmissionResult, audience: Audience = "student") -> str:
    """Return a submission's whole report as one HTML page that needs no other file."""
    shown = result_for(result, audience)
    fragments = [
        Markup(check_html(check, audience, [log for log in shown.logs if log.grade_id == check.grade_id]))
        for check in shown.checks
    ]
    return render("submission.html", result=shown, fragments=fragments)
