"""Describe the result of a check in words that all views use."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from autograder.core.results import CellResult, Outcome, Part, Status, SubmissionResult


class Verdict(StrEnum):
    """The verdict on a check, as its heading shows it."""

    PASSED = "passed"
    HOLDS = "holds so far"
    """The visible tests passed, and the points are decided at grading."""
    PARTLY = "partly passed"
    FAILED = "failed"
    NOT_ATTEMPTED = "not attempted yet"
    UNKNOWN = "could not find out"


SYMBOL = {
    Verdict.PASSED: "✓",
    Verdict.HOLDS: "◐",
    Verdict.PARTLY: "◑",
    Verdict.FAILED: "✗",
    Verdict.NOT_ATTEMPTED: "○",
    Verdict.UNKNOWN: "?",
}


def verdict(check: CellResult) -> Verdict:
    """Return the verdict on a check."""
    if check.status is Status.UNKNOWN:
        return Verdict.UNKNOWN
    if check.not_attempted and not check.points:
        return Verdict.NOT_ATTEMPTED
    if check.status is Status.PASSED:
        return Verdict.HOLDS if check.more_at_grading else Verdict.PASSED
    return Verdict.PARTLY if check.points else Verdict.FAILED


def points(check: CellResult) -> str:
    """Return a check's points in words. They are never more than grading will give."""
    full = f"{check.max_points:g} point{'' if check.max_points == 1 else 's'}"
    if check.points is None:
        return f"points: your instructor decides (of {check.max_points:g})"
    if not check.more_at_grading:
        return f"{check.points:g} of {full}"
    sure, possible = check.sure_points or 0.0, check.possible_points
    upto = "" if possible == check.max_points else f"{possible:g} of "
    return f"{f'{sure:g} sure, ' if sure else ''}up to {upto}{full}, decided when the lab is graded"


def total(result: SubmissionResult) -> str:
    """Return the points of all checks in words."""
    told = f"{result.points:g} of {result.max_points:g} points"
    undecided = sum(check.status is Status.UNKNOWN for check in result.checks)
    later = sum(one.possible_points - (one.sure_points or 0.0) for one in result.checks if one.more_at_grading)
    if later:
        told += f", and up to {later:g} more, decided when the lab is graded"
    if undecided:
        told += f", {undecided} check{'s' if undecided > 1 else ''} undecided: your instructor decides"
    return told


def part_points(part: Part) -> str:
    """Return a part's points in words."""
    full = f"{round(part.max_points, 2):g} point{'' if part.max_points == 1 else 's'}"
    if part.more_at_grading:
        return f"up to {full}, decided when the lab is graded"
    return f"{round(part.points, 2):g} of {full}"


def part_verdict(part: Part) -> Verdict:
    """Return the verdict on a part."""
    if part.more_at_grading:
        return Verdict.HOLDS
    return Verdict.PASSED if part.points == part.max_points else Verdict.FAILED


def not_attempted(check: CellResult) -> str:
    """Say which answers are still as students receive them; empty if there are none."""
    files = [f"`%%node {name[:-3]}`" if name.endswith(".py") else f"`%%file {name}`" for name in check.not_attempted]
    if not files:
        return ""
    one = len(files) == 1
    return f"The cell{'' if one else 's'} {', '.join(files)} {'is' if one else 'are'} still as you received " + (
        "it." if one else "them."
    )


@dataclass(frozen=True)
class PartFindings:
    """A part of a check, and its outcomes that failed or are unknown."""

    title: str
    verdict: Verdict
    points: str
    bad: list[Outcome]


@dataclass(frozen=True)
class Findings:
    """A check's outcomes in the order in which they matter."""

    bad: list[Outcome]
    """The outcomes that failed or are unknown and belong to no part."""
    lost: list[PartFindings]
    """The parts in which an outcome failed or is unknown, or which did not give all of their points."""
    held: list[PartFindings]
    passed: list[Outcome]
    not_looked_at: str
    """A sentence that says how many expectations were not checked; empty if there are none."""


def findings(check: CellResult) -> Findings:
    """Sort a check's outcomes by their importance for the reader."""
    by_status = {status: [o for o in check.outcomes if o.status is status] for status in Status}
    left = len(by_status[Status.NOT_CHECKED])
    sentence = (
        f"Because of this, {left} more expectation{' was' if left == 1 else 's were'} not checked." if left else ""
    )
    bad = [o for o in check.outcomes if o.status in (Status.FAILED, Status.UNKNOWN)]
    parts = [
        PartFindings(part.title, part_verdict(part), part_points(part), [o for o in bad if o.part == part.title])
        for part in check.parts
    ]
    lost = [part for part in parts if part.bad or part.verdict is Verdict.FAILED]
    held = [part for part in parts if part not in lost]
    titles = {part.title for part in check.parts}
    return Findings([o for o in bad if o.part not in titles], lost, held, by_status[Status.PASSED], sentence)


def said_once(found: Findings) -> tuple[list[PartFindings], list[PartFindings]]:
    """Split the lost parts into those that say something new, and those whose reasons and hints are all given above."""
    said = [(one.because, one.hint) for one in found.bad]
    new: list[PartFindings] = []
    again: list[PartFindings] = []
    for part in found.lost:
        known = [any(one.because == why and one.hint in hint for why, hint in said if why) for one in part.bad]
        (again if known and all(known) else new).append(part)
        said += [(one.because, one.hint) for one in part.bad]
    return new, again


def holding(found: Findings) -> str:
    """Say how many parts and expectations hold; empty if there are none."""
    counts = [(len(found.held), "part"), (len(found.passed), "expectation")]
    told = [f"{count} {what}{'' if count == 1 else 's'}" for count, what in counts if count]
    return f"{' and '.join(told)} {'holds' if sum(count for count, _ in counts) == 1 else 'hold'}" if told else ""


def plain_title(markdown: str) -> str:
    """Return a heading's text without links and emphasis of Markdown, and without `Check:` at its beginning."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", markdown)
    text = re.sub(r"(\*\*|__)(.+?)\1", r"\2", text)
    about = text.removeprefix("Check: ")
    return text if about == text else about[:1].upper() + about[1:]
