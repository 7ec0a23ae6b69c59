"""Show check by check what grading a class would change, before anything is recorded."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from autograder.core.results import CheckResult, SubmissionResult
from autograder.gradebook.class_run import Tried
from autograder.report.audience import reason
from autograder.report.terminal import plain


def difference_view(tried: Tried) -> RenderableType:
    """Return a table with a row for each student's check whose points would change, and a summary."""
    table = Table(box=None, header_style="bold", padding=(0, 1), pad_edge=False, expand=True)
    for title in ("student", "check"):
        table.add_column(title, no_wrap=True, max_width=40, overflow="ellipsis")
    table.add_column("points", no_wrap=True)
    table.add_column("because", ratio=1, no_wrap=True, overflow="ellipsis")
    more = less = new = 0
    for result in tried.after:
        before = tried.before.get(result.student)
        if before is None:
            new += 1
            continue
        more += result.points > before.points
        less += result.points < before.points
        for row in _rows(result, before, tried):
            table.add_row(plain(result.student), *row)
    same = len(tried.after) - new - more - less
    said = f"{more} of {len(tried.after)} students would have more points, {less} fewer, {same} as many"
    said += f"; {new} have no result yet." if new else "."
    end = Text(f"{said} Nothing was recorded. To record these results, run the same command without --diff.")
    left_out: list[RenderableType] = [Text(plain(sentence)) for sentence in tried.collected.refused]
    above: list[RenderableType] = [table, Text()] if table.row_count else []
    return Group(*above, end, *left_out)


def _rows(after: SubmissionResult, before: SubmissionResult, tried: Tried) -> list[tuple[Text, Text, Text]]:
    had = {check.grade_id: check for check in before.checks}
    has = {check.grade_id: check for check in after.checks}
    grades = tried.grades.get(after.student)
    by_hand = {cell.grade_id: cell.points or 0.0 for cell in grades.cells if cell.by_hand} if grades else {}
    rows = []
    for name in (*has, *(name for name in had if name not in has)):
        old, new = had.get(name), has.get(name)
        if old is not None and new is not None and (old.points, old.max_points) == (new.points, new.max_points):
            continue
        title = (new or old or CheckResult(grade_id=name, max_points=0.0)).title or name
        failure = new.first_failure if new is not None else None
        passed = "no longer in the lab" if new is None else "it is passed"
        why = plain(reason(failure)) if failure is not None else passed
        if name in by_hand:
            why = f"the points given by hand ({by_hand[name]:g}) stay, but somebody should check them again; {why}"
        rows.append((Text(plain(title)), Text(f"{_points(old)} → {_points(new)}"), Text(why)))
    return rows


def _points(check: CheckResult | None) -> str:
    if check is None:
        return "none"
    return f"{'?' if check.points is None else f'{check.points:g}'}/{check.max_points:g}"
