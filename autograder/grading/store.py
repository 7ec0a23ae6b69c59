"""The stored results of a course: a JSON file for each submission, which is written completely or not at all."""

from __future__ import annotations

import contextlib
from pathlib import Path

from autograder.core.results import SCHEMA_VERSION, Isolation, SubmissionResult
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.grading.trusted_result import validated
from autograder.intake.record import left_class


class ResultStore:
    """The results of the course at `root`.

    Args:
        root: the course's folder.
        folder: the folder of results that do not count: `tried`, `to_run_again` or `doubtful` of `CoursePaths`; None
            for the results that count.
    """

    def __init__(self, root: Path, folder: Path | None = None) -> None:
        """Store the paths without reading or writing anything."""
        self._root = root
        self._folder = folder or CoursePaths(root).results

    def path(self, lab: str, student: str) -> Path:
        """Return the file in which the result of a submission is stored."""
        return self._folder / lab / f"{student}.json"

    def save(self, result: SubmissionResult) -> None:
        """Store a result, and replace an earlier result of the same student and lab.

        Raises:
            OSError: the result cannot be written. The earlier one is still there.
        """
        result.save(self.path(result.lab, result.student))

    def move(self, lab: str, student: str, to: ResultStore) -> None:
        """Move a result, if there is one, to another store of the course, and replace an earlier result there."""
        there = to.path(lab, student)
        there.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileNotFoundError):
            self.path(lab, student).replace(there)

    def remove(self, lab: str, student: str) -> None:
        """Remove a result, if there is one."""
        self.path(lab, student).unlink(missing_ok=True)

    def fitting(
        self, lab: Lab, student: str, digest: str, isolation: Isolation | None = None, seed: int | None = None
    ) -> SubmissionResult | None:
        """Return the stored result if it belongs to exactly these answers and this kit; otherwise None.

        Args:
            lab: the lab that was graded.
            student: the student who handed it in.
            digest: the digest of the current submission.
            isolation: the isolation with which the submission must have been run; None accepts any.
            seed: the seed with which the submission must have been run; None accepts any.
        """
        result = self.readable(lab, student)
        if result is None or result.digest != digest:
            return None
        return result if isolation in (None, result.isolation) and seed in (None, result.seed) else None

    def readable(self, lab: Lab, student: str) -> SubmissionResult | None:
        """Return the stored result with the lab's checks, whichever kit made it; None if this kit cannot read it."""
        result = self.last(lab.name, student)
        if result is None or result.schema_version != SCHEMA_VERSION:
            return None
        return validated(result, lab.checks)

    def last(self, lab: str, student: str) -> SubmissionResult | None:
        """Return the stored result, whichever answers it belongs to; None if there is none or it cannot be read."""
        try:
            return SubmissionResult.load(self.path(lab, student))
        except (OSError, ValueError):
            return None

    def all(self, lab: str | None = None) -> list[SubmissionResult]:
        """Return every stored result, or those of one lab, sorted by lab and student.

        Results that cannot be read and results of students who have left the class are left out.
        """
        results = []
        for folder in [self._folder / lab] if lab else sorted(self._folder.glob("*")):
            left = left_class(self._root, folder.name)
            for path in sorted(folder.glob("*.json")):
                if path.stem not in left:
                    with contextlib.suppress(OSError, ValueError):
                        results.append(SubmissionResult.load(path))
        return results
