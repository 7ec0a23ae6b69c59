"""Read a student's submission as text. Nothing in it is executed, imported or unpickled here.

Two things count: the source of the answer cells, which are found by grade_id, and the contents of `%%node` and `%%file`
cells that the student added, because the answers may use these modules and files. Every problem of the notebook becomes
an outcome with a code, so that one broken submission never stops a class.
"""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.core.files import signature
from autograder.course.cells import grade_id_of
from autograder.course.lab import Lab, lab_names, load_lab
from autograder.reasons import Group, Kind
from autograder.submission.answers import Submission, take_answers, take_files, take_own_files
from autograder.submission.notebook_file import UnreadableError, last_saved, problem

MORE_PROBLEMS = Kind("more-problems", "the notebook has more problems than are listed", Group.NOTEBOOK)

PROBLEMS_KEPT = 100
"""The number of problems of a notebook that are listed."""


def read_submission(path: Path, lab: Lab) -> Submission:
    """Read a submitted notebook as it was last saved. Every problem is added to `problems`, and none is raised.

    If the file has not changed, the same object is returned again, because grading a class needs it several times.
    """
    return _read(path.absolute(), signature(path), lab)


@lru_cache(maxsize=64)
def _read(path: Path, _signature: object, lab: Lab) -> Submission:
    submission = Submission(sources={answer.grade_id: answer.blank for answer in lab.answers.values()})
    cells: list[dict[str, Any]] = []
    try:
        cells = last_saved(path).cells
        take_answers(cells, lab, submission)
    except UnreadableError as error:
        submission.problems.append(error.problem)
        submission.readable = False
    take_files(lab, submission)
    own = take_own_files(cells, lab, submission) if submission.readable else {}
    _keep_first_problems(submission)
    problems = [[found.code, found.because] for found in submission.problems]
    parts = [lab.digest, problems, list(submission.sources.items()), sorted(own.items())]
    submission.digest = hashlib.sha256(json.dumps(parts).encode()).hexdigest()
    return submission


def _keep_first_problems(submission: Submission) -> None:
    """Keep only the first problems, and say how many more there are, for example thousands of ignored cells."""
    left_out = len(submission.problems) - PROBLEMS_KEPT
    if left_out > 0:
        because = f"The notebook has {left_out} more problem{'s' * (left_out != 1)}, not listed here."
        submission.problems[PROBLEMS_KEPT:] = [problem("the notebook has few problems", MORE_PROBLEMS(because))]


def lab_of(notebook: Path, name: str | None, root: Path) -> Lab:
    """Find the lab of a notebook by the given name, the name of the file, or the grade_ids of its answers.

    Raises:
        KitError: the notebook belongs to none of the course's labs, or cannot be read.
    """
    names = lab_names(root)
    if name is not None or notebook.stem in names:
        return load_lab(root, name or notebook.stem)
    try:
        ids = {grade_id_of(cell) for cell in last_saved(notebook).cells} - {""}
    except UnreadableError as error:
        raise KitError(f"{notebook}: {error.problem.because}", error.problem.hint) from None
    labs = [load_lab(root, known) for known in names]
    best = max(labs, key=lambda lab: len(ids & lab.answers.keys()), default=None)
    # At least half of the answers must be there, because two courses may use the same grade_id.
    if best is None or 2 * len(ids & best.answers.keys()) < max(1, len(best.answers)):
        raise KitError(
            f"{notebook.name} does not belong to a lab of this course.",
            "Name the lab: --lab NAME, or another course, also if you are in its folder: --course FOLDER. "
            f"Labs in {root}: {', '.join(names)}.",
        )
    return best
