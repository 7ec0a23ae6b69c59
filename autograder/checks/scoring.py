"""The score of a check cell, and its parts: requirements that give points of their own, whatever becomes of the others.

    with launch("talker") as ros:
        with ros.part("the name"):
            ros.node("/talker").expect()
        with ros.part("the numbers"):
            ros.topic("/numbers", Int64).expect_messages(at_least=5)
    ros.score({"the name": 1, "the numbers": 2})

What fails inside a part ends that part only. What fails outside takes every part of its launch.

So does a program that ends although it had to go on: when it ended is a matter of luck, and so is what was seen before.
It is not where the callback that failed had been called by the check itself, which sent a message or a request, or set
a parameter. Then what the parts before that came to stands.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence

from autograder.checks import current, outcomes
from autograder.checks.current import Asked
from autograder.core import interrupts
from autograder.core.results import CellResult, Outcome, Part, Status


@contextlib.contextmanager
def part(title: str) -> Iterator[None]:
    """Count what is found out inside the block for the part `title` of the score.

    Raises:
        ValueError: parts do not nest, and each has a title.
    """
    if current.check.findings.part or not title:
        raise ValueError(f"part({title!r}): parts have a title and do not nest.")
    current.check.findings.part = title
    try:
        yield
    except outcomes.LaunchEnded:
        raise
    except outcomes.CheckEnded:
        pass
    except Exception as error:
        if not outcomes.ends_part(error):
            raise
    finally:
        current.check.findings.part = ""
    current.check.findings.finished.add(title)


def asked(what: str) -> None:
    """Note that the check is about to send something: on this topic, to this service, or a "parameter"."""
    findings = current.check.findings
    findings.asked.append(Asked(time.monotonic(), what, frozenset(findings.finished)))


def before(what: str, when: float) -> frozenset[str]:
    """Titles of the parts that were finished before the check sent what led to a callback for `what` at this moment."""
    sent = [one for one in current.check.findings.asked if one.when < when and one.what == what]
    return sent[-1].parts if sent else frozenset()


class Score:
    """A check's result as the last expression of its cell: a front end shows the report, `repr` is the points.

    Args:
        result: of the check.
        remarks: what the student should know about the cells that the programs came from.
        origin: those cells, in words.
    """

    def __init__(self, result: CellResult, remarks: Sequence[str] = (), origin: str = "") -> None:
        """Wrap a result for display."""
        self.result, self.remarks, self.origin = result, list(remarks), origin

    def __repr__(self) -> str:
        """The points as a number, as nbgrader reads them, or None when nobody could find out."""
        return "None" if self.result.points is None else f"{self.result.points:g}"


def score(points: float | Mapping[str, float]) -> Score:
    """Close the cell's collection.

    Args:
        points: all of them when every expectation since the last score holds, else none; or points by the title of
            a part, each given when what was found out in that part holds.

    Raises:
        ValueError: an expectation names a part that has no points here.
        Interrupted: somebody has interrupted the cell, which then has no verdict.
    """
    interrupts.here()
    more = outcomes.parts_with_more_at_grading()
    blank = current.check.blank_answers()
    cell = current.check.findings
    found, lost, used = cell.outcomes, cell.lost_parts, cell.used
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
    result = CellResult(
        max_points=full,
        points=earned,
        seconds=cell.seconds,
        starved=round(cell.starved, 2),
        outcomes=found,
        parts=parts,
        flags=list(dict.fromkeys(cell.flags)),
        logs=cell.logs,
        varied=cell.varied,
        ranked=cell.ranked,
        more_at_grading=bool(earned and (more if not parts else any(part.more_at_grading for part in parts))),
    )
    if statuses != {Status.PASSED} or (blank and all(blank.values())):
        result.not_attempted = sorted(name for name, still in blank.items() if still)
    cell.reset()
    return _in_notebook(result, used)


def unscored() -> Score | None:
    """What a cell expected and found that asks for no score; None if that was nothing."""
    cell = current.check.findings
    # What the programs printed has been shown while they ran.
    result = CellResult(max_points=0, points=0, seconds=cell.seconds, outcomes=cell.outcomes)
    used = cell.used
    cell.reset()
    score = _in_notebook(result, used)
    return Score(result, score.remarks, score.origin if result.status is not Status.PASSED else "")


def _in_notebook(result: CellResult, used: set[str]) -> Score:
    """The score, in a notebook with what is known of the cells that the programs came from."""
    here = current.check.front_end
    if here is None:
        return Score(result)
    return Score(result, [*here.remarks(used), *_too_busy(result)], here.origin(used))


def _too_busy(result: CellResult) -> list[str]:
    """What to do about points that were lost while others had the CPUs."""
    if result.starved <= 0 or result.points == result.max_points:
        return []
    return [
        f"Other programs on this machine kept your programs from the CPU for {result.starved:.2f} s while this check"
        " was running. Before you look for a mistake, run this cell again when the machine has less to do. During"
        " grading, such a check is automatically run again."
    ]


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
