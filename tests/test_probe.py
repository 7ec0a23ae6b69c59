"""The probe and the rclpy that it watches: names that it relies on, and the forms in which it writes."""

from __future__ import annotations

import json
import subprocess
import sys
import typing
from typing import Any

import pytest
from rcl_interfaces.msg import Parameter, ParameterEvent, ParameterValue

from autograder.cli import doctor
from autograder.diagnosis import events
from autograder.sandbox.inside.probe import forms, watch_messages

READ_ELSEWHERE = {"memory_error"}
"""An event that the keeper of the program reads, and no diagnosis."""

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
    written: list[forms.BadMessage] = []
    monkeypatch.setattr(watch_messages, "emit_once", written.append)
    watch_messages.note_misfit("message", "/events", message, type(message))
    assert [event["field"] for event in written] == ([field] if field else [])


def test_the_doctor_says_when_the_probe_cannot_attach(monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor.probe().good
    moved = "import rclpy.executors; del rclpy.executors.Executor._take_timer; "
    monkeypatch.setattr(doctor, "TRY_PROBE", moved + doctor.TRY_PROBE)
    found = doctor.probe()
    assert not found.good
    assert "Executor._take_timer" in found.found and "locked rclpy" in found.do


def fields_written(form: Any) -> dict[str, dict[str, Any]]:
    """Event name -> field -> type, of a union of forms."""
    found = {}
    for one in typing.get_args(form):
        fields = typing.get_type_hints(one)
        (name,) = typing.get_args(fields.pop("e"))
        found[name] = fields
    return found


def fields_read(union: Any) -> dict[str, dict[str, Any]]:
    """The same of the classes of the diagnosis."""
    found = {}
    for one in typing.get_args(union):
        fields = {name: field.annotation for name, field in one.model_fields.items()}
        (name,) = typing.get_args(fields.pop("e"))
        found[name] = fields
    return found


def test_the_probe_writes_the_events_and_fields_that_the_diagnosis_reads() -> None:
    written = {**fields_written(forms.Event), **fields_written(forms.Record)}
    read = fields_read(events.Event)
    assert written.keys() - READ_ELSEWHERE == read.keys()
    for name, fields in read.items():
        awaits = written[name].pop("awaits", None), fields.pop("awaits", None)
        assert written[name] == fields, name
        if awaits != (None, None):
            inner = {key: field.annotation for key, field in events.Awaits.model_fields.items()}
            assert typing.get_type_hints(forms.Awaits) == inner
