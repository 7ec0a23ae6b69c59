"""What the substitutions of a launch file stand for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.graph.names import nearest
from autograder.launch_files import expressions
from autograder.launch_files.errors import TEXT_LENGTH, refused
from autograder.launch_files.files import Packages
from autograder.launch_files.texts import Call, Text, calls
from autograder.reasons import Refused

_VALUES = {
    "var": (1, 2), "env": (1, 2), "dirname": (0, 0), "find-pkg-share": (1, 1), "eval": (1, 2), "equals": (2, 2),
    "not-equals": (2, 2), "not": (1, 1), "and": (2, 2), "or": (2, 2), "if": (2, 3),
}  # fmt: skip
"""How many values each substitution takes."""
_NOT_COVERED = {
    "all", "anon", "any", "command", "exec-in-pkg", "file-content", "filename", "find-exec", "find-pkg-prefix",
    "launch_log_dir", "log_dir", "param",
}  # fmt: skip
_IN_ROS_2 = {
    "arg": "In ROS 2 it is `$(var NAME)`.",
    "optenv": "In ROS 2 it is `$(env NAME DEFAULT)`.",
    "find": "In ROS 2 it is `$(find-pkg-share PACKAGE)`.",
}
"""What ROS 1 had, and what it is now."""
_OF_THE_MACHINE = {
    "COLUMNS", "DISPLAY", "EDITOR", "HOME", "HOST", "HOSTNAME", "LANG", "LANGUAGE", "LINES", "LOGNAME", "MAIL",
    "OLDPWD", "PATH", "PWD", "SHELL", "SHLVL", "SUDO_USER", "TERM", "TMPDIR", "TZ", "USER", "USERNAME", "VIRTUAL_ENV",
}  # fmt: skip
_OF_THE_MACHINE_PREFIXES = (
    "AMENT_", "CMAKE_", "COLCON_", "CONDA_", "CYCLONEDDS_", "DBUS_", "FASTDDS_", "FASTRTPS_", "GZ_", "LC_", "LD_",
    "PYTHON", "RCL", "RMW_", "ROS_", "SSH_", "TURTLEBOT3_", "XDG_",
)  # fmt: skip
JAZZY = {"ROS_DISTRO": "jazzy", "ROS_VERSION": "2", "ROS_PYTHON_VERSION": "3"}
"""What every installed Jazzy has in its environment."""


@dataclass
class Context:
    """What a launch file knows while it runs; a group works on a copy."""

    packages: Packages
    configurations: dict[str, Any] = field(default_factory=dict)
    """Launch arguments and `let`s, and what a group keeps for its nodes under the names that `launch_ros` uses."""
    environment: dict[str, str | None] = field(default_factory=lambda: dict[str, str | None](JAZZY))
    """Variables that are known: None where the launch file unset one."""

    def scoped(self) -> Context:
        """A copy for a group. The lists in it are the same ones, as in `launch`."""
        return Context(self.packages, dict(self.configurations), dict(self.environment))


def check(text: Text) -> None:
    """Refuse substitutions that `launch` refuses when it reads a file, and those that are not covered here.

    Raises:
        Refused: for the first of them.
    """
    covered = ", ".join(f"`{name}`" for name in sorted(_VALUES))
    for call in calls(text):
        if call.name in _NOT_COVERED:
            raise refused(f"the substitution `{call.written}` is not covered here.", f"Covered are {covered}.")
        if call.name not in _VALUES:
            hint = _IN_ROS_2.get(call.name, f"Covered here are {covered}.")
            raise refused(f"there is no substitution `{call.name}`.", hint)
        least, most = _VALUES[call.name]
        if not least <= len(call.values) <= most:
            wanted = f"{least}" if least == most else f"{least} or {most}"
            raise refused(
                f"`{call.written}`: `{call.name}` takes {wanted} value{'s' if most != 1 else ''}, "
                f"and {len(call.values)} {'is' if len(call.values) == 1 else 'are'} given.",
                "A value with spaces stands in quotes.",
            )


def perform(text: Text, context: Context, folder: Path) -> str:
    """Do the substitutions of a text.

    Args:
        text: what `texts.parse` and `check` let pass.
        context: what is known at this moment.
        folder: of the launch file that the text stands in.

    Raises:
        Refused: one of them cannot be done, or the text grows too long.
    """
    done, length = [], 0
    for part in text:
        done.append(part if isinstance(part, str) else _value(part, context, folder))
        length += len(done[-1])
        if length > TEXT_LENGTH:
            raise refused(f"the text grows longer than {TEXT_LENGTH} characters.", "Does it repeat itself?")
    return "".join(done)


def _value(call: Call, context: Context, folder: Path) -> str:
    def said(number: int) -> str:
        return perform(call.values[number], context, folder)

    match call.name:
        case "var":
            name = said(0)
            if name not in context.configurations and len(call.values) == 2:
                return said(1)
            return _configuration(name, context)
        case "env":
            default = said(1) if len(call.values) == 2 else None
            return _variable(said(0), default, context)
        case "dirname":
            return str(folder)
        case "find-pkg-share":
            try:
                return context.packages.share(said(0))
            except KeyError:
                raise refused(f"there is no package `{said(0)}`.") from None
        case "eval":
            if len(call.values) == 2 and said(1).strip() != "math":
                raise refused(f"`{call.written}`: of Python's modules only `math` is covered here.")
            return expressions.evaluate(said(0))
        case "equals" | "not-equals":
            if () in call.values:
                raise refused(
                    f"`{call.written}`: an empty text `''` means something else there and is not covered here.",
                    "Write `$(eval \"'$(var NAME)' == ''\")`.",
                )
            return _word(_equal(said(0), said(1)) is (call.name == "equals"))
        case "not":
            return _word(not _truth(said(0), call))
        case "and" | "or":
            left, right = _truth(said(0), call), _truth(said(1), call)
            return _word(left and right if call.name == "and" else left or right)
    return said(1) if _truth(said(0), call) else (said(2) if len(call.values) == 3 else "")


def _configuration(name: str, context: Context) -> str:
    value = context.configurations.get(name)
    if value is None:
        near = nearest(name, [known for known, text in context.configurations.items() if isinstance(text, str)])
        raise refused(
            f"there is no launch argument `{name}` here." + (f" `{near}` is there; is that meant?" if near else ""),
            f"An argument is declared above with `- arg:` and `name: {name}`.",
        )
    if not isinstance(value, str):
        raise refused(f"`{name}` is a name that `launch_ros` uses itself; it is not covered here.")
    return value


def _variable(name: str, default: str | None, context: Context) -> str:
    if name not in context.environment and of_the_machine(name):
        raise refused(
            f"the environment variable `{name}` differs from machine to machine; it is not covered here.",
            "Use a variable that the launch file sets with `set_env`, or a launch argument.",
        )
    value = context.environment.get(name)
    if value is None and default is None:
        raise refused(
            f"the environment variable `{name}` is not set.",
            f"Give it a default: `$(env {name} VALUE)`.",
        )
    return value if value is not None else str(default)


def of_the_machine(name: str) -> bool:
    """Whether an environment variable is usually set, to a value that a launch file cannot know."""
    return name in _OF_THE_MACHINE or name.startswith(_OF_THE_MACHINE_PREFIXES)


def _truth(text: str, call: Call) -> bool:
    try:
        value = student_yaml.load(text, "the value")
    except Refused:
        value = None
    if not isinstance(value, bool):
        raise refused(f"`{call.written}` wants `true` or `false`, not `{text[:60]}`.")
    return value


def _word(value: bool) -> str:
    return str(value).lower()


def _equal(left: str, right: str) -> bool:
    truths = ("true", "1", "false", "0")
    if left.lower() in truths and right.lower() in truths:
        return (left.lower() in truths[:2]) == (right.lower() in truths[:2])
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right
