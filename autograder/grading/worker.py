"""Runs the trusted check cells of one submission, inside the grading sandbox.

Reads a `Job` as JSON from standard input and writes a `SubmissionResult` as JSON to standard output. The student's
programs are text until the node sandbox starts them; nothing of theirs is imported here.
"""

from __future__ import annotations

import ast
import linecache
import os
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

from autograder.checks import session
from autograder.checks.session import Score
from autograder.grading.job import Cell, Job
from autograder.results import CheckResult, Outcome, Status, SubmissionResult


def run_job(job: Job, folder: Path) -> SubmissionResult:
    """Run every cell of the job, in order, and give the result.

    Args:
        job: the submission and the cells.
        folder: an empty folder for the programs and files; it becomes the working directory of the programs.
    """
    started = time.monotonic()
    for name, text in job.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    session.current.configure(folder, job.isolation, job.seed)
    if job.files:
        _ = session.current.sandbox  # it warms up while the set-up cells import their messages
    result = SubmissionResult(
        student=job.student,
        lab=job.lab,
        digest=job.digest,
        isolation=job.isolation,
        seed=job.seed,
        problems=job.problems,
    )
    namespace: dict[str, Any] = {"__name__": "check_cells"}
    broken_set_up = ""
    try:
        for number, cell in enumerate(job.cells):
            session.reset()
            error, value = _run_cell(cell, number, namespace)
            if cell.points is None:
                broken_set_up = broken_set_up or error
                continue
            check = _check_result(cell, value, error or broken_set_up)
            result.checks.append(check)
            for log in session.current.logs + session.current.scored_logs:
                result.logs.append(log.model_copy(update={"grade_id": cell.grade_id}))
    finally:
        session.current.close()
    result.seconds["checks"] = round(time.monotonic() - started, 3)
    return result


def _check_result(cell: Cell, value: object, error: str) -> CheckResult:
    """The cell's result; whatever is not a score says nothing about the student, so nobody's points depend on it."""
    if isinstance(value, Score) and not error and value.result.max_points == cell.points:
        check = value.result
    else:
        because = error or f"The check cell did not end in a score of {cell.points:g} points."
        outcomes = [
            *session.current.outcomes,
            Outcome(status=Status.UNKNOWN, title="The check itself broke", because=because, code="grader"),
        ]
        check = CheckResult(grade_id="", max_points=cell.points or 0.0, points=None, outcomes=outcomes)
    return check.model_copy(update={"grade_id": cell.grade_id, "title": cell.title})


def _run_cell(cell: Cell, number: int, namespace: dict[str, Any]) -> tuple[str, object]:
    """Run a cell; gives an error text (empty if none) and the value of its last expression."""
    # Lines that begin with % are for the notebook only; an empty line keeps the numbers right.
    source = "\n".join("" if line.startswith("%") else line for line in cell.source.splitlines()) + "\n"
    filename = f"<check {number} {cell.grade_id}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    try:
        tree = ast.parse(source, filename)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, filename, "exec"), namespace)
        value = None
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), filename, "eval"), namespace)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})", None
    return "", value


def main() -> int:
    """Serve one job."""
    # What ROS prints on standard output must not get between the lines of the result.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    job = Job.model_validate_json(sys.stdin.buffer.read())
    with tempfile.TemporaryDirectory(prefix="submission_") as folder:
        Path(folder).chmod(0o755)
        result = run_job(job, Path(folder))
    out.write(result.model_dump_json())
    out.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
