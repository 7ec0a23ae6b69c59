"""The whole way of a class: take in, run, record, and tell what came of it."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console

from autograder.core.files import remove_unfinished
from autograder.core.grades import Grade
from autograder.core.lock import only_one
from autograder.core.results import SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.background import Recording
from autograder.gradebook.grades import write_grades
from autograder.gradebook.progress import Steps
from autograder.gradebook.recorder import Recorder
from autograder.gradebook.scores import read_grades
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings
from autograder.grading.store import ResultStore
from autograder.intake.collect import Collected, collect


@dataclass
class ClassRun:
    """What came of grading a class."""

    results: list[SubmissionResult]
    """Without pictures, which the stored ones have."""
    collected: Collected
    """What was taken in and what was not."""
    unrecorded: dict[str, str]
    """Why nbgrader has no grade, by student."""
    grades: Path
    by_student: dict[str, Grade]
    """What the gradebook holds now, with what people gave."""
    told: list[str]
    """What was changed about the gradebook itself, as sentences."""
    seconds: dict[str, float] = field(default_factory=dict)
    """How long it took in all; until the last submission had run; and how long nbgrader worked, mostly meanwhile."""


@dataclass
class Tried:
    """What grading a class now would change, of which nothing is recorded."""

    before: dict[str, SubmissionResult]
    """The results that are recorded, by student; of who is new there is none."""
    after: list[SubmissionResult]
    grades: dict[str, Grade]
    """What the gradebook holds, by student."""
    collected: Collected


def grade_class(root: Path, lab_name: str, source: Path, settings: Settings) -> ClassRun:
    """Grade every submission in a folder or zip.

    Args:
        root: of the course.
        lab_name: the lab they answer.
        source: folder or zip.
        settings: how to run them.

    Raises:
        KitError: usage or set-up; or another grading is at work.
        KeyboardInterrupt: finished results are kept, and the next run goes on from them.
    """
    with only_one(CoursePaths(root).lock, "A grading"):
        remove_unfinished(CoursePaths(root).build)
        return _graded(root, load_lab(root, lab_name), source, settings)


def try_class(root: Path, lab_name: str, source: Path, settings: Settings) -> Tried:
    """Run what `grade_class` would run, and record nothing; `grade_class` takes what was run here.

    Raises:
        KitError: as `grade_class`.
    """
    lab = load_lab(root, lab_name)
    with only_one(CoursePaths(root).lock, "A grading"):
        collected = collect(source, lab.name, root)
        store = ResultStore(root)
        before = {student: store.last(lab.name, student) for student in collected.notebooks}
        console = Console(file=sys.stderr, highlight=False)
        with Steps(len(collected.notebooks), console) as steps:
            after = run_class(collected.notebooks, root, lab, settings, steps.finished, steps.started, tried=True)
    return Tried(
        before={student: result for student, result in before.items() if result is not None},
        after=list(after.values()),
        grades={grade.student: grade for grade in read_grades(root, lab.name)},
        collected=collected,
    )


def _graded(root: Path, lab: Lab, source: Path, settings: Settings) -> ClassRun:
    console = Console(file=sys.stderr, highlight=False)
    collected = collect(source, lab.name, root)
    began = time.monotonic()
    recorder = Recorder(root, lab, settings.force)
    recorded: set[str] = set()

    with Steps(len(collected.notebooks), console) as steps:

        def on_recorded(student: str) -> None:
            recorded.add(student)
            if steps.done == steps.total:
                steps.recording(len(recorded))
            if student in recorder.failures:
                steps.say(f"{student} is not in the gradebook: {recorder.failures[student]}")

        recording = Recording(recorder, on_recorded)

        def finished(result: SubmissionResult) -> None:
            steps.finished(result)
            recording.put(result.student)

        try:
            results = run_class(collected.notebooks, root, lab, settings, finished, steps.started)
            ran = time.monotonic()
            recording.finish()
        except BaseException as error:
            recording.give_up()
            if isinstance(error, KeyboardInterrupt):
                kept = f"{steps.done} of {steps.total} results are kept in {CoursePaths(root).results / lab.name}"
                steps.say(f"\n{kept}; run again to go on.")
            raise
    return ClassRun(
        results=list(results.values()),
        collected=collected,
        unrecorded=recorder.failures,
        grades=write_grades(root),
        by_student={grade.student: grade for grade in read_grades(root, lab.name)},
        told=recorder.told,
        seconds={
            "all": round(time.monotonic() - began, 2),
            "running": round(ran - began, 2),
            "recording": round(recording.seconds, 2),
        },
    )
