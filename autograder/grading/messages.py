"""Run checks of a submission again to record the messages that they receive, and write them as an MCAP file.

MCAP is the format in which ROS 2 records messages. `ros2 bag`, Foxglove, PlotJuggler and Lichtblick can read it.
"""

from __future__ import annotations

import base64
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from autograder.core.errors import KitError
from autograder.core.results import CheckResult, Picture
from autograder.course.lab import Lab
from autograder.grading.builds import with_interfaces
from autograder.grading.runner import Settings, job_of
from autograder.grading.supervisor import limit
from autograder.graph.recording import BagMessage
from autograder.pictures.arrivals import Traffic, arrivals
from autograder.ros2.interfaces import source_of
from autograder.sandbox.grading_sandbox import run_in_sandbox
from autograder.submission.reader import read_submission

_MOST_ROWS = 12
"""The number of topics in a picture."""


def received(
    notebook: Path, student: str, lab: Lab, settings: Settings, wanted: Sequence[str]
) -> tuple[list[CheckResult], list[BagMessage]]:
    """Run some checks of a submission in the sandbox, and return their results and the messages that they received.

    Args:
        notebook: the submitted notebook.
        student: the student who handed it in.
        lab: the lab to which it belongs.
        settings: how it is run. With the seed of an earlier result, the same random values are used.
        wanted: the grade_ids of the checks.
    """
    job = job_of(read_submission(notebook, lab), student, lab, settings)
    cells = [cell for cell in job.cells if cell.points is None or cell.grade_id in wanted]
    job = with_interfaces(job.model_copy(update={"cells": cells, "messages": True}), 1)
    seconds = limit(len(wanted)) + job.build_seconds
    run = run_in_sandbox(["autograder.grading.worker"], job.model_dump_json().encode("utf-8"), job.isolation, seconds)
    checks, messages = [], []
    for line in run.stdout.splitlines():
        try:
            if line.startswith(b'{"grade_id"'):
                messages.append(BagMessage.model_validate_json(line))
            else:
                checks.append(CheckResult.model_validate_json(line))
        except ValidationError:
            break  # if the worker died, its last line may be incomplete
    return checks, messages


def timeline_of(title: str, messages: Sequence[BagMessage]) -> Picture:
    """Return a picture of when messages were published: a row for each topic, in the order of their first messages."""
    times: dict[str, list[float]] = {}
    for message in sorted(messages, key=lambda one: one.stamp):
        times.setdefault(message.topic, []).append(message.stamp / 1e9)
    return arrivals(title, [Traffic(topic, times[topic]) for topic in list(times)[:_MOST_ROWS]])


def write_mcap(messages: Sequence[BagMessage], folder: Path) -> list[str]:
    """Write messages as a ROS 2 bag, which is a folder with an MCAP file. An existing folder is replaced.

    Returns:
        The types whose messages are left out, because their definitions are not known.

    Raises:
        KitError: the library that writes MCAP files is not installed.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise KitError("Writing MCAP files needs the package rosbags.", "pip install rosbags") from error
    types = get_typestore(Stores.ROS2_JAZZY)
    left_out = sorted(name for name in {message.type for message in messages} if not _defined(types, name))
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics: dict[tuple[str, str], Any] = {}
        for message in sorted(messages, key=lambda one: one.stamp):
            key = message.topic, message.type
            if message.type in left_out:
                continue
            if key not in topics:
                topics[key] = writer.add_connection(*key, typestore=types)
            writer.write(topics[key], message.stamp, base64.b64decode(message.data))
    return left_out


def _defined(types: Any, name: str) -> bool:
    """Return whether the library knows a type with all of its parts; if it does not, read the file that defines it."""
    from rosbags.typesys import get_types_from_msg

    if name in types.fielddefs:
        return True
    try:
        text = source_of(name)
        found = get_types_from_msg(text, name)
    except Exception:  # no such file, or one that the library does not understand
        return False
    parts = {
        part
        for _, fields in found.values()
        for _, (_, described) in fields
        for part in _names(described)
        if part != name
    }
    if all(_defined(types, part) for part in sorted(parts)):
        types.register(found)
        return True
    return False


def _names(described: Any) -> list[str]:
    """Return the message types in the library's description of a field."""
    if isinstance(described, str):
        return [described] if "/" in described else []
    return [name for part in described for name in _names(part)] if isinstance(described, tuple) else []
