"""Return the mutants of a lab, and the checks that each of them can affect.

`tests/grading/test_classes.py` shows that other checks are not affected: a solution without the files that are said not
to affect a check still passes this check.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterable, Iterator

from autograder.authoring.mutation.rules import Mutant, Source, changes, swaps, text_changes, without_a_line
from autograder.course.cells import grade_id_of, source_of
from autograder.course.lab import Answer, Cell, Lab
from autograder.packages.workspace import SOURCES


def mutants(lab: Lab) -> list[Mutant]:
    """Return every mutant of a lab's solutions. Mutants with the same description are numbered."""
    found: list[Mutant] = []
    counts: dict[str, int] = {}
    for answer in lab.answers.values():
        if answer.file is None:
            continue
        for rule, changed in _variants(lab, answer):
            before, after = _difference(answer.solution, changed)
            mutant = Mutant(answer.grade_id, rule, before, after, changed)
            counts[mutant.key] = counts.get(mutant.key, 0) + 1
            if counts[mutant.key] > 1:
                mutant = Mutant(answer.grade_id, f"{rule} {counts[mutant.key]}", before, after, changed)
            found.append(mutant)
    return found


def _variants(lab: Lab, answer: Answer) -> Iterator[tuple[str, str]]:
    magic, _, body = answer.solution.partition("\n")
    name = answer.file.file_name if answer.file is not None else ""
    if name.endswith(".yaml"):
        for rule, changed in text_changes(body):
            yield rule, f"{magic}\n{changed}"
        return
    if name.endswith("/setup.py") or not name.endswith(".py"):
        for changed in without_a_line(body):
            if not name.endswith(".py") or _is_python(changed):
                yield "dropped line", f"{magic}\n{changed}"
        return
    lines = {number - 1 for number in _solution_lines(lab, answer)}
    source = Source(body)
    for change in (*changes(body, lines), *swaps(body, lines)):
        yield change.rule, f"{magic}\n{source.with_change(change)}"


def _is_python(text: str) -> bool:
    try:
        ast.parse(text)
    except SyntaxError:
        return False
    return True


def _solution_lines(lab: Lab, answer: Answer) -> set[int]:
    """Return the numbers of the lines in `answer.solution` that students write themselves."""
    raw = next(source_of(cell) for cell in lab.raw["cells"] if grade_id_of(cell) == answer.grade_id)
    if "BEGIN SOLUTION" not in raw:
        return set(range(1, len(answer.solution.split("\n")) + 1))
    own, inside, number = set(), False, 0
    for line in raw.split("\n"):
        if "BEGIN SOLUTION" in line or "END SOLUTION" in line:
            inside = "BEGIN" in line
            continue
        number += 1
        if inside:
            own.add(number)
    return own


def _difference(before: str, after: str) -> tuple[str, str]:
    """Return the first line that differs, before and after the change."""
    old, new = before.split("\n"), after.split("\n")
    first = next((n for n, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)) - 1)
    shorter = len(new) < len(old)
    then = "(dropped)" if shorter and new[first].strip() != "pass" and new[first:] == old[first + 1 :] else new[first]
    return old[first].strip(), then.strip()


def handed_in(lab: Lab, mutant: Mutant) -> dict[str, str]:
    """Return the files of a submission that differs from the solution only by this change."""
    solutions = {grade_id: answer.solution for grade_id, answer in lab.answers.items()}
    return lab.files_with(solutions | {mutant.answer: mutant.source})


def reached(lab: Lab, answers: Iterable[str]) -> list[Cell]:
    """Return the cells to run for changed answers: the set-up, and the checks that may be affected.

    A check may be affected if it uses the file of a changed answer, or a file that mentions such a file. A function of
    the set-up that uses such a file affects only the checks that call it.
    """
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
    functions = _functions_with(words, [cell.source for cell in lab.cells if cell.points is None])
    if functions is None:
        return list(lab.cells)
    named = _any_of(words, functions)
    return [cell for cell in lab.cells if cell.points is None or named.search(cell.source)]


def _functions_with(words: list[str], set_up: list[str]) -> set[str] | None:
    """Return the functions and classes of the set-up that mention one of the words, or a function that does.

    None: something else of the set-up mentions them, so every check may be affected.
    """
    statements = [statement for source in set_up for statement in _statements(source)]
    found: set[str] = set()
    while True:
        named = _any_of(words, found)
        mentioning = {name for name, text in statements if named.search(text)}
        if "" in mentioning:
            return None
        if mentioning <= found:
            return found
        found |= mentioning


@functools.cache
def _statements(source: str) -> list[tuple[str, str]]:
    """Return the name and the text of each statement of a cell; the name is empty if it defines nothing."""
    # Only IPython understands lines such as `%load_ext autograder`.
    lines = ["" if line.startswith("%") else line for line in source.split("\n")]
    return [
        (
            statement.name if isinstance(statement, ast.FunctionDef | ast.ClassDef) else "",
            "\n".join(lines[statement.lineno - 1 : statement.end_lineno]),
        )
        for statement in ast.parse("\n".join(lines)).body
    ]


def _any_of(words: Iterable[str], names: Iterable[str]) -> re.Pattern[str]:
    return re.compile("|".join([*map(re.escape, words), *(rf"\b{name}\b" for name in names)]) or r"(?!)")


def _word(name: str) -> str:
    """Return the name by which other files refer to a file: its own name, or the name of its package."""
    return name.split("/")[1] if name.startswith(f"{SOURCES}/") else name


def using(lab: Lab, check: Cell) -> frozenset[str]:
    """Return the answers that can affect a check."""
    return frozenset(name for name in lab.answers if check in reached(lab, [name]))
