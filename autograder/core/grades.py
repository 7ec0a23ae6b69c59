"""The grade of a submission as the gradebook holds it. Every table, page and export shows this one number."""

from __future__ import annotations

from dataclasses import dataclass


def in_points(number: float) -> str:
    """Return a number of points with its noun: `1 point`, `2.5 points`."""
    return f"{round(number, 2):g} point{'s' * (number != 1)}"


@dataclass(frozen=True)
class CellGrade:
    """The points of one graded cell."""

    grade_id: str
    points: float | None
    """The points, with extra credit; None if a person has yet to grade the cell."""
    max_points: float
    is_check: bool
    """Whether this is a check; if not, it is an answer that a person grades."""
    by_hand: bool
    """Whether a person gave the points or some of them."""
    comment: str = ""
    """What a person wrote about the answer."""
    stale: bool = False
    """Whether the work has changed since a person gave the points, so that the person should look at it again."""


@dataclass(frozen=True)
class Grade:
    """The points of one submission."""

    student: str
    lab: str
    cells: tuple[CellGrade, ...]
    penalty: float
    """Points that nbgrader takes off because the submission was late."""

    @property
    def waiting(self) -> list[CellGrade]:
        """The cells that a person has yet to grade."""
        return [cell for cell in self.cells if cell.points is None]

    @property
    def told_waiting(self) -> str:
        """A sentence about the cells that a person has yet to grade, for the student; empty if there are none."""
        if not self.waiting:
            return ""
        top = in_points(sum(cell.max_points for cell in self.waiting))
        which = "1 answer is" if len(self.waiting) == 1 else f"{len(self.waiting)} answers are"
        return f"{which} not graded yet, which can still give up to {top}."

    @property
    def stale(self) -> list[CellGrade]:
        """The cells that a person should look at again."""
        return [cell for cell in self.cells if cell.stale]

    @property
    def earned(self) -> float:
        """The points after the penalty. A cell that a person has yet to grade counts 0."""
        return max(0.0, sum(cell.points or 0.0 for cell in self.cells) - self.penalty)

    @property
    def score(self) -> float | None:
        """The earned points; None as long as a check waits for an instructor's verdict.

        An explanation that nobody has graded yet counts 0 here, and `waiting` names it.
        """
        return None if any(cell.is_check for cell in self.waiting) else self.earned

    @property
    def max_score(self) -> float:
        """The most points that the submission can get."""
        return sum(cell.max_points for cell in self.cells)
