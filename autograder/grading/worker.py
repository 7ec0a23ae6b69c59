"""Runs the trusted check cells of one submission, inside the grading sandbox.

Reads a `Job` as JSON from standard input. Writes to standard output a line of JSON for each check once it is decided,
the `CheckResult`, and, where the messages are wanted, a line for each of them. When it is stuck, its stacks come last.
The student's programs are text until the node sandbox starts them; nothing of theirs is imported here.
"""

from __future__ import annotations

import ast
import faulthandler
import linecache
import os
import resource
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

from autograder.checks import current, outcomes, unusable
from autograder.checks.misuse import place_of
from autograder.checks.scoring import Score
from autograder.core.results import CellResult, CheckResult, NodeLog, Status
from autograder.course.lab import Cell
from autograder.grading.job import CELL_CPU_SECONDS, CELL_SECONDS, STUCK_SECONDS, Job
from autograder.graph.patience import ALONE
from autograder.sandbox.inside.warm_up import load_ros
from autograder.sandbox.limits import MIB
from autograder.sandbox.scratch import Scratch

MEMORY = 2048 * MIB
"""Bytes that the worker may take for itself: what a student wrote may unfold in it, and then fails its own check."""
PICTURE_KEPT = 150_000
"""Characters of a picture: what is longer is left out."""
OUTCOMES_KEPT = 400
LOGS_KEPT = 8 * MIB
"""Characters of all programs' output together."""


def run_job(job: Job, folder: Path, stacks: TextIO = sys.stderr) -> Iterator[CheckResult]:
    """Run every cell of the job, in order, and give the result of each check once it is decided.

    Args:
        job: the submission and the cells.
        folder: an empty folder for the programs and files; it becomes the working directory of the programs.
        stacks: where the stacks of all threads are written before a process that is stuck ends itself.
    """
    for name, text in job.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    current.check.findings.alone = job.alone
    current.check.configure(folder, job.isolation, job.seed, job.answers, job.built)
    if job.files:
        _ = current.check.sandbox  # it warms up while the set-up cells import their messages
    namespace: dict[str, Any] = {"__name__": "check_cells"}
    logs_kept = LOGS_KEPT // max(1, len(job.checks))
    broken_set_up = ""
    try:
        for number, cell in enumerate(job.cells):
            limit = CELL_SECONDS + ALONE * job.alone + job.build_seconds
            started = time.monotonic()
            current.check.findings.reset()
            current.check.vary_for(f"{job.seed} {cell.grade_id}")
            faulthandler.dump_traceback_later(limit + STUCK_SECONDS, exit=True, file=stacks)
            error, value = _run_cell(cell, number, namespace, limit, CELL_CPU_SECONDS)
            faulthandler.cancel_dump_traceback_later()
            if cell.points is None:
                broken_set_up = broken_set_up or error
                continue
            check = _check_result(cell, value, error or broken_set_up)
            took = round(time.monotonic() - started, 3)
            yield check.model_copy(update={"logs": _within(check.logs, logs_kept), "seconds": took})
    finally:
        faulthandler.cancel_dump_traceback_later()
        current.check.close()


def _check_result(cell: Cell, value: object, error: str) -> CheckResult:
    """The cell's result; whatever is not a score says nothing about the student, so nobody's points depend on it."""
    if isinstance(value, Score) and not error and value.result.max_points == cell.points:
        found = value.result
    else:
        because = error or f"The check cell did not end in a score of {cell.points:g} points."
        found_out = [
            *current.check.findings.outcomes,
            outcomes.worded(Status.UNKNOWN, code=outcomes.GRADER.code, title="The check itself broke", because=because),
        ]
        found = CellResult(
            max_points=cell.points or 0.0,
            points=None,
            starved=max(current.check.findings.starved, current.check.findings.patience.decided()),
            outcomes=found_out,
            flags=list(dict.fromkeys(current.check.findings.flags)),
            logs=current.check.findings.logs,
        )
    return _shortened(CheckResult(grade_id=cell.grade_id, title=cell.title, **dict(found)))


def _shortened(check: CheckResult) -> CheckResult:
    """The result with a bounded number of outcomes, and without pictures that are too large."""
    kept = [
        one.model_copy(update={"picture": None})
        if one.picture is not None and len(one.picture.svg) + len(one.picture.alt) > PICTURE_KEPT
        else one
        for one in check.outcomes[:OUTCOMES_KEPT]
    ]
    return check.model_copy(update={"outcomes": kept})


def _within(logs: list[NodeLog], characters: int) -> list[NodeLog]:
    """The logs, the longest ones cut so that all together keep to a number of characters, each to a fair part of it."""
    share, left = characters, characters
    for place, length in enumerate(sorted(len(log.text) for log in logs)):
        share = left // (len(logs) - place)
        if length > share:
            break
        left -= length
    half = share // 2
    return [
        log.model_copy(update={"text": f"{log.text[:half]}\n[...]\n{log.text[-half:]}", "truncated": True})
        if len(log.text) > share
        else log
        for log in logs
    ]


def _out_of_time(*_: object) -> None:
    raise TimeoutError("the check took longer than it may")


def _out_of_cpu(*_: object) -> None:
    raise unusable.OutOfBudget("the check took more of the grader's own CPU time than it may")


def _run_cell(
    cell: Cell, number: int, namespace: dict[str, Any], limit: float, cpu: float = CELL_CPU_SECONDS
) -> tuple[str, object]:
    """Run a cell; gives an error text, or none, and the value of its last expression.

    Args:
        cell: the cell.
        number: tells it from the others.
        namespace: of all cells.
        limit: seconds that it may take.
        cpu: seconds of CPU that this process may take for it, which the student's programs are no part of.
    """
    # Lines that begin with % are for the notebook only; an empty line keeps the numbers right.
    source = "\n".join("" if line.startswith("%") else line for line in cell.source.splitlines()) + "\n"
    filename = f"<check {number} {cell.grade_id}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    signal.signal(signal.SIGALRM, _out_of_time)
    signal.signal(signal.SIGPROF, _out_of_cpu)
    signal.setitimer(signal.ITIMER_REAL, limit, 5.0)  # again and again: something may swallow the first
    signal.setitimer(signal.ITIMER_PROF, cpu, 5.0)
    try:
        tree = ast.parse(source, filename)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, filename, "exec"), namespace)
        value = None
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), filename, "eval"), namespace)
    except Exception as error:
        place = place_of(error, lambda name: name == filename)
        unusable.broke(error, place)
        return f"{type(error).__name__}: {error}" + (f" ({place})" if place else ""), None
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return "", value


def prepare() -> None:
    """Load what every job needs; a process that did so once can be forked for each of them."""
    load_ros()


def main() -> int:
    """Serve one job."""
    # What ROS prints on standard output must not get between the lines of the result.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    job = Job.model_validate_json(sys.stdin.buffer.read())
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard), hard))
    current.check.bag.wanted = job.messages
    with Scratch() as scratch:
        scratch.chmod(0o755)
        folder = scratch / "submission"
        folder.mkdir(mode=0o755)
        for check in run_job(job, folder, out):
            out.write(check.model_dump_json() + "\n")
            out.writelines(message.model_dump_json() + "\n" for message in current.check.bag.empty(check.grade_id))
            out.flush()
    out.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
