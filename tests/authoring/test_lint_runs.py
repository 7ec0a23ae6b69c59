"""What `autograder lint` finds by running a lab: its checks on the blank notebook, and on solutions with a mistake."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import toy

from autograder.authoring.lint.runs import run_findings
from autograder.core.results import Isolation
from autograder.course.lab import load_lab

PRINTED = """\
with launch("talker") as ros:
    ros.program("talker").expect_exit(within=60)
    ros.require("hello" in ros.program("talker").output(), "It says hello")
ros.score(3)"""


def found(folder: Path, check_talker: str) -> list[str]:
    """What is found in the toy lab with another check of its program."""
    root = toy.make_course(folder / "course")
    notebook = root / "solutions" / toy.LAB / f"{toy.LAB}.ipynb"
    raw = json.loads(notebook.read_text(encoding="utf-8"))
    cell = next(one for one in raw["cells"] if one["metadata"].get("nbgrader", {}).get("grade_id") == "check_talker")
    cell["source"] = check_talker
    notebook.write_text(json.dumps(raw), encoding="utf-8")
    return [str(one) for one in run_findings(load_lab(root, toy.LAB), Isolation.NONE, jobs=3)]


@pytest.mark.parametrize(
    ("check", "said"),
    [
        (PRINTED, []),
        (  # it ends well, whatever it says
            'with launch("talker") as ros:\n    ros.program("talker").expect_exit(within=60)\nros.score(3)',
            ["error: cell `check_talker`: none of 2 solutions with one mistake each loses points in it."],
        ),
        (  # it looks at a program of the lab's own
            'with launch("helper") as ros:\n    ros.program("helper").expect_exit(within=60)\nros.score(3)',
            [
                "error: cell `check_talker`: the notebook as students receive it gets 3 points.",
                "error: cell `check_talker`: none of 0 solutions with one mistake each loses points in it.",
            ],
        ),
    ],
    ids=["good", "no mistake costs points", "nothing is asked for"],
)
def test_a_check_that_is_no_good_is_named(tmp_path: Path, check: str, said: list[str]) -> None:
    assert found(tmp_path, check) == said
