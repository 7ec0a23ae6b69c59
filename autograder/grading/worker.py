"""Run the trusted check cells of one submission inside the grading sandbox.

The worker reads a `Job` as JSON from standard input. For each check that is decided, it writes the `CheckResult` to
standard output as a line of JSON and, if the messages are wanted, a line for each message. If the worker is stuck, it
finally writes the stacks of its threads. The student's programs are only text until the node sandbox starts them, and
nothing from them is imported here.
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
from autograder.core.grades import in_points
from autograder.core.results import CellResult, CheckResult, NodeLog, Status
from autograder.course.lab import Cell
from autograder.grading.job import CELL_CPU_SECONDS, CELL_SECONDS, STUCK_SECONDS, Job
from autograder.graph.patience import ALONE
from autograder.sandbox.inside.warm_up import load_ros
from autograder.sandbox.limits import MIB
from autograder.sandbox.scratch import Scratch

MEMORY = 2048 * MIB
"""The bytes of memory that the worker may use. If a student's data becomes too large, only its own check fails."""
PICTURE_KEPT = 150_000
"""The number of characters of a picture. Larger pictures are left out."""
OUTCOMES_KEPT = 400
LOGS_KEPT = 8 * MIB
"""The number of characters that are kept from the output of all programs together."""


def run_job(job: Job, folder: Path, stacks: TextIO = sys.stderr) -> Iterator[CheckResult]:
    """Run every cell of the job in order, and yield the result of each check once it is decided.

    Args:
        job: the submission and the cells.
        folder: an empty folder for the programs and files, which becomes the working directory of the programs.
        stacks: the stream to which the stacks of all threads are written before a stuck process ends itself.
    """
    for name, text in job.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    current.check.findings.alone = job.alone
    current.check.configure(folder, job.isolation, job.seed, job.answers, job.built)
    if job.files:
        _ = current.check.sandbox  # the sandbox starts while the set-up cells import their messages
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
    """Return the result of a cell. If its value is not a score, the check is undecided and costs no points."""
    if isinstance(value, Score) and not error and value.result.max_points == cell.points:
        found = value.result
    else:
        because = error or f"The check cell did not end in a score of {in_points(cell.points or 0.0)}."
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
    """Return the result with a limited number of outcomes, and without pictures that are too large."""
    kept = [
        one.model_copy(update={"picture": None})
        if one.picture is not None and len(one.picture.svg) + len(one.picture.alt) > PICTURE_KEPT
        else one
        for one in check.outcomes[:OUTCOMES_KEPT]
    ]
    return check.model_copy(update={"outcomes": kept})


def _within(logs: list[NodeLog], characters: int) -> list[NodeLog]:
    """Return the logs with the longest ones cut, so that together they have at most so many characters."""
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
    """Run a cell, and return the text of its error, which may be empty, and the value of its last expression.

    Args:
        cell: the cell.
        number: the number of the cell, which makes its file name unique.
        namespace: the global variables of all cells.
        limit: the seconds that the cell may take.
        cpu: the seconds of CPU time that this process may use for the cell, without the student's programs.
    """
    # Lines that begin with % are for the notebook only. They are replaced by empty lines to keep the line numbers.
    source = "\n".join("" if line.startswith("%") else line for line in cell.source.splitlines()) + "\n"
    filename = f"<check {number} {cell.grade_id}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    signal.signal(signal.SIGALRM, _out_of_time)
    signal.signal(signal.SIGPROF, _out_of_cpu)
    signal.setitimer(signal.ITIMER_REAL, limit, 5.0)  # repeatedly, because some code may swallow the first one
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
    """Load what every job needs. A process that has done this once can be forked for each job."""
    load_ros()


def main() -> int:
    """Read one job from standard input, run it, and write the results to standard output."""
    # Output that ROS prints on standard output must not be mixed with the lines of the results.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    job = Job.model_validate_json(sys.stdin.buffer.read())
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard), hard))
    current.check.bag.wanted = job.messages
    current.check.records = [] if job.records else None
    with Scratch() as scratch:
        scratch.chmod(0o755)
        folder = scratch / "submission"
        folder.mkdir(mode=0o755)
        for check in run_job(job, folder, out):
            out.write(check.model_dump_json() + "\n")
            out.writelines(message.model_dump_json() + "\n" for message in current.check.bag.empty(check.grade_id))
            if current.check.records is not None:
                out.writelines(record.by(check.grade_id).model_dump_json() + "\n" for record in current.check.records)
                current.check.records.clear()
            out.flush()
    out.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
