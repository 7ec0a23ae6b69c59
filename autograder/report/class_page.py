"""Write the class page of a lab for its instructors. The page shows hidden checks, so it is not for students.

The points come from the gradebook. If the gradebook does not have a submission, they come from its checks.
"""

from __future__ import annotations

import base64
import datetime
import hashlib
import os
import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from autograder.core.files import write_beside
from autograder.core.grades import in_points
from autograder.core.history import told
from autograder.core.results import CheckResult, Ranked, Status
from autograder.report import words
from autograder.report.audience import reason
from autograder.report.export.entry import Entry, points
from autograder.report.html import render
from autograder.report.terminal import class_status, why_lost
from autograder.report.words import Verdict

_BINS = 10
"""The number of bars in the distribution. All of them have the same width in points."""
_LOOK = "look at this; the points stay"
_FEWEST = 5
"""The number of students that is needed to compute a discrimination."""
_MOST_ROWS = 500
"""The number of students that the page shows at first. A browser needs seconds to lay out thousands of rows."""
SCRIPT = Path(__file__).with_name("templates") / "class.js"
"""The program in the page, which sorts and searches its tables."""


@dataclass(frozen=True)
class _Person:
    """Something that a person has to look at."""

    student: str
    what: str
    why: str


def _together(persons: Sequence[_Person]) -> list[dict[str, object]]:
    """Combine entries that are the same for several students."""
    students: dict[tuple[str, str], list[str]] = {}
    for person in persons:
        students.setdefault((person.what, person.why), []).append(person.student)
    return [
        {"what": what, "why": why, "count": len(names), "students": ", ".join(dict.fromkeys(names))}
        for (what, why), names in students.items()
    ]


def write_class_page(
    path: Path, entries: Sequence[Entry], written: datetime.date, shared: Sequence[Sequence[str]] = ()
) -> Path:
    """Write the page of one lab and return its path.

    Args:
        path: the file for the page.
        entries: the lab's submissions.
        written: the date that is shown on the page.
        shared: groups of students who have handed in the same recorded run.
    """
    scores = [earned(entry) for entry in entries]
    most = max((top(entry) for entry in entries), default=0.0)
    script = SCRIPT.read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = render(
        "class.html",
        lab=entries[0].lab,
        written=f"{written.day} {written:%B %Y}",
        count=len(entries),
        most_rows=_MOST_ROWS,
        top=points(most),
        mean=points(statistics.fmean(scores)),
        median=points(statistics.median(scores)),
        lowest=points(min(scores)),
        highest=points(max(scores)),
        bars=_distribution(scores, most),
        persons=[*_together(_persons(entries)), *map(_shared, shared)],
        checks=_checks(entries),
        best=_best(entries),
        students=[_student(entry, path) for entry in entries],
        script=Markup(script),
        digest=digest,
    )
    write_beside(path, page)
    return path


def earned(entry: Entry) -> float:
    """Return the points of a submission."""
    return entry.result.points if entry.grade is None else entry.grade.earned


def top(entry: Entry) -> float:
    """Return the most points that a submission can get."""
    return entry.result.max_points if entry.grade is None else entry.grade.max_score


def _distribution(scores: Sequence[float], top: float) -> list[dict[str, object]]:
    counts = Counter(min(_BINS - 1, int(_BINS * score / top)) if top else 0 for score in scores)
    most = max(counts.values(), default=1)
    step = top / _BINS
    bars: list[dict[str, object]] = []
    for number in range(_BINS):
        last = number == _BINS - 1
        label = f"{points(number * step)} to {'' if last else 'below '}{points((number + 1) * step)}"
        bars.append({"label": label, "count": counts[number], "percent": round(100 * counts[number] / most)})
    return bars


def _shared(students: Sequence[str]) -> dict[str, object]:
    why = "They have handed in the same recorded run."
    return {"what": _LOOK, "why": why, "count": len(students), "students": ", ".join(students)}


def _persons(entries: Sequence[Entry]) -> list[_Person]:
    found = []
    for entry in entries:
        for check in entry.result.checks:
            cell = next((c for c in entry.grade.cells if c.grade_id == check.grade_id), None) if entry.grade else None
            if check.status is Status.UNKNOWN and (cell is None or cell.points is None):
                why = reason(check.first_failure) if check.first_failure else "The grader could not find out."
                found.append(
                    _Person(entry.student, f"{_title(check)}: decide about {in_points(check.max_points)}", why)
                )
        for cell in entry.grade.waiting if entry.grade is not None else ():
            if not cell.is_check:
                what = f"{cell.grade_id}: {in_points(cell.max_points)}"
                found.append(_Person(entry.student, what, "An answer in words, which nobody has graded yet."))
        for cell in entry.grade.stale if entry.grade is not None else ():
            what = f"{cell.grade_id}: {in_points(cell.points or 0.0)} by hand"
            found.append(_Person(entry.student, what, "The work has changed since you graded it, so look at it again."))
        found += [_Person(entry.student, _LOOK, flag) for flag in entry.result.flags]
        if entry.grade is None:
            found.append(_Person(entry.student, "not in the gradebook", "Grade the class again."))
    return found


def _title(check: CheckResult) -> str:
    return check.title or check.grade_id


def _checks(entries: Sequence[Entry]) -> list[dict[str, object]]:
    """Return a row of statistics for each check, in the lab's order."""
    order = list(dict.fromkeys(check.grade_id for entry in entries for check in entry.result.checks))
    rows = []
    for grade_id in order:
        found = [(entry, check) for entry in entries for check in entry.result.checks if check.grade_id == grade_id]
        verdicts = Counter(words.verdict(check) for _, check in found)
        shares = [share(entry, check) for entry, check in found]
        first = found[0][1]
        rows.append(
            {
                "title": _title(first),
                "grade_id": grade_id,
                "max_points": points(first.max_points),
                "count": len(found),
                "passed": verdicts[Verdict.PASSED] + verdicts[Verdict.HOLDS],
                "partly": verdicts[Verdict.PARTLY],
                "failed": verdicts[Verdict.FAILED],
                "untouched": verdicts[Verdict.NOT_ATTEMPTED],
                "undecided": verdicts[Verdict.UNKNOWN],
                "percent": round(100 * statistics.fmean(shares)),
                "discrimination": _discrimination(found, shares),
                "reasons": _reasons([check for _, check in found]),
            }
        )
    return rows


def share(entry: Entry, check: CheckResult) -> float:
    """Return the share of a check's points that a student has, from 0 to 1."""
    cells = entry.grade.cells if entry.grade is not None else ()
    earned = next((cell.points for cell in cells if cell.grade_id == check.grade_id), check.points)
    return (earned or 0.0) / check.max_points if check.max_points else 0.0


def _best(entries: Sequence[Entry]) -> list[dict[str, object]]:
    """Return a table for each check that ranks: who got all of its points, the least value first."""
    found: dict[str, list[tuple[str, CheckResult, Ranked]]] = {}
    for entry in entries:
        for check in entry.result.checks:
            if check.ranked is not None and check.points == check.max_points:
                found.setdefault(check.grade_id, []).append((entry.student, check, check.ranked))
    tables: list[dict[str, object]] = []
    for rows in found.values():
        rows.sort(key=lambda row: (row[2].value, row[0]))
        _, check, ranked = rows[0]
        told = [
            {
                "student": student,
                "value": f"{one.value:.1f}",
                "figures": [f"{figure:g}" for figure in one.figures.values()],
            }
            for student, _, one in rows
        ]
        tables.append({"title": _title(check), "unit": ranked.unit, "figures": list(ranked.figures), "rows": told})
    return tables


def _discrimination(found: Sequence[tuple[Entry, CheckResult]], shares: Sequence[float]) -> str:
    """Return the correlation of a check's points with those of all other checks, or a word if there is none."""
    rest = [earned(entry) - share * check.max_points for (entry, check), share in zip(found, shares, strict=True)]
    if len(found) < _FEWEST:
        return "too few"
    try:
        return f"{statistics.correlation(shares, rest):.2f}"
    except statistics.StatisticsError:  # all students have the same points
        return "all alike"


def _reasons(checks: Sequence[CheckResult]) -> list[dict[str, object]]:
    """Return the reasons why points were lost, the most frequent first. A reason counts once for each student."""
    counts: Counter[str] = Counter()
    example: dict[str, str] = {}
    for check in checks:
        bad = {one.code or "other": one for one in reversed(check.outcomes) if one.status is Status.FAILED}
        for code, outcome in bad.items():
            counts[code] += 1
            example.setdefault(code, reason(outcome))
    return [
        {"code": code, "told": f"{count} student{'' if count == 1 else 's'}: {example[code]}"}
        for code, count in counts.most_common()
    ]


def _student(entry: Entry, page: Path) -> dict[str, object]:
    grade = entry.grade
    link = quote(os.path.relpath(entry.feedback, page.parent)) if entry.feedback is not None else ""
    waiting = len(grade.waiting) if grade is not None else 0
    return {
        "student": entry.student,
        "name": entry.known.get("name", ""),
        "section": entry.known.get("section", ""),
        "points": points(earned(entry)),
        "waiting": waiting,
        "by_hand": sum(cell.by_hand for cell in grade.cells) if grade is not None else 0,
        "late": entry.late,
        "penalty": grade.penalty if grade is not None else 0.0,
        "status": class_status(entry.result),
        "why": why_lost(entry.result),
        "flags": len(entry.result.flags),
        "feedback": link,
        "history": told(entry.history),
    }
