"""Find mistakes in a lab by running it.

The solution must get all points, the blank notebook must get none, and every check must fail for at least one mistake.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

from autograder.authoring.lint.static import Finding
from autograder.authoring.mutation.mutants import handed_in, mutants, reached
from autograder.authoring.mutation.rules import Mutant
from autograder.core.grades import in_points
from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Cell, Lab
from autograder.grading.canaries import KnownAnswers, otherwise
from autograder.grading.job import Job
from autograder.grading.supervisor import run_in_worker

_TRIES = 40
"""The number of mutants that are tried on a check before it counts as a check that passes in spite of every mistake."""


def run_findings(lab: Lab, isolation: Isolation, jobs: int, known: Sequence[KnownAnswers] = ()) -> Iterator[Finding]:
    """Run a lab's solution, its blank notebook, its known answers, and for each check mutants until one loses points.

    Args:
        lab: the lab to run.
        isolation: how the programs are isolated.
        jobs: the number of runs at the same time.
        known: notebooks whose points are known.
    """
    solutions = {grade_id: answer.solution for grade_id, answer in lab.answers.items()}
    blanks = {grade_id: answer.blank for grade_id, answer in lab.answers.items()}
    with ThreadPoolExecutor(jobs) as pool:
        solved = pool.submit(_run, lab, isolation, lab.files_with(solutions), {}, list(lab.cells))
        answers = {file.file_name: True for answer in lab.answers.values() if (file := answer.file) is not None}
        blank = pool.submit(_run, lab, isolation, lab.files_with(blanks), answers, list(lab.cells))
        wrong = list(_solution(solved.result()))
        yield from wrong
        yield from _blank(blank.result())
        if not wrong:  # known answers are made from the solution
            for finding in pool.map(lambda one: list(_otherwise(lab, isolation, one)), known):
                yield from finding
        every = mutants(lab)
        yield from filter(None, pool.map(lambda check: _unbeaten(lab, isolation, check, every), lab.checks))


def _solution(result: SubmissionResult) -> Iterator[Finding]:
    for check in result.checks:
        if check.points != check.max_points:
            bad = check.first_failure
            why = f" {bad.title}: {bad.because or bad.observed}" if bad else ""
            points = "no verdict" if check.points is None else f"{check.points:g} of {check.max_points:g} points"
            yield Finding(check.grade_id, f"the solution gets {points}.{why}")


def _blank(result: SubmissionResult) -> Iterator[Finding]:
    for check in result.checks:
        if check.points != 0:
            points = "no verdict" if check.points is None else in_points(check.points)
            yield Finding(check.grade_id, f"the notebook as students receive it gets {points}.")


def _otherwise(lab: Lab, isolation: Isolation, known: KnownAnswers) -> Iterator[Finding]:
    result = _run(lab, isolation, lab.files_with(known.sources), {}, list(lab.cells))
    for flip in otherwise(known, lab, result):
        which = "a right answer" if flip.right else "the wrong answer"
        yield Finding(
            flip.check, f"{which} of canaries.yaml must get {flip.expected}, and gets {flip.seen.points:g}. {flip.why}"
        )
    for check in result.checks:
        if check.points is None:
            yield Finding(check.grade_id, "an answer of canaries.yaml gets no verdict.")


def _unbeaten(lab: Lab, isolation: Isolation, check: Cell, every: list[Mutant]) -> Finding | None:
    """Return a finding if no mutant of the solution loses points in a check; otherwise None."""
    reaching = [mutant for mutant in every if check in reached(lab, [mutant.answer])]
    cells = [cell for cell in lab.cells if cell.points is None or cell is check]
    tried = reaching[:: max(1, len(reaching) // _TRIES)]
    for mutant in tried:
        points = _run(lab, isolation, handed_in(lab, mutant), {}, cells).checks[0].points
        if points is not None and points < (check.points or 0):
            return None
    return Finding(check.grade_id, f"none of {len(tried)} solutions with one mistake each loses points in it.")


def _run(
    lab: Lab, isolation: Isolation, files: dict[str, str], answers: dict[str, bool], cells: list[Cell]
) -> SubmissionResult:
    return run_in_worker(
        Job(
            student="lint", lab=lab.name, digest="", isolation=isolation, seed=1, files=files, answers=answers,
            cells=cells,
        )
    )  # fmt: skip
