"""Write the page with all answers in words to one question, with similar answers side by side for whoever grades them.

The similarity of words only sorts the answers. It gives no points, because a person decides.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup
from rapidfuzz import fuzz, utils

from autograder.core.files import write_beside
from autograder.core.grades import CellGrade
from autograder.report.export.entry import points
from autograder.report.html import render

_ALIKE = 75
"""The similarity of words, from 0 to 100, from which on two answers stand in one group."""


@dataclass(frozen=True)
class WrittenAnswer:
    """A student's answer in words."""

    student: str
    text: str
    grade: CellGrade

    @property
    def quoted(self) -> str:
        """The student's name for a command line."""
        return shlex.quote(self.student)

    @property
    def points(self) -> str:
        """The points in words."""
        if self.grade.points is None:
            return "not graded yet"
        return f"{points(self.grade.points)} of {points(self.grade.max_points)}"

    @property
    def comment(self) -> str:
        """What a person wrote about the answer."""
        return self.grade.comment


def groups(answers: Sequence[WrittenAnswer]) -> list[list[WrittenAnswer]]:
    """Return the answers in groups, the largest first. All answers of a group are similar to its first one."""
    found: list[list[WrittenAnswer]] = []
    for answer in sorted(answers, key=lambda one: (-len(one.text), one.student)):
        for group in found:
            if fuzz.token_sort_ratio(group[0].text, answer.text, processor=utils.default_process) >= _ALIKE:
                group.append(answer)
                break
        else:
            found.append([answer])
    return sorted(found, key=len, reverse=True)


def write_answers_page(path: Path, lab: str, cell: str, scheme: str, answers: Sequence[WrittenAnswer]) -> Path:
    """Write the page and return its path.

    Args:
        path: the file for the page.
        lab: the lab.
        cell: the grade_id of the question.
        scheme: the course's answer with its mark scheme, as Markdown. It is the course's own, so it may hold HTML.
        answers: the answers of the class.
    """
    from nbconvert.filters import markdown2html

    comments = Counter(answer.comment for answer in answers if answer.comment)
    page = render(
        "answers.html",
        lab=lab,
        cell=cell,
        scheme=Markup(markdown2html(scheme)),
        count=len(answers),
        most=points(answers[0].grade.max_points),
        open=sum(answer.grade.points is None for answer in answers),
        comments=comments.most_common(),
        groups=groups(answers),
    )
    write_beside(path, page)
    return path
