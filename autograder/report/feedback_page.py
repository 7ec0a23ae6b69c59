"""Make a student's feedback page: the points, what to repair first, and then each task, all in one file."""

from __future__ import annotations

import datetime
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from types import MappingProxyType

from markupsafe import Markup

from autograder.core.grades import CellGrade, Grade, in_points
from autograder.core.history import Decided, Event
from autograder.core.results import CheckResult, SubmissionResult
from autograder.core.version import VERSION
from autograder.course.cells import TEXT_STUB
from autograder.report import words
from autograder.report.audience import reason, result_for
from autograder.report.html import check_html, render
from autograder.report.words import Verdict

NO_DECISIONS: Mapping[str, Decided] = MappingProxyType({})
"""The answers to appeals of a student who has made none."""
_FIRST = 3
"""The number of reasons that are listed under "What to repair first"."""


@dataclass
class Task:
    """A task of the lab: a section under one heading that has points."""

    title: str
    graded: list[str] = field(default_factory=list)
    """The grade_ids of its graded cells, in order."""
    answers: dict[str, str] = field(default_factory=dict)
    """The student's answers, by grade_id."""
    part: str = ""
    """The part of the lab to which the task belongs; the task's own title if that part has no smaller sections."""


@dataclass(frozen=True)
class Heading:
    """The top of the page."""

    lab: str
    student: str
    name: str = ""
    handed_in: str = ""
    """The date and time of the submission; empty if they are not known."""

    @property
    def quoted(self) -> str:
        """The student's id as a word of a shell command."""
        return shlex.quote(self.student)


@dataclass
class _Repair:
    """A reason why points were lost, with the tasks that it concerns."""

    why: str
    hint: str
    lost: float = 0.0
    tasks: dict[str, str] = field(default_factory=dict)
    """The titles of the tasks, by their anchor on the page."""
    checks: set[str] = field(default_factory=set)
    begun: bool = False
    """Whether the student has begun any of these tasks."""

    @property
    def points(self) -> str:
        """The lost points in words, such as `1 point`."""
        number = _number(self.lost)
        return f"{number} {'point' if number == '1' else 'points'}"


@dataclass(frozen=True)
class _Graded:
    """A graded cell in the form that the page shows."""

    points: str
    verdict: str
    look: Verdict
    report: Markup
    comment: str
    remark: str
    decided: Decided | None
    """The answer to the student's appeal."""
    answer: str
    """The text of an answer that a person grades."""


def feedback_html(
    heading: Heading,
    tasks: Sequence[Task],
    result: SubmissionResult | None,
    grade: Grade,
    written: datetime.date,
    decided: Mapping[str, Decided] = NO_DECISIONS,
    history: Sequence[Event] = (),
) -> str:
    """Return the page as HTML.

    Args:
        heading: the top of the page.
        tasks: the tasks in the lab's order.
        result: the result of the checks; None if it is no longer stored.
        grade: the grade in the gradebook.
        written: the date that is shown on the page.
        decided: the answers to appeals, by grade_id.
        history: what happened to the points; empty if the page does not show it.
    """
    shown = result_for(result, "student") if result is not None else None
    checks = {check.grade_id: check for check in shown.checks} if shown is not None else {}
    cells = {cell.grade_id: cell for cell in grade.cells}
    repairs = _repairs(tasks, cells, checks)
    first = {name for repair in repairs for name in repair.checks}
    sections = [
        _section(f"task-{number}", task, cells, checks, decided, first) for number, task in enumerate(tasks, start=1)
    ]
    return render(
        "feedback.html",
        heading=heading,
        total=_total(grade),
        penalty=f"{grade.penalty:g}" if grade.penalty else "",
        waiting=grade.told_waiting,
        problems=shown.problems if shown is not None else [],
        sections=sections,
        parts=_parts(tasks, cells, sections),
        repairs=repairs,
        history=history,
        lab=result.lab if result is not None else "",
        written=f"{written.day} {written:%B %Y}",
        version=result.kit_version if result is not None else VERSION,
        digest=result.digest[:12] if result is not None else "",
        isolation=result.isolation.value if result is not None else "",
    )


def _section(
    anchor: str,
    task: Task,
    cells: Mapping[str, CellGrade],
    checks: Mapping[str, CheckResult],
    decided: Mapping[str, Decided],
    first: set[str],
) -> dict[str, object]:
    """Return what the page shows of a task; the pictures of checks that are not repaired first are folded."""
    graded = {name: cells[name] for name in task.graded if name in cells}
    of_task = list(graded.values())
    return {
        "title": task.title,
        "anchor": anchor,
        "points": _points(of_task),
        "verdict": _verdict(of_task, [checks[name] for name in task.graded if name in checks], task),
        "graded": [
            _graded(cell, checks.get(name), task, decided.get(name), fold=name not in first)
            for name, cell in graded.items()
        ],
        "lost": [name for name, cell in graded.items() if name not in decided and _lost(cell, checks.get(name))],
        "programs": [(name, text) for name, text in task.answers.items() if name not in task.graded],
    }


def _parts(
    tasks: Sequence[Task], cells: Mapping[str, CellGrade], sections: Sequence[Mapping[str, object]]
) -> list[dict[str, object]]:
    """Group the sections by part of the lab. A part with only one section of the same name gets no title."""
    parts = []
    pairs = zip(tasks, sections, strict=True)
    for title, group in groupby(pairs, key=lambda pair: pair[0].part):
        inside = list(group)
        named = bool(title) and [task.title for task, _ in inside] != [title]
        graded = [cells[name] for task, _ in inside for name in task.graded if name in cells]
        of_part = [section for _, section in inside]
        parts.append({"title": title if named else "", "points": _points(graded), "sections": of_part})
    return parts


def _number(points: float) -> str:
    return f"{round(points, 2):g}"


def _total(grade: Grade) -> str:
    so_far = " so far" if grade.waiting else ""
    return f"{_number(grade.earned)} of {_number(grade.max_score)} points{so_far}"


def _points(cells: Sequence[CellGrade]) -> str:
    top = _number(sum(cell.max_points for cell in cells))
    decided = [cell.points for cell in cells if cell.points is not None]
    if not decided:
        return f"not graded yet, of {top}"
    open_ = ", rest not graded yet" if len(decided) < len(cells) else ""
    return f"{_number(sum(decided))} of {top}{open_}"


def _verdict(cells: Sequence[CellGrade], checks: Sequence[CheckResult], task: Task) -> Verdict:
    if any(cell.points is None for cell in cells):
        return Verdict.UNKNOWN
    earned, top = sum(cell.points or 0.0 for cell in cells), sum(cell.max_points for cell in cells)
    texts = [task.answers.get(cell.grade_id, "?").strip() for cell in cells]
    untouched = all(text in ("", TEXT_STUB) for text in texts)
    if not earned and (untouched or any(words.verdict(check) is Verdict.NOT_ATTEMPTED for check in checks)):
        return Verdict.NOT_ATTEMPTED
    return Verdict.PASSED if earned >= top else Verdict.PARTLY if earned else Verdict.FAILED


def _graded(cell: CellGrade, check: CheckResult | None, task: Task, decided: Decided | None, fold: bool) -> _Graded:
    look = _verdict([cell], [check] if check is not None else [], task)
    title = f"Check {task.graded.index(cell.grade_id) + 1}" if len(task.graded) > 1 else ""
    report = Markup(check_html(check, title=title, fold_pictures=fold) if check is not None else "")
    remark = ""
    if cell.is_check and check is None:
        remark = "The report of this check is no longer stored."
    elif cell.is_check and cell.by_hand:
        remark = f"Your instructor has looked at this check and gives {in_points(cell.points or 0.0)}."
    return _Graded(
        points=_points([cell]),
        verdict="not graded yet" if cell.points is None else look.value,
        look=look,
        report=report,
        comment=cell.comment,
        remark=remark,
        decided=decided,
        answer=task.answers.get(cell.grade_id, ""),
    )


def _lost(cell: CellGrade, check: CheckResult | None) -> bool:
    """Return whether an attempted check lost points."""
    if check is None or cell.points is None or cell.points >= cell.max_points:
        return False
    return words.verdict(check) is not Verdict.NOT_ATTEMPTED


def _repairs(tasks: Sequence[Task], cells: Mapping[str, CellGrade], checks: Mapping[str, CheckResult]) -> list[_Repair]:
    """Return the reasons that cost the most points, each with the tasks for which it is the first reason.

    Tasks that the student has begun come before tasks that are still untouched, because only those can be repaired.
    """
    repairs: dict[str, _Repair] = {}
    for number, task in enumerate(tasks, start=1):
        for name in task.graded:
            cell, check = cells.get(name), checks.get(name)
            if cell is None or check is None or cell.points is None or cell.points >= cell.max_points:
                continue
            failure = check.first_failure
            untouched = words.not_attempted(check)
            why = untouched or (reason(failure) if failure is not None else "") or check.status.value
            hint = failure.hint if failure is not None and not untouched else ""
            repair = repairs.setdefault(why, _Repair(why, hint))
            repair.begun = repair.begun or words.verdict(check) is not Verdict.NOT_ATTEMPTED
            repair.lost += cell.max_points - cell.points
            repair.tasks[f"task-{number}"] = task.title
            repair.checks.add(name)
    return sorted(repairs.values(), key=lambda repair: (not repair.begun, -repair.lost))[:_FIRST]
