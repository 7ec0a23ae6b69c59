"""The programs that a launch file starts, and the command lines that `ros2 launch` gives to them."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict

WRITTEN = ".launch_params_*.yaml"
"""The pattern of the names of parameter files that a launch writes into the folder of its launch file."""
_ON_A_COMMAND_LINE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


class Inline(BaseModel):
    """A parameter whose value is in the launch file itself."""

    model_config = ConfigDict(extra="forbid")
    name: str
    value: Any


class ForAll(BaseModel):
    """A parameter of `set_parameter`. Its value is written on the command line as a text, and parsed again there."""

    model_config = ConfigDict(extra="forbid")
    name: str
    text: str


class ParamsFile(BaseModel):
    """A parameter file that a launch file names (`from:`)."""

    model_config = ConfigDict(extra="forbid")
    file: str
    """Its name in the folder of the launch file, or its path if it is in a package that was built."""


class ParamsText(BaseModel):
    """The text of a parameter file after its substitutions (`allow_substs: true`)."""

    model_config = ConfigDict(extra="forbid")
    text: str


class NodeAction(BaseModel):
    """One program that a launch file starts, after all substitutions."""

    model_config = ConfigDict(extra="forbid")
    package: str
    program: str
    """The name of the executable, `exec:`."""
    namespace: str = ""
    """The absolute namespace; empty if neither the node nor a group sets one."""
    name: str = ""
    """The name of the node; empty if the launch file does not set it."""
    remappings: list[tuple[str, str]] = []
    parameters: list[Inline | ForAll | ParamsFile | ParamsText] = []
    """The parameters in the order in which they are given."""
    arguments: list[str] = []
    """The words of `args`, which are the program's own arguments."""
    ros_words: list[str] = []
    """The words of `ros_args`, which come before the other ROS arguments."""
    environment: dict[str, str] = {}
    """The variables that the launch file sets."""
    warnings: list[str] = []
    """The faults about which `ros2 launch` only warns, which are parameter files that do not exist."""
    folder: Path = Path()
    """The folder of its parameter files."""

    def rules(self) -> list[str]:
        """Return the remap rules of the launch file, without those of `ros_args`, in the order in which they are given.

        The rules for the node's name and namespace come first.
        """
        rules = [f"__node:={self.name}"] if self.name else []
        if self.namespace:
            rules.append(f"__ns:={self.namespace}")
        return rules + [f"{old}:={new}" for old, new in self.remappings]

    def ros_arguments(self) -> list[str]:
        """Return the words that follow `--ros-args`, in the order of `ros2 launch`.

        If there is a parameter file among them, the parameters of the launch file itself are written to files, too, as
        `ros2 launch` does. Then the keys of the files decide which value wins. The files have names like `WRITTEN`.
        """
        own = len(self.rules()) - len(self.remappings)
        words = [word for rule in self.rules()[:own] for word in ("-r", rule)]
        for parameter in self.parameters:
            words += self._words(parameter)
        words += [word for rule in self.rules()[own:] for word in ("-r", rule)]
        return [*self.ros_words, *(["--ros-args"] if words and self.ros_words else []), *words]

    def _words(self, parameter: Inline | ForAll | ParamsFile | ParamsText) -> list[str]:
        match parameter:
            case ForAll():
                return ["-p", f"{parameter.name}:={parameter.text}"]
            case ParamsFile():
                return ["--params-file", parameter.file]
            case ParamsText():
                return ["--params-file", self._written(parameter.text)]
        if self._only_inline() and _ON_A_COMMAND_LINE.fullmatch(parameter.name):
            return ["-p", f"{parameter.name}:={_on_a_command_line(parameter.value)}"]
        key = f"{self.namespace.rstrip('/')}/{self.name}" if self._named() else "/**"
        content = {key: {"ros__parameters": {parameter.name: parameter.value}}}
        return ["--params-file", self._written(yaml.safe_dump(content, default_flow_style=False))]

    def _named(self) -> bool:
        """Whether the launch file gives the node a full name, so that its parameters are for this name only."""
        return bool(self.namespace and self.name)

    def _only_inline(self) -> bool:
        files = any(isinstance(parameter, (ParamsFile, ParamsText)) for parameter in self.parameters)
        words = (*self.ros_words, *self.arguments)
        renamed = self._named() and any("__n" in word for word in words)  # `__node:=` or `__ns:=` before its own rules
        return not files and not renamed and "--params-file" not in words

    def _written(self, text: str) -> str:
        name = WRITTEN.replace("*", hashlib.sha256(text.encode()).hexdigest()[:16])
        (self.folder / name).write_text(text, encoding="utf-8")
        return name


def remove_written(folder: Path) -> None:
    """Remove the parameter files that `NodeAction.ros_arguments` wrote into a folder."""
    for path in folder.glob(WRITTEN):
        path.unlink(missing_ok=True)


def _on_a_command_line(value: Any) -> str:
    """Return a value in one word, as `launch_ros` writes it with `yaml.dump`.

    As in `launch_ros`, a text may become a number by this.
    """
    text = yaml.safe_dump(value, default_flow_style=True, width=1_000_000)
    return text.removesuffix("\n...\n").removesuffix("\n")
