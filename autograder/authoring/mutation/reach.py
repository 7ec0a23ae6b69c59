"""Which checks a changed answer can reach.

`tests/test_classes.py` shows that nothing else reaches them: without the files that are said not to reach a check, the
solution passes it all the same.
"""

from __future__ import annotations

from collections.abc import Iterable

from autograder.course.lab import Cell, Lab


def reached(lab: Lab, answers: Iterable[str]) -> list[Cell]:
    """The cells to run for changed answers: set-up, and the checks that use one's file or a file that mentions it."""
    files = {answer.grade_id: answer.file for answer in lab.answers.values() if answer.file is not None}
    names = set(answers) & files.keys()
    grown = True
    while grown:
        grown = False
        for other in files.keys() - names:
            body = lab.answers[other].solution.split("\n", 1)[1]
            if any(files[name].name in body for name in names):
                names.add(other)
                grown = True
    words = [word for name in names for word in (f'"{files[name].name}"', f"'{files[name].name}'")]
    mentioning = {cell.grade_id for cell in lab.cells if any(word in cell.source for word in words)}
    everything = any(cell.points is None and cell.grade_id in mentioning for cell in lab.cells)
    return [cell for cell in lab.cells if cell.points is None or everything or cell.grade_id in mentioning]


def using(lab: Lab, check: Cell) -> frozenset[str]:
    """The answers that reach a check."""
    return frozenset(name for name in lab.answers if check in reached(lab, [name]))
