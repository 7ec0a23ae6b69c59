"""Grade a class: take in the submissions, run them, record the results, and report what happened."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from autograder.core.errors import KitError
from autograder.core.files import only_one, remove_unfinished
from autograder.core.grades import Grade
from autograder.core.results import Status, SubmissionResult
from autograder.course.lab import Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.gradebook.grades import read_grades, write_grades
from autograder.gradebook.recorder import Recorder, Recording
from autograder.gradebook.renamed import move_renamed
from autograder.grading.canaries import Canaries, known_answers
from autograder.grading.class_runner import run_class
from autograder.grading.runner import Settings
from autograder.grading.store import ResultStore
from autograder.intake.collect import Collected, collect
from autograder.intake.options import Accepted
from autograder.intake.words import count
from autograder.report.terminal import plain

_NAMED = 3
"""The number of running submissions that are shown by name."""


class Steps:
    """Shows the progress as a bar on a terminal, and otherwise as a line for each step.

    Args:
        total: the number of submissions.
        console: the console on which the progress is shown.
    """

    def __init__(self, total: int, console: Console) -> None:
        """Prepare the progress bar without showing it."""
        self._console, self.total, self.done, self._ran = console, total, 0, 0
        self._at_work: dict[str, None] = {}
        self._finished: set[str] = set()
        self._began = 0.0
        self._lock = threading.Lock()
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[more]}", markup=False),
        )
        self._progress = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self._task = self._progress.add_task("grading", total=total, more="")

    def __enter__(self) -> Steps:
        """Show the progress bar."""
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the progress bar."""
        self._progress.stop()

    def started(self, student: str) -> None:
        """Note that a submission has started. This may be called in any thread, repeatedly, and even after its end."""
        with self._lock:
            self._began = self._began or time.monotonic()
            if student not in self._finished:
                self._at_work[student] = None
        self._progress.update(self._task, more=self._more())

    def finished(self, result: SubmissionResult) -> None:
        """Note that a result has been stored, and show it."""
        self.done += 1
        with self._lock:
            self._finished.add(result.student)
            if result.student in self._at_work:
                del self._at_work[result.student]
                self._ran += 1
        self._progress.update(self._task, advance=1, more=self._more())
        trouble = _trouble(result)
        line = f"{result.student} {result.points:g}/{result.max_points:g}{trouble}"
        if not self._console.is_terminal:
            speed = self._speed()
            self.say(f"{self.done}/{self.total} {line}{f'  ({speed})' if speed else ''}")
        elif trouble:
            self.say(line)

    def watching(self) -> None:
        """Show that the whole class has run, while known answers may still be running."""
        self._progress.update(self._task, description="canaries", more="")

    def recording(self, recorded: int) -> None:
        """Show that everything has run, and how many submissions are in the gradebook."""
        self._progress.update(self._task, description="recording", completed=recorded, more="")

    def say(self, sentence: str) -> None:
        """Print a line above the progress bar."""
        self._console.print(plain(sentence), markup=False, soft_wrap=True)

    def _speed(self) -> str:
        seconds = time.monotonic() - self._began if self._began else 0.0
        if not self._ran or not seconds:
            return ""
        left = (self.total - self.done) * seconds / self._ran
        return f"{60 * self._ran / seconds:.1f} a minute, {_duration(left)} left"

    def _more(self) -> str:
        with self._lock:
            names = list(self._at_work)
        others = f" +{len(names) - _NAMED}" if len(names) > _NAMED else ""
        at_work = f"at work: {', '.join(names[:_NAMED])}{others}" if names else ""
        return plain("  ".join(part for part in (self._speed(), at_work) if part))


def _trouble(result: SubmissionResult) -> str:
    undecided = sum(check.status is Status.UNKNOWN for check in result.checks)
    parts = [f"{undecided} undecided"] if undecided else []
    parts += [problem.title for problem in result.real_problems[:1]]
    return f": {', '.join(parts)}" if parts else ""


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


@dataclass
class ClassRun:
    """The results of grading a class."""

    results: list[SubmissionResult]
    """The results in brief; the stored results are whole."""
    collected: Collected
    """What was taken in, and what was left out."""
    unrecorded: dict[str, str]
    """The reason why nbgrader has no grade, by student."""
    grades: Path
    """The table of grades."""
    by_student: dict[str, Grade]
    """The grades that the gradebook now holds, including points that people gave."""
    told: list[str]
    """Sentences about changes of the gradebook itself."""
    canaries: list[str] = field(default_factory=list)
    """Sentences about the known answers that ran with the class."""
    seconds: dict[str, float] = field(default_factory=dict)
    """How long the whole grading took (`all`), the runs (`running`), and nbgrader, mostly meanwhile (`recording`)."""


@dataclass
class Tried:
    """The results of a trial run, which show what grading a class would change. Nothing is recorded."""

    before: dict[str, SubmissionResult]
    """The results that are recorded, by student. Students without a recorded result are not in it."""
    after: list[SubmissionResult]
    """The results of the trial run."""
    grades: dict[str, Grade]
    """The grades that the gradebook holds, by student."""
    collected: Collected


@dataclass(frozen=True)
class Intake:
    """Options for taking in a class."""

    format: str = ""
    """The format of the submissions; empty to detect it."""
    accepted: Collection[Accepted] = ()
    """The objections that a person has accepted."""
    told: Callable[[Collected], None] = lambda _: None
    """A function that is called as soon as the class is taken in, before anything is run."""

    def collect(self, source: Path, lab: str, root: Path, tried_in: Path | None = None) -> Collected:
        """Take in a class. For the arguments and the errors see the function `collect`."""
        collected = collect(source, lab, root, self.format, self.accepted, tried_in)
        self.told(collected)
        return collected


_AS_IT_IS = Intake()


def grade_class(root: Path, lab_name: str, source: Path, settings: Settings, intake: Intake = _AS_IT_IS) -> ClassRun:
    """Grade every submission in a folder or zip.

    Args:
        root: the course's folder.
        lab_name: the lab to which the submissions belong.
        source: the folder or zip with the submissions.
        settings: how the submissions are run.
        intake: the options for taking in the class.

    Raises:
        KitError: there is an error of usage or set-up, another grading is running, or a known answer got other points
            than it must, so that nothing is recorded.
        KeyboardInterrupt: the grading was interrupted. Finished results are kept, and the next run continues from them.
    """
    with only_one(CoursePaths(root).lock, "A grading"):
        remove_unfinished(CoursePaths(root).build)
        return _graded(root, load_lab(root, lab_name), source, settings, intake)


def try_class(root: Path, lab_name: str, source: Path, settings: Settings, intake: Intake = _AS_IT_IS) -> Tried:
    """Run what `grade_class` would run, but record nothing. A later `grade_class` uses the results of these runs.

    Raises:
        KitError: see `grade_class`.
    """
    lab = load_lab(root, lab_name)
    with only_one(CoursePaths(root).lock, "A grading"), TemporaryDirectory(prefix="class-") as folder:
        grades = {grade.student: grade for grade in read_grades(root, lab.name)}  # first, because it may be unusable
        canaries = _canaries(root, lab, settings)
        collected = intake.collect(source, lab.name, root, Path(folder))
        store = ResultStore(root)
        before = {student: store.last(lab.name, student) for student in collected.notebooks}
        console = Console(file=sys.stderr, highlight=False)
        with Steps(len(collected.notebooks), console) as steps:
            try:
                after = run_class(
                    collected.notebooks, root, lab, settings, steps.finished, steps.started, True, canaries
                )
            except KeyboardInterrupt:
                _tell_flips(canaries, settings, steps)
                raise
    _refuse_flipped(canaries, root, settings, len(after))
    return Tried(
        before={student: result for student, result in before.items() if result is not None},
        after=list(after.values()),
        grades=grades,
        collected=collected,
    )


def _canaries(root: Path, lab: Lab, settings: Settings) -> Canaries | None:
    """Return the known answers for a run; None if they are switched off or the course has none."""
    try:
        known = known_answers(root, lab) if settings.canaries else []
    except KitError as error:
        raise KitError(
            f"{error.what} Nothing was graded.", f"{error.do} Or grade without known answers: --no-canaries."
        ) from error
    return Canaries(lab, known, settings) if known else None


def _refuse_flipped(canaries: Canaries | None, root: Path, settings: Settings, results: int) -> None:
    if canaries is not None and canaries.flips and not settings.despite_canaries:
        raise canaries.refusal(root, results - len(canaries.doubtful))


def _tell_flips(canaries: Canaries | None, settings: Settings, steps: Steps) -> None:
    if canaries is not None and canaries.flips and not settings.despite_canaries:
        again = count(len(canaries.doubtful), "student")
        steps.say(f"The results of {again} are doubtful and will be run again, because {canaries.flipped()}")


def _graded(root: Path, lab: Lab, source: Path, settings: Settings, intake: Intake) -> ClassRun:
    console = Console(file=sys.stderr, highlight=False)
    canaries = _canaries(root, lab, settings)
    collected = intake.collect(source, lab.name, root)
    began = time.monotonic()
    recorder = Recorder(root, lab, settings.force)
    recorder.begin()
    recorder.told += move_renamed(root)
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
            if canaries is None:
                recording.put(result.student)
            elif steps.done == steps.total:
                steps.watching()

        try:
            results = run_class(collected.notebooks, root, lab, settings, finished, steps.started, canaries=canaries)
            ran = time.monotonic()
            _refuse_flipped(canaries, root, settings, len(results))
            for student in results if canaries is not None else ():
                recording.put(student)
            recording.finish()
        except BaseException as error:
            recording.give_up()
            for sentence in recorder.told:
                steps.say(sentence)
            if isinstance(error, KeyboardInterrupt):
                paths = CoursePaths(root)
                where = (paths.results if canaries is None else paths.tried) / lab.name
                kept = f"{steps.done} of {steps.total} results are kept in {where}"
                steps.say(f"\n{kept}; run again to go on.")
                _tell_flips(canaries, settings, steps)
            raise
    return ClassRun(
        results=list(results.values()),
        collected=collected,
        unrecorded=recorder.failures,
        grades=write_grades(root),
        by_student={grade.student: grade for grade in read_grades(root, lab.name)},
        told=recorder.told,
        canaries=canaries.told(root) if canaries is not None else [],
        seconds={
            "all": round(time.monotonic() - began, 2),
            "running": round(ran - began, 2),
            "recording": round(recording.seconds, 2),
        },
    )
