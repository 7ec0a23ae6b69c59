"""How far the bounds on time in a lab's checks are from what they tell apart.

`make margins LAB=lab4_lifecycle` grades the lab's right and wrong sample students twice, on the machine as it is and
beside four busy loops, and writes `build/margins/LAB.md`: for each bound in each check the slowest right student, the
fastest wrong one, and the margin, the smallest first. Points that are not those that are expected are named, too. The
exit status is 1 if a margin is below 2 and `tests/classes/margins.yaml` does not say why no machine decides by it.

A margin is how many times the value may still grow, or shrink, until the bound decides the other way. Seconds in which
the machine kept the programs waiting count here, and not in a check: beside busy loops a check allows for more.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import kill_matrix
import sample_class
import yaml
from places import TESTS
from soak import load

from autograder.core.results import Isolation, SubmissionResult
from autograder.course.lab import Cell, Lab, load_lab
from autograder.course.paths import CoursePaths
from autograder.grading.executors.local import Local
from autograder.grading.runner import Settings, job_of
from autograder.sandbox.isolation import preflight
from autograder.submission.reader import read_submission

NOTE = "margin "
ENOUGH = 2.0
"""A margin below this is mended, or explained in `tests/classes/margins.yaml`."""
_A_MOMENT = 1e8
"""Seconds from which on a value is a time of day and no duration."""
_RECORDER = Path(__file__).with_name("margin_recorder.py").read_text(encoding="utf-8")
_SET_UP = f"""_recorder = {{}}
exec(compile({_RECORDER!r}, "<string>", "exec"), _recorder)
_held = _recorder["_held"]
"""
"""Runs the recorder with names of its own, and as generated code, which is nothing of a check cell's to the kit."""


_EXPLAINED: dict[str, dict[str, dict[str, str]]] = yaml.safe_load(
    (TESTS / "classes").joinpath("margins.yaml").read_text(encoding="utf-8")
)


@dataclass(frozen=True)
class Measured:
    """What one student's check measured against one bound."""

    student: str
    value: float | None
    """None: what was waited for did not come."""
    bound: float

    @property
    def apart(self) -> float:
        """How many times the one is the other."""
        small, large = sorted((abs(self.value or 0.0), abs(self.bound)))
        return large / small if small else math.inf

    def __str__(self) -> str:
        """The value, the bound that was drawn for it, and the student."""
        return f"{self.value:.3g} of {self.bound:.3g} ({self.student})"


@dataclass
class Bound:
    """One bound on time in a check."""

    check: str
    line: int
    what: str
    kind: str
    right: dict[bool, list[Measured]] = field(default_factory=lambda: {True: [], False: []})
    """By whether the comparison held, or what was waited for came."""
    wrong: dict[bool, list[Measured]] = field(default_factory=lambda: {True: [], False: []})

    @property
    def expected(self) -> bool:
        """What the bound says of right students: of a silence, that nothing comes."""
        return bool(self.right[True])

    @property
    def decides(self) -> bool:
        """Whether it is a duration on which right students agree."""
        if any(abs(one.bound) > _A_MOMENT for by_held in self.right.values() for one in by_held):
            return False
        return bool(self.right[True]) != bool(self.right[False])

    @property
    def nearest_right(self) -> Measured | None:
        """The right student whom a smaller margin would hit first."""
        return _nearest(self.right[self.expected])

    @property
    def nearest_wrong(self) -> Measured | None:
        """The wrong student who is told from a right one by the least."""
        return _nearest(self.wrong[not self.expected])

    @property
    def margin(self) -> float:
        """The smaller of both."""
        return min((one.apart for one in (self.nearest_right, self.nearest_wrong) if one is not None), default=math.inf)


def _nearest(measured: Iterable[Measured]) -> Measured | None:
    return min((one for one in measured if one.value is not None), key=lambda one: one.apart, default=None)


def students(lab: Lab) -> list[str]:
    """Who is graded: right answers and mistakes, and nobody whose notebook is broken or hostile."""
    return [
        student
        for student in sample_class.students(lab.name)
        if sample_class.expected(lab, student).from_solution and not student.startswith("x")
    ]


def grade(lab: Lab, who: Sequence[str], at_once: int, busy: bool) -> dict[str, SubmissionResult]:
    """Grade sample students of a lab with the recorder before its cells; the result of each."""
    isolation = Isolation.FULL if preflight().full else Isolation.NONE
    cell = Cell(grade_id="margins", source=_SET_UP)
    jobs = []
    with tempfile.TemporaryDirectory(prefix="margins-") as folder:
        for student in who:
            made = sample_class.build_student(lab, student, Path(folder))
            path = next(iter(sorted(made.glob("*.ipynb"))))
            job = job_of(read_submission(path, lab), student, lab, Settings(isolation=isolation))
            jobs.append(job.model_copy(update={"cells": [cell, *job.cells]}))
    with load(busy), closing(Local(at_once).run(jobs, lambda _: None)) as ran:
        return {result.student: result for result in ran}


def bounds(lab: Lab, results: Iterable[SubmissionResult]) -> list[Bound]:
    """The bounds that decide something, the smallest margin first."""
    found: dict[tuple[str, int, str, str], Bound] = {}
    for result in results:
        expected = sample_class.expected(lab, result.student).points
        for check in result.checks:
            right = expected[check.grade_id] == check.max_points
            for flag in check.flags:
                for line, what, kind, held, value, bound in _notes(flag):
                    key = check.grade_id, line, what, kind
                    one = found.setdefault(key, Bound(*key))
                    measured = Measured(result.student, value, bound)
                    (one.right if right else one.wrong)[held].append(measured)
    return sorted((one for one in found.values() if one.decides), key=lambda one: (one.margin, one.check, one.line))


def _notes(flag: str) -> list[tuple[int, str, str, bool, float | None, float]]:
    return json.loads(flag.removeprefix(NOTE)) if flag.startswith(NOTE) else []


def explanation(lab: Lab, bound: Bound) -> str:
    """Why no machine decides by a bound whose margin is small; empty if that is not known."""
    told = _EXPLAINED.get(lab.name, {}).get(bound.check, {})
    return next((why for part, why in told.items() if part in bound.what), "")


def lost(lab: Lab, results: Iterable[SubmissionResult]) -> list[str]:
    """Checks whose points are not those that are expected, as sentences."""
    return [
        f"{result.student}, `{check.grade_id}`: {check.points} instead of {wanted}"
        for result in results
        for check in result.checks
        if check.points != (wanted := sample_class.expected(lab, result.student).points[check.grade_id])
    ]


def page(lab: Lab, by_load: dict[str, list[SubmissionResult]]) -> str:
    """The lab's page."""
    lines = [f"# Margins of {lab.name}", ""]
    for state, results in by_load.items():
        found = bounds(lab, results)
        small = [one for one in found if one.margin < ENOUGH]
        lines += [f"## {state}", "", f"{len(found)} bounds decide; {len(small)} have a margin below {ENOUGH:g}.", ""]
        differ = lost(lab, results)
        lines += [f"- not as expected: {one}" for one in differ] + [""] * bool(differ)
        lines += ["| margin | check | bound | kind | slowest right | fastest wrong | why it may be small |"]
        lines += ["|---|---|---|---|---|---|---|"]
        for one in found:
            what = one.what.replace("|", "\\|")[:110]
            margin = f"{one.margin:.1f}" if one.margin < math.inf else "none"
            places = one.check, f"{one.line}: `{what}`", one.kind, one.nearest_right, one.nearest_wrong
            why = (explanation(lab, one) or "**open**") if one in small else ""
            lines.append(f"| {margin} | " + " | ".join(str(place or "none") for place in places) + f" | {why} |")
        lines.append("")
    return "\n".join(lines)


def main() -> int:
    """Measure the labs that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lab", choices=kill_matrix.labs(), help="default: every lab that has a sample class")
    parser.add_argument("--jobs", type=int, default=6, help="students at once (default: 6)")
    parser.add_argument("--student", action="append", help="this one only; can be given several times")
    parser.add_argument("--quiet-only", action="store_true", help="not beside busy loops")
    asked = parser.parse_args()
    still_open = 0
    for name in [asked.lab] if asked.lab else kill_matrix.labs():
        lab = load_lab(sample_class.ROOT, name)
        by_load = {}
        for state, busy in (("As the machine is", False), ("Beside four busy loops", True)):
            if busy and asked.quiet_only:
                continue
            began = time.monotonic()
            by_load[state] = list(grade(lab, asked.student or students(lab), asked.jobs, busy).values())
            print(f"{name}: {state.lower()}, {time.monotonic() - began:.0f} s", flush=True)
            for one in bounds(lab, by_load[state]):
                if one.margin < ENOUGH and not explanation(lab, one):
                    still_open += 1
                    print(f"  {one.margin:.2f} {one.check}, line {one.line}: {one.what[:100]}")
        path = CoursePaths(sample_class.ROOT).build / "margins" / f"{name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page(lab, by_load), encoding="utf-8")
        print(path.relative_to(sample_class.ROOT))
    return 1 if still_open else 0


if __name__ == "__main__":
    sys.exit(main())
