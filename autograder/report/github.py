"""Write a result for GitHub Actions: a line in the log for each finding, and a summary of the step in Markdown.

Source: GitHub's documentation, "Workflow commands for GitHub Actions".
"""

from __future__ import annotations

from pathlib import Path

from autograder.core.results import Outcome, Status, SubmissionResult
from autograder.report import words
from autograder.report.audience import reason


def commands(result: SubmissionResult, notebook: Path) -> str:
    """Return the workflow commands that become annotations: errors for failures, and warnings for undecided checks.

    Args:
        result: the result as its reader may see it.
        notebook: the notebook that was checked. All findings belong to the file as a whole.
    """
    lines = [
        _line("notice" if problem.status is Status.NOTE else "error", notebook, problem.title, problem)
        for problem in result.problems
    ]
    for check in result.checks:
        for outcome in check.outcomes:
            kind = {Status.FAILED: "error", Status.UNKNOWN: "warning"}.get(outcome.status)
            if kind:
                lines.append(_line(kind, notebook, f"{check.title or check.grade_id}: {outcome.title}", outcome))
    return "".join(f"{line}\n" for line in lines)


def summary(result: SubmissionResult) -> str:
    """Return the summary of the step in Markdown: a table of the checks, and below it the findings.

    Args:
        result: the result as its reader may see it.
    """
    rows = [
        f"| {words.SYMBOL[words.verdict(check)]} | {_cell(check.title or check.grade_id)} | {words.points(check)} |"
        for check in result.checks
    ]
    told = [f"- **{_cell(one.title)}**: {_cell(reason(one))}" for one in result.problems]
    for check in result.checks:
        bad = [one for one in check.outcomes if one.status in (Status.FAILED, Status.UNKNOWN)]
        told += [
            f"- **{_cell(check.title or check.grade_id)}**, {_cell(one.title)}: {_cell(reason(one))}" for one in bad
        ]
    head = [
        f"## {result.lab}: {result.points:g} of {result.max_points:g} points",
        "",
        "| | check | points |",
        "|-|-|-|",
    ]
    return "\n".join([*head, *rows, "", *told]) + "\n"


def _line(kind: str, notebook: Path, title: str, outcome: Outcome) -> str:
    """Return a workflow command in which characters that could end it early are escaped."""
    said = "\n".join(text for text in (reason(outcome), outcome.hint) if text)
    names = {"file": str(notebook), "title": title}
    properties = ",".join(f"{key}={_escaped(value, ':,')}" for key, value in names.items())
    return f"::{kind} {properties}::{_escaped(said or title)}"


def _escaped(text: str, more: str = "") -> str:
    for character in f"%\r\n{more}":
        text = text.replace(character, f"%{ord(character):02X}")
    return text


def _cell(text: str) -> str:
    """Escape a text for a line of Markdown, so that it cannot begin a tag, a link, a picture or a cell of a table."""
    plain = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;")
    return "".join(f"\\{character}" if character in "\\|[]!*_~" else character for character in plain)
