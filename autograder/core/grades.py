"""What a submission is worth, as the gradebook has it: the one number that every table, page and export shows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CellGrade:
    """The points of one graded cell."""

    grade_id: str
    points: float | None
    """With extra credit; None: a person has yet to grade it."""
    max_points: float
    is_check: bool
    """Or else an answer that a person grades."""
    by_hand: bool
    """A person gave the points, or some of them."""
    comment: str = ""
    """What a person wrote about the answer."""
    stale: bool = False
    """A person gave the points for something that has changed since, and should look at it again."""


@dataclass(frozen=True)
class Grade:
    """The points of one submission."""

    student: str
    lab: str
    cells: tuple[CellGrade, ...]
    penalty: float
    """Points that nbgrader takes off for who was late."""

    @property
    def waiting(self) -> list[CellGrade]:
        """The cells that a person has yet to grade."""
        return [cell for cell in self.cells if cell.points is None]

    @property
    def stale(self) -> list[CellGrade]:
        """The cells that a person should look at again."""
        return [cell for cell in self.cells if cell.stale]

    @property
    def earned(self) -> float:
        """Points that are left after the penalty, where a cell that a person has yet to grade counts 0."""
        return max(0.0, sum(cell.points or 0.0 for cell in self.cells) - self.penalty)

    @property
    def score(self) -> float | None:
        """What was earned; None as long as a check waits for an instructor's verdict.

        An explanation that nobody has graded yet counts 0 here, and `waiting` names it.
        """
        return None if any(cell.is_check for cell in self.waiting) else self.earned

    @property
    def max_score(self) -> float:
        """Points that the submission could have."""
        return sum(cell.max_points for cell in self.cells)
