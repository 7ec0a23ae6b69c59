"""Write the page about a whole term for its instructors: all labs of all students, and who needs attention.

The points come from the gradebook. If the gradebook does not have a submission, they come from its checks.
"""

from __future__ import annotations

import base64
import datetime
import hashlib
import os
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from autograder.core.files import write_beside
from autograder.core.results import CheckResult
from autograder.report import words
from autograder.report.audience import reason
from autograder.report.class_page import SCRIPT, earned, share, top
from autograder.report.export.entry import Entry, points
from autograder.report.html import render
from autograder.report.words import Verdict

_HARD = 1 / 3
"""The share of its points below which a check is listed."""
_FEWEST = 3
"""The number of students who must have begun a check before it is listed."""
_LAST = 2
"""The number of labs, counted from the end, that show who falls behind."""

RosterLines = Mapping[str, Mapping[str, str]]
"""The lines of a roster, by the students' names in the gradebook."""


@dataclass(frozen=True)
class Appeal:
    """An appeal that waits for an answer."""

    student: str
    lab: str
    check: str
    since: str
    sentence: str
    file: str


class _Term:
    """The submissions of a term by student and lab, and each student's share of the points."""

    def __init__(
        self, entries: Sequence[Entry], labs: Sequence[str], weights: Mapping[str, float], roster: RosterLines
    ) -> None:
        self.by_student: dict[str, dict[str, Entry]] = {student: {} for student in roster}
        for entry in entries:
            self.by_student.setdefault(entry.student, {})[entry.lab] = entry
        self.roster = roster
        graded = {entry.lab for entry in entries}
        self.labs = [lab for lab in labs if lab in graded]
        self.weights = {lab: weights.get(lab, 1.0) for lab in self.labs}

    def share(self, student: str, lab: str) -> float:
        """Return the share of a lab's points that a student has; 0 if the student handed in nothing."""
        entry = self.by_student[student].get(lab)
        return earned(entry) / top(entry) if entry is not None and top(entry) else 0.0

    def known(self, student: str) -> dict[str, str]:
        """Return what the roster and the platforms say about a student, by heading."""
        lines = [*(entry.known for entry in self.by_student[student].values()), self.roster.get(student, {})]
        return {key: value for line in lines for key, value in line.items() if value}

    def left(self, student: str) -> bool:
        """Whether a student is no longer in the roster."""
        return bool(self.roster) and student not in self.roster

    @property
    def class_(self) -> list[str]:
        """The students who have not left. Means and medians are about these."""
        return [student for student in self.by_student if not self.left(student)]

    def total(self, student: str) -> float:
        """Return a student's weighted mean of all labs, in percent."""
        weight = sum(self.weights.values())
        return 100 * sum(self.weights[lab] * self.share(student, lab) for lab in self.labs) / weight if weight else 0.0


def write_term_page(
    path: Path,
    title: str,
    entries: Sequence[Entry],
    labs: Sequence[str],
    weights: Mapping[str, float],
    appeals: Sequence[Appeal],
    written: datetime.date,
    roster: RosterLines,
) -> Path:
    """Write the page and return its path.

    Args:
        path: the file for the page.
        title: the title of the course.
        entries: the submissions of all labs.
        labs: the course's labs in the course's order.
        weights: the weight of each lab; a lab that is not listed has the weight 1.
        appeals: the appeals that wait for an answer.
        written: the date that is shown on the page.
        roster: the lines of the roster by student; empty if the course has none. Its students are on the page even if
            nothing of theirs was ever graded.
    """
    term = _Term(entries, labs, weights, roster)
    totals = [term.total(student) for student in term.class_]
    script = SCRIPT.read_text(encoding="utf-8")
    page = render(
        "term.html",
        title=title,
        written=f"{written.day} {written:%B %Y}",
        labs=[{"name": lab, "weight": f"weight {term.weights[lab]:g}"} for lab in term.labs],
        count=len(totals),
        mean=points(statistics.fmean(totals)),
        median=points(statistics.median(totals)),
        appeals=appeals,
        behind=_behind(term),
        hard=_hard(entries, term.labs),
        students=[_student(student, term, path) for student in sorted(term.by_student)],
        script=Markup(script),
        digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )
    write_beside(path, page)
    return path


def _behind(term: _Term) -> list[dict[str, str]]:
    last = term.labs[-_LAST:]
    means = {student: statistics.fmean(term.share(student, lab) for lab in last) for student in term.by_student}
    median = statistics.median(means[student] for student in term.class_)
    found = []
    for student, of_labs in sorted(term.by_student.items()):
        if not of_labs:
            why = "nothing was graded in the whole term."
        elif last[-1] not in of_labs:
            if term.left(student):
                continue
            why = f"nothing was graded for {last[-1]}."
        elif means[student] < median / 2:
            both = " and ".join(last)
            why = f"{100 * means[student]:.0f} % of the points of {both}; the class's median is {100 * median:.0f} %."
        else:
            continue
        found.append({"student": student, "name": term.known(student).get("name", ""), "why": why})
    return found


def _hard(entries: Sequence[Entry], labs: Sequence[str]) -> list[dict[str, object]]:
    """Return the checks of which the class has few points, the worst first."""
    begun: dict[tuple[str, str], list[tuple[Entry, CheckResult]]] = {}
    for entry in entries:
        for check in entry.result.checks:
            if words.verdict(check) not in (Verdict.NOT_ATTEMPTED, Verdict.UNKNOWN):
                begun.setdefault((entry.lab, check.grade_id), []).append((entry, check))
    found = []
    for (lab, grade_id), of_check in begun.items():
        mean = statistics.fmean(share(entry, check) for entry, check in of_check)
        if len(of_check) >= _FEWEST and mean < _HARD and lab in labs:
            failures = [check.first_failure for _, check in of_check]
            reasons = Counter(failure.code for failure in failures if failure is not None)
            code = reasons.most_common(1)[0][0] if reasons else ""
            why = next((reason(failure) for failure in failures if failure is not None and failure.code == code), "")
            title = of_check[0][1].title or grade_id
            row = {"lab": lab, "title": title, "grade_id": grade_id, "count": len(of_check), "why": why}
            found.append((mean, row | {"percent": round(100 * mean)}))
    return [row for _, row in sorted(found, key=lambda pair: pair[0])]


def _student(student: str, term: _Term, page: Path) -> dict[str, object]:
    entries = term.by_student[student]
    labs = []
    for lab in term.labs:
        entry = entries.get(lab)
        feedback = entry.feedback if entry is not None else None
        labs.append(
            {
                "percent": f"{100 * term.share(student, lab):.1f}",
                "points": "none" if entry is None else f"{points(earned(entry))} of {points(top(entry))}",
                "link": quote(os.path.relpath(feedback, page.parent)) if feedback is not None else "",
            }
        )
    known = term.known(student)
    return {
        "student": student,
        "name": known.get("name", ""),
        "section": "not in the roster" if term.left(student) else known.get("section", ""),
        "total": f"{term.total(student):.1f}",
        "waiting": sum(len(entry.grade.waiting) for entry in entries.values() if entry.grade is not None),
        "late": sum(entry.late or bool(entry.grade and entry.grade.penalty) for entry in entries.values()),
        "labs": labs,
    }
