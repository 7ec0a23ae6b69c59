"""Which checks a changed answer can reach.

`tests/test_classes.py` shows that nothing else reaches them: without the files that are said not to reach a check, the
solution passes it all the same.
"""

from __future__ import annotations

from collections.abc import Iterable

from autograder.course.lab import Cell, Lab
from autograder.packages.workspace import SOURCES


def reached(lab: Lab, answers: Iterable[str]) -> list[Cell]:
    """The cells to run for changed answers: set-up, and the checks that use one's file or a file that mentions it."""
    files = {answer.grade_id: answer.file for answer in lab.answers.values() if answer.file is not None}
    names = set(answers) & files.keys()
    grown = True
    while grown:
        grown = False
        for other in files.keys() - names:
            body = lab.answers[other].solution.partition("\n")[2]
            if any(_word(files[name].name) in body for name in names):
                names.add(other)
                grown = True
    words = [word for name in names for word in (f'"{_word(files[name].name)}"', f"'{_word(files[name].name)}'")]
    mentioning = {cell.grade_id for cell in lab.cells if any(word in cell.source for word in words)}
    everything = any(cell.points is None and cell.grade_id in mentioning for cell in lab.cells)
    return [cell for cell in lab.cells if cell.points is None or everything or cell.grade_id in mentioning]


def _word(name: str) -> str:
    """What others name a file by: itself, or the package that it is a file of."""
    return name.split("/")[1] if name.startswith(f"{SOURCES}/") else name


def using(lab: Lab, check: Cell) -> frozenset[str]:
    """The answers that reach a check."""
    return frozenset(name for name in lab.answers if check in reached(lab, [name]))
