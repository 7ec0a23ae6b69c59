"""Programs that would rather not be graded: each one of `attacks/graded` fails its check, and none stays undecided.

The line `Must: …` of its docstring is the code of the reason, or several, where it is for the program's own doing a
matter of luck which one is found.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from autograder.grading.job import Cell, Job
from autograder.grading.stage_a import run_in_worker
from autograder.results import Isolation, Status
from autograder.sandbox.isolation import preflight

FOLDER = Path(__file__).parent / "attacks" / "graded"
PROGRAMS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.py"))}
SET_UP = "from autograder.checks import launch\nfrom std_msgs.msg import String\n"
CHECK = """
with launch("p") as ros:
    ros.expect_node("/talker")
    {}
ros.score(1)
"""
TALKS, HAS_A_PARAMETER = 'ros.expect_messages("/talk", String, within=4)', 'ros.expect_parameter("/talker", "x", 3)'


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name[0] != "_"])
def test_the_check_fails_and_says_why(name: str) -> None:
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    must = re.search(r"^Must: (.+)\.$", PROGRAMS[name], re.MULTILINE)
    assert must is not None
    source = CHECK.format(HAS_A_PARAMETER if name.startswith("parameter") else TALKS)
    job = Job(
        student="someone",
        lab="lab",
        digest="digest",
        isolation=Isolation.FULL,
        seed=1,
        files={"p.py": PROGRAMS[name], "_rmw.py": PROGRAMS["_rmw"]},
        cells=[Cell(grade_id="set_up", source=SET_UP), Cell(grade_id="check", points=1, source=source)],
    )
    (check,) = run_in_worker(job).checks
    assert check.status is Status.FAILED and check.points == 0, check
    assert check.first_failure is not None and check.first_failure.code in must[1].split(", "), check
