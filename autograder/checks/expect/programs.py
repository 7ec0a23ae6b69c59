"""Expectations of the programs themselves: alive, ended, what they log."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any

from rcl_interfaces.msg import Log
from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN, Expectations
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program
from autograder.graph.publishing import ClockDriver
from autograder.graph.recording import Recording
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.running_program import RunningProgram

ARGUMENT_NOT_NEEDED = Kind(
    "argument-not-needed", "a launch file runs without an argument that it should demand", Group.FILES
)
NO_LOG = Kind("no-log", "no such line was logged, or not that often", Group.OUTPUT)

_LOGGER = re.compile(r"\[\w+\] \[[\d.]+\] \[([^\]]*)\]: ")
"""What a line of a program's output begins with that a logger has written; the group is the logger's name."""
_LEVELS = {"DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
"""Numbers of rcl_interfaces/msg/Log."""


class ProgramExpectations(Expectations, ABC):
    """What the programs do as processes."""

    def program(self, name: str) -> RunningProgram:
        """The last started program of this name; a missing one is a failed outcome.

        Args:
            name: of the program, or of its node as the launch names it: that tells several runs of one program apart.

        Example:
            `printed = ros.program("talker").output()`

        Codes:
            `program-missing`, `nothing-started`.
        """
        for node, program in reversed(self._running.programs):
            if name in (node.program, node.node_name()):
                return program
        self._fail(f"The program `{name}` is there", diagnosis.program_trouble(self._scene()))

    @abstractmethod
    def _end(self) -> None:
        """End the launch."""

    @abstractmethod
    def _start(self, node: Program | str) -> None:
        """Start one more program."""

    def stop(self, name: str = "", *, kill: bool = False) -> None:
        """End one of several programs: politely (SIGTERM), or without a chance to clean up.

        Args:
            name: of the program, or of its node as the launch names it; without one, a launch that `start` began ends.
            kill: end it without a chance to clean up.

        Example:
            `ros.stop("talker")`

        Codes:
            those of `program`.
        """
        if not name:
            self._end()
            return
        program = self.program(name)
        self._running.may_end.append(program)
        self._running.stopped.append(program)
        program.stop(grace=0.0 if kill else 2.0)

    def restart(self, name: str) -> None:
        """Start a program of the launch once more, with the words that it was started with before.

        One that was killed is still on the graph for a while: its topics have one publisher more than there is.

        Args:
            name: of the program, or of its node as the launch names it. It has ended, or `stop` has ended it.

        Example:
            `ros.restart("planner")`

        Codes:
            those of `program`.
        """
        wanted = self.program(name)
        if wanted.running():
            raise Misuse(f"restart: `{name}` still runs; end it with ros.stop({name!r}) before.")
        self._start(next(launched for launched, program in self._running.programs if program is wanted))

    def expect_running(self, name: str, *, hint: str = "") -> None:
        """A program has not ended.

        Args:
            name: of the program.
            hint: a pointer for the student.

        Example:
            `ros.expect_running("talker")`

        Codes:
            `crashed`, `exited` and other reasons why a program ends.
        """
        self._expect_that(
            self.program(name).running(),
            f"`{name}` is still running",
            lambda: diagnosis.program_trouble(self._scene()),
            hint=hint,
        )

    def expect_argument_needed(self, name: str, *, hint: str = "") -> None:
        """The launch file cannot be run, because a launch argument has no default and was not given.

        Args:
            name: of the launch argument.
            hint: a pointer for the student.

        Example:
            `ros.expect_argument_needed("vehicle")`

        Codes:
            `argument-not-needed`, and those of launch files.
        """
        title = f"Without `{name}` the launch file is refused"
        told = self._running.trouble[0].because if self._running.trouble else ""
        if f"the launch argument `{name}` has no value" in told:
            outcomes.passed(title)
            return
        number = len(self._running.described)
        started = f"It starts {number} program{'' if number == 1 else 's'} without it."
        reason = self._running.trouble[0] if self._running.trouble else ARGUMENT_NOT_NEEDED(started)
        self._fail(title, reason, expected=f"the launch argument `{name}` is wanted", hint=hint)

    def expect_log(
        self,
        text: str,
        *,
        level: str = "",
        node: str = "",
        count: int | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """A message that matches the regular expression `text` reaches /rosout.

        Args:
            text: regular expression.
            level: DEBUG, INFO, WARN, ERROR or FATAL, exactly.
            node: logger name, as rosout gives it: dots for slashes, no leading one.
            count: exactly so many; by default at least one.
            within: seconds until they must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_log("too hot", level="WARN", node="oven")`

        Codes:
            `no-log`, and errors in callbacks.
        """
        if level and level not in _LEVELS:
            raise Misuse(f"expect_log: level={level!r} is none of {', '.join(_LEVELS)}.")
        rosout = self._rosout

        def matching() -> list[Any]:
            return [
                r.msg
                for r in rosout.messages
                if re.search(text, r.msg.msg)
                and (not level or r.msg.level == _LEVELS[level])
                and (not node or r.msg.name == node)
            ]

        found = self.wait(lambda: len(matching()) >= (count or 1), within)
        if found and count is not None:
            self._observer.wait(lambda: len(matching()) > count, 0.3)
            found = len(matching()) == count
        self._expect_that(
            found,
            f"A log message{f' of level {level}' if level else ''} {f'says {text!r}' if text else 'comes'}",
            lambda: self._why_not_logged(len(matching()), text, level, node),
            expected=text,
            observed="; ".join(r.msg.msg for r in rosout.messages[-3:]),
            hint=hint,
        )

    @cached_property
    def _rosout(self) -> Recording:
        # It is transient local: who asks for that hears the last ten seconds too.
        profile = QoSProfile(depth=1000, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        return self._observer.record("/rosout", Log, profile)

    def _why_not_logged(self, times: int, text: str, level: str, node: str) -> Reason:
        instead = "" if times else self._said_instead(text, level, node)
        scene = self._scene()
        found = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
        if not found and node and not times and not instead:
            found = diagnosis.nothing_due(scene, "/" + node.replace(".", "/"))
        often = {0: instead or "No such message was logged.", 1: "It was logged once."}
        return found or NO_LOG(often.get(times, f"It was logged {times} times."))

    def _said_instead(self, text: str, level: str, node: str) -> str:
        """The same words at another level, by another node or only printed, where a message did not come."""
        said = [r.msg for r in self._rosout.messages if re.search(text, r.msg.msg)]
        own = [message for message in said if not node or message.name == node]
        if level and own and own[-1].level != _LEVELS[level]:
            has = next((name for name, number in _LEVELS.items() if number == own[-1].level), str(own[-1].level))
            return f"`{own[-1].msg[:80]}` was logged at level {has}, not at {level}."
        if said and text and not own:
            return f"`{said[-1].msg[:80]}` was logged by `{said[-1].name}`, not by `{node}`."
        lines = (line.strip() for _, program in self._running.programs for line in program.output().splitlines())
        printed = [line for line in lines if text and re.search(text, line)]
        for line in printed:
            if "] [" not in line:
                return f"`{line[:80]}` was printed, not logged. Use `self.get_logger()` to log it."
            logger = _LOGGER.match(line)
            if node and logger and logger[1] != node:
                return (
                    f"`{line[logger.end() :][:80]}` was logged by a logger called `{logger[1]}`. The node's own logger "
                    f"is called `{node}`, with its namespace, and `self.get_logger()` returns it."
                )
        return ""

    @cached_property
    def clock(self) -> ClockDriver:
        """Simulated time of this launch (`use_sim_time=True`).

        Example:
            `ros.clock.advance(1.0, lambda: heard.count > 0)`
        """
        return ClockDriver(self._observer)
