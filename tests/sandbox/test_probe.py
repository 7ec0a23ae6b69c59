"""The probe and the rclpy that it watches: the names that it relies on, and what it writes."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from rcl_interfaces.msg import Parameter, ParameterEvent, ParameterValue

from autograder.cli import doctor
from autograder.sandbox.inside.probe import events, watch_messages

# In a process of its own: to ask is to wrap.
ATTACH = """
import json, sys
import rclpy, rclpy.action.client, rclpy.action.server, rclpy.executors, rclpy.lifecycle, rclpy.node
{change}
from autograder.sandbox.inside.probe import attach
print(json.dumps(attach.prepare()))
"""


def missed(change: str) -> list[str]:
    """What the probe says that it cannot watch, after something was changed in rclpy."""
    done = subprocess.run(
        [sys.executable, "-c", ATTACH.format(change=change)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    found: list[str] = json.loads(done.stdout)
    return found


def test_the_installed_rclpy_has_all_that_the_probe_relies_on() -> None:
    found = missed("")
    mend = "Mend autograder/sandbox/inside/probe/rclpy_names.py, or lock the older rclpy."
    assert found == [], "\n".join([*found, mend])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("del rclpy.executors.Executor._take_timer", "Executor._take_timer"),
        ("rclpy.executors.Executor._take_client = lambda self: None", "Executor._take_client"),
        ("del rclpy.action.server.await_or_execute", "rclpy.action.server.await_or_execute"),
        ("rclpy.executors.Executor.__init__ = lambda self, **_: None", "Executor._nodes"),
        ("del rclpy.node.Node._set_parameters_atomically", "Node._set_parameters_atomically"),
        ("del rclpy.lifecycle.LifecycleNodeMixin._LifecycleNodeMixin__register_callback", "__register_callback"),
        ("del rclpy.node.Node.create_timer", "create_timer"),
    ],
)
def test_a_name_that_an_update_of_rclpy_moves_is_named_in_a_sentence(change: str, said: str) -> None:
    assert any(said in sentence and sentence.endswith(".") for sentence in missed(change))


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (ParameterEvent(new_parameters=[Parameter()]), ""),
        (ParameterEvent(new_parameters=[Parameter(name=5)]), "new_parameters"),
        (ParameterEvent(new_parameters=[ParameterValue()]), "new_parameters"),
        (ParameterEvent(node=5), "node"),
        (Parameter(name="rate", value=ParameterValue(integer_value=2.5)), "value.integer_value"),
        (Parameter(value=Parameter()), "value"),
    ],
)
def test_what_cannot_be_sent_is_a_misfit_only_if_a_field_is(
    message: object, field: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # `publish` also raises when the node is just going down: then no field is to be blamed.
    written: list[events.BadMessage] = []
    monkeypatch.setattr(watch_messages, "emit_once", written.append)
    watch_messages.note_misfit("message", "/events", message, type(message))
    assert [event.field for event in written] == ([field] if field else [])


def test_the_doctor_says_when_the_probe_cannot_attach(monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor.probe().good
    moved = "import rclpy.executors; del rclpy.executors.Executor._take_timer; "
    monkeypatch.setattr(doctor, "TRY_PROBE", moved + doctor.TRY_PROBE)
    found = doctor.probe()
    assert not found.good
    assert "Executor._take_timer" in found.found and "locked rclpy" in found.do
