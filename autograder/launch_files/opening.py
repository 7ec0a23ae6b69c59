"""Opens a launch file. Of what is none in YAML it says what it is: missing, XML, or Python and how YAML has it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.launch_files.errors import Place
from autograder.reasons import Refused

_IN_PYTHON = re.compile(
    r"^\s*(from\s+(launch|launch_ros)[\w.]*\s+import\b|import\s+launch|def\s+generate_launch_description\b)"
    r"|\bLaunchDescription\s*\(",
    re.MULTILINE,
)
_IN_YAML = {
    "Node": "`- node:` with `pkg`, `exec`, `name` and `namespace` below it",
    "LifecycleNode": "`- node:`",
    "DeclareLaunchArgument": "`- arg:` with `name` and `default`",
    "LaunchConfiguration": "`$(var NAME)`",
    "SetLaunchConfiguration": "`- let:` with `name` and `value`",
    "EnvironmentVariable": "`$(env NAME)`",
    "SetEnvironmentVariable": "`- set_env:` with `name` and `value`",
    "FindPackageShare": "`$(find-pkg-share PACKAGE)`",
    "get_package_share_directory": "`$(find-pkg-share PACKAGE)`",
    "IncludeLaunchDescription": "`- include:` with `file`, and `arg` for its arguments",
    "GroupAction": "`- group:` with a list below it",
    "PushRosNamespace": "`- push_ros_namespace:` with `namespace`",
    "SetParameter": "`- set_parameter:` with `name` and `value`",
    "SetRemap": "`- set_remap:` with `from` and `to`",
    "IfCondition": "the key `if`",
    "UnlessCondition": "the key `unless`",
    "PythonExpression": '`$(eval "…")`',
    "LogInfo": "`- log:` with `message`",
    "remappings": "`remap:` with entries `{from: OLD, to: NEW}`",
    "parameters": "`param:` with entries `{name: NAME, value: VALUE}`, or `{from: FILE}` for a file",
    "arguments": "`args:`",
}
"""The words of Python, and where the same stands in YAML."""


def content(path: Path, place: Place) -> Any:
    """What stands below `launch:` in a launch file.

    Raises:
        Refused: it is missing, or no launch file in YAML.
    """
    if not path.is_file():
        hint = "Its name is the one after `%%file` in the first line of its cell."
        if "share" in path.parts:
            hint = "It is started from where the package installs it: `data_files` in setup.py has to name it."
        raise place.error("there is no such file.", hint)
    try:
        found = student_yaml.read(path, written=True)
    except Refused as error:
        _refuse_python(path, place)
        because = (
            error.reason.because.removeprefix(f"`{path.name}`").lstrip(", ").removeprefix(error.place).lstrip(" :")
        )
        because = f"it {because}" if because.startswith("is ") else because
        hint = "Look at the indentation and the `-` there." if "not YAML" in because else ""
        raise Place(path.name, place.folder, error.place).error(because, hint) from None
    if not isinstance(found, dict) or list(found) != ["launch"]:
        _refuse_python(path, place)
        xml = "XML is not covered here; in YAML " if str(found).startswith("<") else ""
        because = f"{xml}a launch file has one key at the top, `launch:`, with a list below it."
        raise place.error(because, "Begin with `launch:` and `- node:`.")
    return found["launch"]


def _refuse_python(path: Path, place: Place) -> None:
    """Say that a file is a launch file in Python, if it is one.

    Raises:
        Refused: it is.
    """
    with path.open("rb") as file:
        text = file.read(student_yaml.FILE_BYTES).decode("utf-8", "replace")
    if not _IN_PYTHON.search(text):
        return
    used = [(word, yaml) for word, yaml in _IN_YAML.items() if re.search(rf"\b{word}\s*[(=]", text)]
    used = used or [("Node", _IN_YAML["Node"])]
    raise place.error(
        "it is a launch file in Python, and the launch files of this course are written in YAML.",
        "Begin with `launch:`, and write a list below it. "
        + " ".join(f"What is `{word}` in Python is {yaml} in YAML." for word, yaml in used),
    )
