"""Reads the grades of a class from nbgrader's gradebook."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from autograder.core.grades import Grade
from autograder.gradebook.keeping import damage_told
from autograder.gradebook.reading import grades_in
from autograder.gradebook.settings import gradebook_address, gradebook_file
from autograder.intake.record import left_class

if TYPE_CHECKING:
    from sqlalchemy.engine import Connection

Answer = TypeVar("Answer")


def ask(root: Path, question: Callable[[Connection], Answer], nothing: Answer) -> Answer:
    """Return what a question finds in the gradebook; `nothing` where nbgrader has written none yet."""
    file = gradebook_file(root)
    if file is not None and not file.is_file():
        return nothing
    from sqlalchemy import create_engine, inspect

    engine = create_engine(gradebook_address(root))
    try:
        with damage_told(root), engine.connect() as connection:
            return question(connection) if inspect(connection).has_table("grade") else nothing
    finally:
        engine.dispose()


def read_grades(root: Path, lab: str = "") -> list[Grade]:
    """Return the grade of each student of the class, sorted by student and lab; who has left the class is not in it.

    Args:
        root: of the course.
        lab: whose grades; empty: of all labs.
    """
    nobody: list[Grade] = []
    grades = ask(root, lambda connection: grades_in(connection, lab), nobody)
    left = {name: left_class(root, name) for name in {grade.lab for grade in grades}}
    return [grade for grade in grades if grade.student not in left[grade.lab]]
