"""What a lab author sees on `ros`, and that the labs' check cells use nothing else."""

from __future__ import annotations

import ast
import inspect
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from autograder.checks.launch import Launch

LABS = sorted((Path(__file__).parent.parent / "solutions").glob("*/*.ipynb"))

EXPECTATIONS = """
    expect_argument_needed expect_canceled expect_clean_end expect_exit expect_feedback expect_log expect_match
    expect_messages expect_messages_during expect_no_node expect_no_overlap expect_no_publisher expect_no_subscription
    expect_no_topic expect_node expect_one_at_a_time expect_overlap expect_parameter expect_parameter_refused
    expect_period expect_publisher expect_qos expect_result expect_running expect_runs expect_service expect_silence
    expect_state expect_subscription expect_topic expect_transitions require require_equal
"""
WAITING = "wait wait_for_graph pause"
SENDING = """
    call call_many clock open_publisher publish restart send_goal serve set_parameter start stop stream transition
"""
LOOKING = """
    account available_transitions changes concurrency descriptions get_parameters kept_waiting list_parameters
    listen log messages_during nodes program programs publishers requests seen_runs served
    state subscriptions topics watch_transitions
"""
PICTURES = "arrivals graph lifecycle qos runs timeline"
SCORING = "part score"


def test_only_what_a_check_may_use_is_shown() -> None:
    shown = {name for name in dir(Launch) if not name.startswith("_")}
    assert shown == set(f"{EXPECTATIONS} {WAITING} {SENDING} {LOOKING} {PICTURES} {SCORING}".split())
    assert not [name for name in vars(Launch([], [], [], [])) if not name.startswith("_")]


def calls(lab: Path) -> Iterator[tuple[str, ast.Call]]:
    """The calls of methods of `ros` in a lab's cells, each with its place."""
    for cell in json.loads(lab.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] != "code" or "ros." not in source or source.startswith("%%"):
            continue
        for node in ast.walk(ast.parse("\n".join("" if line[:1] in "%!" else line for line in source.split("\n")))):
            of_ros = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            if of_ros and isinstance(node.func.value, ast.Name) and node.func.value.id == "ros":
                yield f"{lab.stem}, {cell['id']}, line {node.lineno}", node


@pytest.mark.parametrize("lab", LABS, ids=lambda lab: lab.stem)
def test_every_check_cell_calls_what_there_is_with_arguments_that_it_has(lab: Path) -> None:
    wrong = []
    for place, call in calls(lab):
        assert isinstance(call.func, ast.Attribute)
        method = getattr(Launch, call.func.attr, None)
        if method is None or call.func.attr.startswith("_"):
            wrong.append(f"{place}: ros.{call.func.attr}")
            continue
        named = {keyword.arg for keyword in call.keywords if keyword.arg}
        parameters = inspect.signature(method).parameters.values()
        if not any(one.kind is one.VAR_KEYWORD for one in parameters):
            wrong += [f"{place}: {one}=" for one in named - {one.name for one in parameters}]
    assert not wrong
