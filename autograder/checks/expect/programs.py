"""Expectations of the programs themselves: alive, ended, what they log; and facts a check states in its own words."""

from __future__ import annotations

import re
from typing import Any

from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.graph import GraphExpectations
from autograder.diagnosis import Diagnosis
from autograder.graph.clock import ClockDriver
from autograder.sandbox.nodes import Program

_LEVELS = {"DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
"""Numbers of rcl_interfaces/msg/Log."""


class ProgramExpectations(GraphExpectations):
    """What the programs do as processes."""

    def prepare(self) -> None:
        """Set up the clock."""
        super().prepare()
        self._clock: ClockDriver | None = None

    def program(self, name: str) -> Program:
        """The last started program of this name; a missing one is a failed outcome."""
        for node, program in reversed(self.programs):
            if node.program == name:
                return program
        self.fail(f"The program `{name}` is there", diagnosis.program_trouble(self.scene()))

    def stop(self, name: str, *, kill: bool = False) -> None:
        """End one of several programs: politely (SIGTERM), or without a chance to clean up."""
        program = self.program(name)
        self.may_end.append(program)
        self.stopped.append(program)
        program.stop(grace=0.0 if kill else 2.0)

    def expect_running(self, name: str, *, hint: str = "") -> None:
        """A program has not ended."""
        self.expect_that(
            self.program(name).running(),
            f"`{name}` is still running",
            lambda: diagnosis.program_trouble(self.scene()),
            hint=hint,
        )

    def expect_exit(self, name: str, *, status: int | None = None, within: float = WITHIN, hint: str = "") -> None:
        """A program ends by itself, with this exit status if one is given."""
        program = self.program(name)
        self.may_end.append(program)
        title = f"`{name}` ends by itself" + ("" if status is None else f" with exit status {status}")
        if not self.wait(lambda: not program.running(), within):
            scene = self.scene()
            places = [inside.main_place() for inside in scene.insides if inside.program is program]
            where = f"; it is in {places[0]}" if places and places[0] else ""
            self.fail(
                title,
                diagnosis.inside_reason(scene)
                or Diagnosis(f"It still runs after {within:g} s{where}.", "still-running"),
                expected="ended",
                observed="still running",
                hint=hint,
            )
        ended = program.exit_status()
        if program.stopped_by():
            self.fail(title, diagnosis.program_trouble(self.scene()), expected="ended by itself", hint=hint)
        self.expect_that(
            status is None or ended == status,
            title,
            lambda: (
                diagnosis.shut_down_inside(self.scene())
                or diagnosis.program_trouble(self.scene())
                or Diagnosis(f"It ended with status {ended}.", "exit-status")
            ),
            expected=str(status),
            observed=str(ended),
            hint=hint,
        )

    def expect_argument_needed(self, name: str, *, hint: str = "") -> None:
        """The launch file cannot be run, because its launch argument `name` has no default and was not given."""
        title = f"Without `{name}` the launch file is refused"
        told = self._trouble[0].because if self._trouble else ""
        if f"the launch argument `{name}` has no value" in told:
            outcomes.passed(title)
            return
        started = f"It starts {len(self.nodes)} program{'' if len(self.nodes) == 1 else 's'} without it."
        reason = self._trouble[0] if self._trouble else Diagnosis(started, "argument-not-needed")
        self.fail(title, reason, expected=f"the launch argument `{name}` is wanted", hint=hint)

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
            within: seconds.
            hint: a pointer for the student.
        """
        from rcl_interfaces.msg import Log

        # rosout is transient local: who asks for that hears the last ten seconds too.
        rosout = self.observer.record(
            "/rosout", Log, QoSProfile(depth=1000, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        )

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
            self.observer.wait(lambda: len(matching()) > count, 0.3)
            found = len(matching()) == count
        self.expect_that(
            found,
            f"A log message{f' of level {level}' if level else ''} says {text!r}",
            lambda: (
                diagnosis.program_trouble(self.scene())
                or diagnosis.inside_reason(self.scene())
                or Diagnosis(
                    {0: "No such message was logged.", 1: "It came once."}.get(
                        len(matching()), f"It came {len(matching())} times."
                    ),
                    "no-log",
                )
            ),
            expected=text,
            observed="; ".join(r.msg.msg for r in rosout.messages[-3:]),
            hint=hint,
        )

    @property
    def clock(self) -> ClockDriver:
        """Simulated time of this launch (`use_sim_time=True`)."""
        if self._clock is None:
            self._clock = ClockDriver(self.observer)
        return self._clock

    def require(
        self,
        condition: object,
        title: str,
        *,
        expected: str = "",
        observed: str = "",
        because: str = "",
        hint: str = "",
        code: str = "",
    ) -> None:
        """State a fact in the check's own words: passed if `condition` is true.

        Where the programs themselves went wrong, the diagnosis of that is the reason. That one of them ended is none if
        the check gives a reason of its own: it knows whether that program had to go on.
        """
        if condition:
            outcomes.passed(title, expected=expected, observed=observed)
            return
        self.settle_programs()
        scene = self.scene()
        found = (diagnosis.program_trouble(scene), diagnosis.inside_reason(scene))
        # Where the check has a reason, these say less: they are what a program looks like that does nothing more.
        vague = ("exited", "not-spinning", "spinning-ended") if because else ()
        trouble = next((one for one in found if one and one.code not in vague), None)
        reason = trouble or (Diagnosis(because, code or "required") if because else None)
        self.fail(title, reason, expected=expected, observed=observed, hint=hint)
