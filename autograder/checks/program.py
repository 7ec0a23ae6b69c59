"""A program of the student's and what it is started with, named as in a launch description."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from autograder.arguments import params_file, remap_rules
from autograder.arguments.params_file import PARAMS_FILE
from autograder.checks import current
from autograder.checks.command_line import CommandLine
from autograder.checks.misuse import Misuse, refuse_no_rules, refuse_text
from autograder.checks.waiting import NotLaunchedError
from autograder.diagnosis.programs import PROGRAM_MISSING
from autograder.packages.workspace import INSTALLED
from autograder.reasons import Reason, Refused


@dataclass(frozen=True)
class Program:
    """One program of the student's and the ROS arguments it is started with, named as in a launch description."""

    program: str
    package: str = ""
    """The package of the student's that it is an executable of; empty for a program of a cell."""
    namespace: str = ""
    name: str = ""
    remappings: Sequence[tuple[str, str]] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    params_file: str = ""
    """A parameter file of the student's; it comes before `parameters`, which win."""
    ros_arguments: Sequence[str] | CommandLine = ()
    """Further words after `--ros-args`, as typed on a command line."""
    arguments_of_its_own: Sequence[str] = ()
    """Words before `--ros-args`."""
    cores: int = 2
    """CPUs that the program may use: the same number on every machine that has them."""
    assume_success: bool = False
    """Whether a lifecycle callback that forgets to return a TransitionCallbackReturn succeeds all the same. This is for
    checks of what a node does in its states, because another check holds that the callbacks return something."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables beside those that every program has. `ROS_DOMAIN_ID` puts it into another domain than the launch's."""
    warnings: Sequence[str] = ()
    """What a launch file names and does not have; the program starts without it."""

    def __post_init__(self) -> None:
        """Refuse what would become another command line than is meant."""
        if not isinstance(self.program, str):
            raise Misuse(f"Program: {self.program!r} is no name of a program; write each name as a text of its own.")
        refuse_no_rules("Program", self.remappings)
        refuse_text(
            "Program",
            ros_arguments=self.ros_arguments,
            arguments_of_its_own=self.arguments_of_its_own,
        )

    def arguments(self) -> list[str]:
        """The program's command line."""
        words: list[str] = []
        for rule in self.rules():
            words += ["-r", rule]
        if self.params_file:
            words += ["--params-file", self.params_file]
        for name, value in self.parameters.items():
            # As JSON, rcl reads each value as what it is. What `yaml.dump` writes, which `ros2 launch` uses and
            # launch_files/nodes.py therefore too, it does not: to it a bare `1e5` or `y` is no text.
            words += ["-p", f"{name}:={json.dumps(value, ensure_ascii=False)}"]
        words += self._typed()
        return [*self.arguments_of_its_own, *(["--ros-args", *words] if words else [])]

    def _typed(self) -> Sequence[str]:
        typed = self.ros_arguments
        return typed.words() if isinstance(typed, CommandLine) else typed

    def all_rules(self) -> list[str]:
        """The remap rules, those that were typed included."""
        return self.rules() + remap_rules.rules_in([*self.arguments_of_its_own, *self._typed()])

    def node_name(self) -> str:
        """The name that the launch gives to the program's node; empty where it leaves that to the program."""
        names = [rule.removeprefix("__node:=") for rule in self.all_rules() if rule.startswith("__node:=")]
        return next(iter(names), "")

    def parameter_rules(self) -> list[str]:
        """The parameter rules that were typed, `name:=value`."""
        return remap_rules.parameter_rules_in(self._typed())

    def may_vary_names(self) -> bool:
        """Whether it is given what may rightly decide about the names in its code."""
        return bool(self.parameters or self.params_file or self.arguments_of_its_own)

    def rules(self) -> list[str]:
        """The remap rules in the order in which they are given: the first that matches wins."""
        rules = [f"{old}:={new}" for old, new in self.remappings]
        if self.namespace:
            rules.append(f"__ns:={self.namespace}")
        if self.name:
            rules.append(f"__node:={self.name}")
        return rules


def file_of(node: Program) -> str:
    """Where a program's file is, below the folder of the programs."""
    if node.package:
        return f"{INSTALLED}/{node.package}/lib/{node.package}/{node.program}"
    return f"{node.program}.py"


def words_of(node: Program) -> list[str] | Reason:
    """The words that a program is started with, or why it would not start with them."""
    try:
        words = node.arguments()
    except Refused as error:
        return error.reason
    return refused_words(words) or words


def refused_words(words: Sequence[str]) -> Reason | None:
    """Why a program would not start with these words; None if it would."""
    refused = remap_rules.refused_parameter(words)
    if refused:
        return refused
    unreadable = params_file.unreadable(words, current.check.folder)
    if unreadable is not None:
        hint = "Look at the indentation there, and at brackets and quotation marks."
        return PARAMS_FILE(unreadable.reason.because, hint)
    return None


def why_missing(program: str) -> Reason:
    """Why no cell has written a program."""
    here = current.check.front_end
    because, hint = here.why_missing("node", program) if here is not None else (f"There is no `{program}`.", "")
    return PROGRAM_MISSING(because, hint)


def refuse_to_start(programs: Sequence[Program]) -> None:
    """Look for what would keep a launch from beginning, before what runs now is ended for it.

    Raises:
        NotLaunchedError: there is something.
    """
    for node in programs:
        if not node.package and not current.check.has(file_of(node)):
            raise NotLaunchedError(why_missing(node.program))
        words = words_of(node)
        if isinstance(words, Reason):
            raise NotLaunchedError(words)
