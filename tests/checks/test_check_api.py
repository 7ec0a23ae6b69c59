"""What a lab author sees on `ros` and its nouns, and that the labs' cells use nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from places import ROOT

from autograder.authoring.lint.static import check_findings
from autograder.checks.launch import Launch
from autograder.checks.nouns import NOUNS
from autograder.course.lab import load_lab

LABS = sorted((ROOT / "solutions").glob("*/*.ipynb"))

OFFERED = {
    "ros": """
        action activity car changes clock draw expect_argument_needed graph lifecycle log node own_run part pause
        program programs publisher qos rank require require_equal runs score server service show start stop topic wait
    """,
    "topic": """
        account expect_last expect_messages expect_publisher expect_silence expect_subscription expect_unused listen
    """,
    "publisher": "open publish stream",
    "qos": "expect expect_match",
    "node": "expect expect_log expect_parameter expect_parameter_refused parameters set_parameter",
    "lifecycle": "available_transitions expect_state expect_transitions state transition",
    "service": "call call_many expect kept_waiting",
    "server": "answer_after expect_messages_during requests served",
    "action": "expect_one_at_a_time send_goal",
    "goal": """
        accepted changes feedback heard result status
        cancel expect_canceled expect_feedback expect_messages_during expect_result messages_during wait_for_feedback
        wait_for_result
    """,
    "activity": """
        expect_messages_during expect_no_overlap expect_overlap expect_period expect_runs messages_during seen
    """,
    "program": """
        events exit_status expect_clean_end expect_exit expect_running expect_started output restart running seen_runs
        signal stop
    """,
    "graph": "nodes publishers subscriptions topics wait",
    "car": "expect_driven expect_no_touch expect_reached expect_stopped_within place pose touches trail",
    "draw": "arrivals film graph lifecycle qos timeline world",
}


@pytest.mark.parametrize("name", NOUNS)
def test_only_what_a_check_may_use_is_shown(name: str) -> None:
    assert {one for one in dir(NOUNS[name]) if not one.startswith("_")} == set(OFFERED[name].split())


def test_a_launch_shows_no_field_of_its_own() -> None:
    assert not [name for name in vars(Launch([], [], [], [])) if not name.startswith("_")]


@pytest.mark.parametrize("lab", LABS, ids=lambda lab: lab.stem)
def test_every_check_cell_calls_what_there_is_with_arguments_that_it_has(lab: Path) -> None:
    assert [str(finding) for finding in check_findings(load_lab(ROOT, lab.stem))] == []


def test_every_name_is_used_by_a_lab_or_a_lecture() -> None:
    cells = [
        "".join(cell["source"])
        for lab in LABS
        for cell in json.loads(lab.read_text(encoding="utf-8"))["cells"]
        if cell["cell_type"] == "code"
    ]
    text = "\n".join([*cells, *(page.read_text(encoding="utf-8") for page in (ROOT / "lectures").rglob("*.md"))])
    unused = [f"{noun}.{name}" for noun, names in OFFERED.items() for name in names.split() if f".{name}" not in text]
    assert unused == [], "use each of them in a lab of solutions/, or in a page of lectures/"
