"""Write the sheet for a talk with a student: questions with pictures, and then the expected answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from autograder.core.files import write_beside
from autograder.core.results import Picture, SubmissionResult
from autograder.own_run.question import Question
from autograder.report.export.entry import points
from autograder.report.html import render


@dataclass(frozen=True)
class Asked:
    """One question of the sheet."""

    text: str
    check: str
    """The check whose launch it is about."""
    expected: str
    choices: Sequence[str] = ()
    picture: Picture | None = None
    before: str = ""
    """A line of the student's program, if the question is about another text of this line."""
    after: str = ""
    because: str = ""
    """What the run said about the expected answer."""

    @classmethod
    def about_run(cls, question: Question, check: str, picture: Picture, expected: str) -> Asked:
        """Return a question about a recorded run."""
        return cls(question.text, check, expected, question.choices, picture)


def write_viva_page(path: Path, result: SubmissionResult, asked: Sequence[Asked]) -> Path:
    """Write the page and return its path.

    Args:
        path: the file for the page.
        result: of the submission that the questions are about.
        asked: the questions.
    """
    page = render(
        "viva.html",
        lab=result.lab,
        student=result.student,
        points=f"{points(result.points)} of {points(result.max_points)}",
        asked=asked,
    )
    write_beside(path, page)
    return path
