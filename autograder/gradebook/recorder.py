"""Records results in nbgrader's gradebook and writes feedback, one student after another."""

from __future__ import annotations

import math
import os
import shutil
from pathlib import Path
from typing import Any

from autograder.core.files import modified
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.api import answered, last_error, open_api
from autograder.gradebook.release import register
from autograder.gradebook.settings import gradebook_file
from autograder.grading.store import ResultStore
from autograder.submission import timestamp


class Recorder:
    """Records results in the gradebook and writes feedback, one student at a time, for those that changed."""

    def __init__(self, root: Path, lab: Lab, force: bool) -> None:
        """Look at what is recorded already; nothing is loaded or written before something is to be.

        Args:
            root: of the course.
            lab: whose results are recorded.
            force: record also what did not change.
        """
        self._root, self._lab, self._force = root, lab, force
        self._paths, self._store = CoursePaths(root), ResultStore(root)
        self._api: Any = None
        self._written: list[Path] = []
        self.failures: dict[str, str] = {}
        """Why it failed, by student; the others are recorded."""
        gradebook = gradebook_file(root)
        if gradebook is not None and not gradebook.exists():
            # What was recorded went with the gradebook.
            shutil.rmtree(self._paths.autograded, ignore_errors=True)
        # Of a gradebook on a server nobody knows when somebody graded by hand, so every page is written again.
        self._last_grade = math.inf if gradebook is None else modified(gradebook)

    def __enter__(self) -> Recorder:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Note that the feedback knows the gradebook as it is now, also when the rest of the class was given up."""
        for path in self._written:
            os.utime(path)

    def record(self, student: str) -> None:
        """Record one student's result.

        Raises:
            KitError: the gradebook has grades for other cells.
            KeyboardInterrupt: the student counts as not recorded.
        """
        feedback = self._paths.feedback_page(student, self._lab.name)
        steps = self._due(student)
        if steps and self._api is None:
            register(self._root, self._lab.name)
            self._api = open_api(self._root)
        if steps:
            feedback.unlink(missing_ok=True)
        for step in steps:
            answer = answered(getattr(self._api, step)(self._lab.name, student, force=True))
            if not answer["success"]:
                self.failures[student] = last_error(answer)
                return
        self._written.append(feedback)

    def _due(self, student: str) -> list[str]:
        """The steps of nbgrader's that a student needs; none if neither the result nor a grade changed."""
        recorded = self._paths.autograded_notebook(student, self._lab.name)
        result = self._store.path(self._lab.name, student)
        handed_in = self._paths.submitted_notebook(student, self._lab.name).with_name(timestamp.FILE_NAME)
        if self._force or modified(recorded) < max(map(modified, (result, self._lab.notebook, handed_in))):
            return ["autograde", "generate_feedback"]
        # The gradebook was younger than the feedback where somebody graded by hand since.
        stale = modified(self._paths.feedback_page(student, self._lab.name)) < self._last_grade
        return ["generate_feedback"] if stale else []
