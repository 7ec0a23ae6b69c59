"""Canaries: known answers that run among a class, in order to notice verdicts that depend on the machine or executor.

Canaries are jobs like all others, at the beginning, in the middle and at the end of the class. If a canary gets other
points than it must, it has flipped, and the results of submissions that ran at about the same time are doubtful. The
results of canaries are not recorded.

Canaries are two notebooks for which it is known how many points each check must give. They contain the course's own
solution, with changes from `canaries.yaml` that are distributed to them in turn. For each check that the file names,
one notebook has the right answer, and the other one has a wrong answer.
"""

from __future__ import annotations

import json
import tempfile
import uuid
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from autograder.core.errors import KitError
from autograder.core.grades import in_points
from autograder.core.results import CheckResult, SubmissionResult
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.grading.job import Job
from autograder.grading.runner import Settings, job_of
from autograder.submission.reader import read_submission


class WrongAnswer(BaseModel):
    """One mistake in the solution, and the points that the checks must give for the solution with this mistake."""

    model_config = ConfigDict(extra="forbid")

    answer: str
    """The grade_id of the answer cell."""
    instead_of: str = Field(min_length=1)
    """A text that occurs once in the cell's solution."""
    write: str
    """The text that replaces it."""
    points: dict[str, float] = Field(min_length=1)
    """The points of every check that the mistake affects, by grade_id. They are fewer than the check can give."""


@dataclass(frozen=True)
class KnownAnswers:
    """A notebook whose points are known."""

    sources: dict[str, str]
    """The source of each answer cell, by grade_id."""
    points: dict[str, float | None]
    """The points that each check must give, by grade_id; None if it must give fewer points than it can."""


def wrong_answers(root: Path, lab: Lab) -> list[WrongAnswer]:
    """Read `canaries.yaml`; the result is empty if there is no such file.

    Raises:
        KitError: the file cannot be used. The message says what to repair.
    """
    path = CoursePaths(root).canaries(lab.name)
    try:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        found = TypeAdapter(list[WrongAnswer]).validate_python(told or [])
    except FileNotFoundError:
        return []
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise KitError(f"{path} is not valid YAML: {error}.", "Repair that line.") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ", ".join(str(part + 1) if isinstance(part, int) else f"`{part}`" for part in first["loc"])
        raise KitError(
            f"{path}, entry {place}: {first['msg']}.", "An entry has `answer`, `instead_of`, `write` and `points`."
        ) from error
    for number, one in enumerate(found, start=1):
        wrong = _mistake(one, lab, {name for other in found[: number - 1] for name in other.points})
        if wrong:
            raise KitError(f"{path}, entry {number}: {wrong}", "Repair that entry.")
    return found


def _mistake(one: WrongAnswer, lab: Lab, earlier: Collection[str]) -> str:
    """Return the mistake in an entry of the file as a sentence; empty if the entry is valid."""
    full = {check.grade_id: check.points or 0.0 for check in lab.checks}
    if one.answer not in lab.answers:
        return f"the lab has no answer `{one.answer}`; it has {', '.join(lab.answers)}."
    times = lab.answers[one.answer].solution.count(one.instead_of)
    if times != 1:
        return f"`instead_of` occurs {times} times in the solution of `{one.answer}`, but it must occur once."
    for name, points in one.points.items():
        if name not in full:
            return f"the lab has no check `{name}`; it has {', '.join(full)}."
        if name in earlier:
            return f"an earlier entry also names `{name}`, but there can be only one wrong answer for each check."
        if not 0 <= points < full[name]:
            return f"`{name}` gives {full[name]:g} points at most, so a wrong answer must get fewer, not {points:g}."
    return ""


def known_answers(root: Path, lab: Lab) -> list[KnownAnswers]:
    """Return the two notebooks of a lab whose points are known; empty if the course does not have the lab's solutions.

    If the course has no file of wrong answers, the two notebooks are the solution and the notebook as students receive
    it.

    Raises:
        KitError: the course's file of wrong answers cannot be used.
    """
    solution = {name: answer.solution for name, answer in lab.answers.items()}
    blank = {name: answer.blank for name, answer in lab.answers.items()}
    full: dict[str, float | None] = {check.grade_id: check.points for check in lab.checks}
    if solution == blank or not full:
        return []
    wrong = wrong_answers(root, lab)
    if not wrong:
        return [KnownAnswers(solution, full), KnownAnswers(blank, dict.fromkeys(full))]
    pair = []
    for entries in (wrong[0::2], wrong[1::2]):
        sources, points = dict(solution), dict(full)
        for one in entries:
            if one.instead_of not in sources[one.answer]:
                raise KitError(
                    f"{CoursePaths(root).canaries(lab.name)}: two entries change the same place in `{one.answer}`.",
                    "Change different places, or put another entry between the two, because entries go to the two"
                    " notebooks in turn.",
                )
            sources[one.answer] = sources[one.answer].replace(one.instead_of, one.write)
            points |= one.points
        pair.append(KnownAnswers(sources, points))
    return pair


JOBS_PER_PAIR = 20
"""The number of jobs for each pair of canaries. A class has at least one pair and at most three."""
_SAME = 0.01
"""Points that differ by less than this are equal, because a part of a table may give a third of a point."""
_LISTED = 12
"""The number of flips that are listed."""
_MOMENTS = {2: ("at the beginning", "at the end"), 3: ("at the beginning", "in the middle", "at the end")}


@dataclass(frozen=True)
class Flip:
    """A known answer that got other points than it must get."""

    moment: str
    check: str
    right: bool
    """Whether the answer is right."""
    expected: str
    """The points that it must get, in words."""
    seen: CheckResult

    @property
    def why(self) -> str:
        """The reason that the check gave for taking points off; empty if it took none off."""
        failure = self.seen.first_failure
        return f"Its reason: {failure.title}: {failure.because or failure.observed}" if failure is not None else ""

    def __str__(self) -> str:
        """Describe the flip as a sentence."""
        answer = "right" if self.right else "wrong"
        got = f"{self.seen.points:g} of {self.seen.max_points:g}. {self.why}".rstrip()
        return f"`{self.check}` {self.moment}: a {answer} answer must get {self.expected}, and got {got}"


def known_jobs(known: Sequence[KnownAnswers], lab: Lab, settings: Settings, names: Sequence[str]) -> list[Job]:
    """Return the notebooks as jobs, as if students with these names had handed them in."""
    jobs = []
    with tempfile.TemporaryDirectory(prefix="class-") as folder:
        for number, (one, name) in enumerate(zip(known, names, strict=True)):
            path = Path(folder, str(number), f"{lab.name}.ipynb")
            path.parent.mkdir()
            path.write_text(json.dumps(lab.clean_notebook(one.sources)), encoding="utf-8")
            jobs.append(job_of(read_submission(path, lab), name, lab, settings))
    return jobs


def otherwise(known: KnownAnswers, lab: Lab, result: SubmissionResult, moment: str = "") -> list[Flip]:
    """Return a flip for each check that gave a notebook other points than it must get.

    A check that the grader could not decide is not a flip.
    """
    full = {check.grade_id: check.points or 0.0 for check in lab.checks}
    flips = []
    for check in result.checks:
        must, most = known.points[check.grade_id], full[check.grade_id]
        if check.points is None or (check.points < most if must is None else abs(check.points - must) < _SAME):
            continue
        expected = f"fewer than {most:g} points" if must is None else in_points(must)
        flips.append(Flip(moment, check.grade_id, must == most, expected, check))
    return flips


@dataclass(frozen=True)
class _Placed:
    known: KnownAnswers
    moment: str
    beside: frozenset[str]
    """The students whose submissions run at about the same time."""


@dataclass
class Canaries:
    """The known answers in one run of a class, and their results."""

    lab: Lab
    known: list[KnownAnswers]
    """A pair of notebooks that complement each other, or an empty list."""
    settings: Settings
    flips: list[Flip] = field(default_factory=list)
    undecided: int = 0
    """The number of checks of canaries that the grader could not decide."""
    doubtful: set[str] = field(default_factory=set)
    """The students whose submissions ran at about the same time as a canary that flipped."""
    flipped_again: bool = False
    """Whether a canary flipped of which checks were run again, beside those of other submissions."""
    ran: int = 0
    """The number of canaries that have a result."""
    seconds: float = 0.0
    """The sum of the running times of the canaries, in seconds."""
    class_seconds: float = 0.0
    """The sum of the running times of the submissions, in seconds."""
    _placed: dict[str, _Placed] = field(default_factory=dict)

    def among(self, jobs: Mapping[str, Job]) -> list[Job]:
        """Return the jobs of a class in their order, with the known answers inserted.

        Args:
            jobs: the jobs, by student.
        """
        students, class_ = list(jobs), list(jobs.values())
        if not self.known:
            return class_
        pairs = max(1, min(3, len(class_) // JOBS_PER_PAIR))
        groups = [self.known[:1], self.known[1:]] if pairs == 1 else [self.known] * pairs
        length = -(-len(class_) // (len(groups) - 1))
        parts = [slice(n * length, (n + 1) * length) for n in range(len(groups) - 1)]
        mixed: list[Job] = []
        for number, (group, moment) in enumerate(zip(groups, _MOMENTS[len(groups)], strict=True)):
            neighbours = parts[max(0, number - 1) : number + 1]
            beside = frozenset(student for part in neighbours for student in students[part])
            names = [self._new_name(jobs) for _ in group]
            self._placed |= {name: _Placed(one, moment, beside) for name, one in zip(names, group, strict=True)}
            mixed += known_jobs(group, self.lab, self.settings, names)
            mixed += class_[parts[number]] if number < len(parts) else []
        return mixed

    def _new_name(self, taken: Collection[str]) -> str:
        """Return a random name that no student of the class has."""
        name = uuid.uuid4().hex[:12]
        return self._new_name(taken) if name in taken else name

    def take(self, result: SubmissionResult) -> None:
        """Compare the result of a known answer with the points that it must get."""
        placed = self._placed[result.student]
        self.ran += 1
        self.seconds += result.seconds.get("total", 0.0)
        self.undecided += sum(check.points is None for check in result.checks)
        flips = otherwise(placed.known, self.lab, result, placed.moment)
        self.flips += flips
        if flips:
            self.doubtful |= placed.beside
            self.flipped_again |= result.run_again

    def compare(self, results: Sequence[SubmissionResult]) -> None:
        """Take the results of the class that ran among the canaries.

        If a canary flipped of which checks were run again, results whose checks were run again are doubtful, too.
        """
        self.class_seconds = sum(result.seconds.get("total", 0.0) for result in results)
        if self.flipped_again:
            self.doubtful |= {result.student for result in results if result.run_again}

    def told(self, root: Path) -> list[str]:
        """Return sentences about the results of the canaries and their running time; empty if no canary ran."""
        if not self.ran:
            return []
        name = CoursePaths(root).canaries(self.lab.name)
        whole = self.seconds + self.class_seconds
        share = f" They took {100 * self.seconds / whole:.0f} % of the running time." if whole else ""
        sentences = [
            f"Canaries: {self.ran} notebooks with known answers ran among the class. {self._verdicts()}{share}"
        ]
        checks = self.lab.checks
        without = sum(all(one.points[check.grade_id] == check.points for one in self.known) for check in checks)
        if any(None in one.points.values() for one in self.known):
            sentences.append(
                f"There is no {name}, so the notebook as students receive it serves as the wrong answer, which shows"
                " little."
            )
        elif without:
            sentences.append(f"{name} has no wrong answer for {without} of {len(checks)} checks.")
        return sentences

    def _verdicts(self) -> str:
        checks = self.ran * len(self.lab.checks)
        sentences = []
        if self.flips:
            sentences.append(f"{len(self.flips)} of their {checks} checks gave other points than they must.")
        if self.undecided:
            sentences.append(f"The grader could not find out about {self.undecided} of their {checks} checks.")
        return " ".join(sentences) or "Each check gave them the points that it must."

    def flipped(self) -> str:
        """Return a clause that lists the flips, for the end of a sentence."""
        lines = [f"\n  {flip}" for flip in self.flips[:_LISTED]]
        lines += [f"\n  and {len(self.flips) - _LISTED} more"] if len(self.flips) > _LISTED else []
        return f"answers with known points got other points in this run:{''.join(lines)}"

    def refusal(self, root: Path, believed: int) -> KitError:
        """Return an error that says why nothing is recorded after a flip, and what a person should do.

        Args:
            root: the course's folder.
            believed: the number of results of the class that are kept.
        """
        name = self.lab.name
        return KitError(
            f"No grade was written, because {self.flipped()}",
            "Points must not depend on the machine, so the results of students who ran beside such an answer are"
            " doubtful.\n"
            "  1. See what else runs on this machine (`top`), and what it lacks (`autograder doctor`).\n"
            "  2. Grade again with fewer runs at once, such as --jobs"
            f" {max(1, self.settings.at_once // 2)}. Of this class {believed} can be believed and"
            f" will not be run again; {len(self.doubtful)} will be.\n"
            "  3. If the same check flips on a quiet machine as well, then the check or its entry in\n"
            f"     {CoursePaths(root).canaries(name)} is wrong: autograder lint {name}\n"
            "  With --despite-canaries all results count as they are, and nothing is run again.",
        )
