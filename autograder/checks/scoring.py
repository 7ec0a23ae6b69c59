"""The score of a check cell."""

from __future__ import annotations

from collections.abc import Mapping

from autograder.checks import outcomes, session
from autograder.checks.session import Score
from autograder.results import CheckResult, Outcome, Part, Status


def score(points: float | Mapping[str, float]) -> Score:
    """Close the cell's collection.

    Args:
        points: all of them when every expectation since the last score holds, else none; or points by the title of
            a part, each given when what was found out in that part holds.

    Raises:
        ValueError: an expectation names a part that has no points here.
    """
    more = outcomes.parts_with_more_at_grading()
    blank = session.current.blank_answers()
    used, flags = set(session.current.used), list(dict.fromkeys(session.current.flags))
    found, lost, seconds = session.current.take()
    parts = [_part(title, worth, found, lost, more) for title, worth in _by_part(points, found).items()]
    full = round(sum(points.values()), 6) if isinstance(points, Mapping) else points
    statuses = {outcome.status for outcome in found}
    earned: float | None
    if not statuses or Status.UNKNOWN in statuses:
        earned = None  # nothing found out, or something the grader could not find out: an instructor decides
    elif parts:
        earned = round(sum(part.points for part in parts), 2)
    else:
        earned = full if statuses == {Status.PASSED} else 0.0
    if blank and all(blank.values()) and earned is not None:
        earned = 0.0  # whatever a check makes of it: nobody earns anything with what everybody receives
        parts = [part.model_copy(update={"points": 0.0, "more_at_grading": False}) for part in parts]
    result = CheckResult(
        grade_id="",
        max_points=full,
        points=earned,
        seconds=seconds,
        outcomes=found,
        parts=parts,
        flags=flags,
        more_at_grading=bool(earned and (more if not parts else any(part.more_at_grading for part in parts))),
    )
    if statuses != {Status.PASSED} or (blank and all(blank.values())):
        result.not_attempted = sorted(name for name, still in blank.items() if still)
    return _in_notebook(result, used)


def unscored() -> Score | None:
    """What a cell expected and found that asks for no score; None if that was nothing."""
    used = set(session.current.used)
    found, _, seconds = session.current.take()
    score = _in_notebook(CheckResult(grade_id="", max_points=0, points=0, seconds=seconds, outcomes=found), used)
    # What the programs printed has been shown while they ran.
    return Score(score.result, (), score.remarks, score.origin if score.result.status is not Status.PASSED else "")


def _in_notebook(result: CheckResult, used: set[str]) -> Score:
    """The score, in a notebook with what is known of the cells that the programs came from."""
    here = session.current.kernel
    if here is None:
        return Score(result)
    return Score(result, session.current.scored_logs, here.remarks(used), here.origin(used))


def _by_part(points: float | Mapping[str, float], found: list[Outcome]) -> Mapping[str, float]:
    by_part = points if isinstance(points, Mapping) else {}
    unknown = sorted({outcome.part for outcome in found if outcome.part} - by_part.keys())
    if unknown:
        raise ValueError(f"score() gives no points for the part {unknown[0]!r}; it has {sorted(by_part)}.")
    return by_part


def _part(title: str, worth: float, found: list[Outcome], lost: set[str], more: set[str]) -> Part:
    """What a part earned; where its tests are hidden here, that nothing in it has failed so far."""
    own = [outcome for outcome in found if outcome.part == title]
    hidden_here = title in more or "" in more
    holds = title not in lost and all(outcome.status is Status.PASSED for outcome in own) and bool(own or hidden_here)
    if not own and hidden_here:
        # Nothing of it is visible; what failed outside of any part keeps grading from getting this far.
        holds = all(outcome.status is Status.PASSED for outcome in found if not outcome.part)
    return Part(title=title, max_points=worth, points=worth if holds else 0.0, more_at_grading=holds and hidden_here)
