"""Programs that would rather not be graded: each one of `attacks/graded` fails its check, and few stay undecided.

The line `Must: …` of its docstring is the code of the reason, or several, where it is for the program's own doing a
matter of luck which one is found. `stuck` means that the grader gets stuck, and has to say so of this check alone.
"""

from __future__ import annotations

import re

import pytest
from places import TESTS

from autograder.core.results import Isolation, Status
from autograder.grading import supervisor
from autograder.grading.job import Cell, Job
from autograder.grading.supervisor import run_in_worker
from autograder.sandbox.isolation import preflight

FOLDER = TESTS / "attacks" / "graded"
PROGRAMS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.py"))}
SET_UP = "from autograder.checks import launch\nfrom std_msgs.msg import String\n"
CHECK = """
with launch("p") as ros:
    ros.node("/talker").expect()
    {}
ros.score(1)
"""
TALKS, HAS_A_PARAMETER = (
    'ros.topic("/talk", String).expect_messages(within=4)',
    'ros.node("/talker").expect_parameter("x", 3)',
)


SOON_STUCK = """
import sys
worker = sys.modules["autograder.grading.worker"]  # of which this process is a fork
worker.CELL_SECONDS, worker.STUCK_SECONDS = 60, 1  # from the next check on, until another worker goes on
"""
SCORES = "from autograder.checks import outcomes\nfrom autograder.checks.scoring import score\n"
GOOD = "outcomes.passed('good')\nscore(1)"
MAKE_STUCK = [name for name, source in PROGRAMS.items() if "\nMust: stuck.\n" in source]


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name[0] != "_" and name not in MAKE_STUCK])
def test_the_check_fails_and_says_why(name: str) -> None:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    must = re.search(r"^Must: (.+)\.$", PROGRAMS[name], re.MULTILINE)
    assert must is not None
    (check,) = run_in_worker(job(name, SET_UP, check_of(name))).checks
    assert check.status is Status.FAILED and check.points == 0, check
    assert check.first_failure is not None and check.first_failure.code in must[1].split(", "), check


@pytest.mark.parametrize("name", MAKE_STUCK)
def test_a_check_in_which_the_grader_is_made_stuck_costs_no_other_and_is_flagged(name: str) -> None:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    before, check, after = run_in_worker(job(name, SET_UP + SCORES, SOON_STUCK + GOOD, check_of(name), GOOD)).checks
    assert (before.points, after.points) == (1, 1)
    assert check.status is Status.UNKNOWN and check.points is None and check.flags, check
    assert check.outcomes[0].code == supervisor.STUCK.code, check


def check_of(name: str) -> str:
    """The check that a program has to get around."""
    return CHECK.format(HAS_A_PARAMETER if name.startswith("parameter") else TALKS)


def job(name: str, set_up: str, *checks: str) -> Job:
    """A submission with one program, and these checks on it."""
    cells = [Cell(grade_id=f"check{number}", points=1, source=source) for number, source in enumerate(checks)]
    return Job(
        student="someone",
        lab="lab",
        digest="digest",
        isolation=Isolation.FULL,
        seed=1,
        files={"p.py": PROGRAMS[name], "_rmw.py": PROGRAMS["_rmw"]},
        cells=[Cell(grade_id="set_up", source=set_up), *cells],
    )
