"""Expectations of the programs themselves: alive, ended, what they log."""

from __future__ import annotations

import re
import signal
from functools import cached_property
from typing import Any

from rcl_interfaces.msg import Log
from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.expectations import WITHIN, Expectations
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program
from autograder.diagnosis import Diagnosis, last_traceback
from autograder.graph.clock import ClockDriver
from autograder.graph.recording import Recording
from autograder.sandbox.node_sandbox import RunningProgram

_LEVELS = {"DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
"""Numbers of rcl_interfaces/msg/Log."""

_SAID = {"SIGINT": "Ctrl-C (SIGINT)", "SIGTERM": "SIGTERM"}
"""How a program is told to end, in words."""

_ENDED = "`main` has to catch what spinning raises then: `KeyboardInterrupt` and `ExternalShutdownException`. "
_ENDED += "After that `rclpy.try_shutdown()` is right, which does nothing where the signal has shut rclpy down already."


class ProgramExpectations(Expectations):
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

    def _end(self) -> None:
        """End the launch."""
        raise NotImplementedError

    def _start(self, node: Program | str) -> None:
        """Start one more program."""
        raise NotImplementedError

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

    def expect_exit(self, name: str, *, status: int | None = None, within: float = WITHIN, hint: str = "") -> None:
        """A program ends by itself.

        Args:
            name: of the program.
            status: its exit status; by default any.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Example:
            `ros.expect_exit("stopper", status=0)`

        Codes:
            `still-running`, `exit-status`, `shutdown-in-callback`, and reasons why a program ends or does not.
        """
        program = self.program(name)
        self._running.may_end.append(program)
        title = f"`{name}` ends by itself" + ("" if status is None else f" with exit status {status}")
        if not self.wait(lambda: not program.running(), within):
            where = self._place_of(program)
            reason = diagnosis.inside_reason(self._scene())
            if reason and reason.code in ("spinning-ended", "not-spinning"):  # a program that ends need not spin
                reason = None
            self._fail(
                title,
                reason or Diagnosis(f"It still runs after {within:g} s{where}.", "still-running"),
                expected="ended",
                observed="still running",
                hint=hint,
            )
        ended = program.exit_status()
        if program.stopped_by():
            self._fail(title, diagnosis.program_trouble(self._scene()), expected="ended by itself", hint=hint)
        self._expect_that(
            status is None or ended == status,
            title,
            lambda: diagnosis.shut_down_inside(self._scene()) or self._why_this_status(ended),
            expected=str(status),
            observed=str(ended),
            hint=hint,
        )

    def _why_this_status(self, ended: int | None) -> Diagnosis:
        """Why a program that had to end did so with another status: an error, or nothing more than that is known."""
        reason = diagnosis.program_trouble(self._scene())
        if reason is not None and reason.code not in ("exited", "not-spinning"):  # it had to end, and need not spin
            return reason
        return Diagnosis(f"It ended with status {ended}.", "exit-status")

    def expect_clean_end(self, name: str, *, by: str = "SIGINT", within: float = 3.0, hint: str = "") -> None:
        """A program that is told to end does so: with exit status 0, and without printing an error.

        Args:
            name: of the program.
            by: the signal that tells it: `SIGINT`, as Ctrl-C does, or `SIGTERM`, as launch and systemd do.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Example:
            `ros.expect_clean_end("talker", by="SIGTERM")`

        Codes:
            `signal-ignored`, `unclean-end`, and those of `expect_running`.
        """
        if by not in _SAID:
            raise Misuse(f"expect_clean_end: by={by!r} is none of {', '.join(_SAID)}.")
        self.expect_running(name)
        program = self.program(name)
        title = f"`{name}` ends cleanly at {_SAID[by]}"
        self._running.may_end.append(program)
        said_before = len(program.output())
        program.signal(getattr(signal, by))
        if not self._observer.wait(lambda: not program.running(), within):
            because = f"{within:g} s after {_SAID[by]} it still runs{self._place_of(program)}."
            self._fail(
                title, Diagnosis(because, "signal-ignored"), expected="ended", observed="still running", hint=hint
            )
        self._running.stopped.append(program)
        status, said = program.exit_status(), program.output()[said_before:]
        error = last_traceback(said, name) if status or "Traceback (most recent call last)" in said else None
        because = f"Told to end by {_SAID[by]}, it ended with exit status {status}."
        if error is not None:
            because = f"{error.because}. That was at {_SAID[by]}; the exit status is {status}."
        self._expect_that(
            status == 0 and error is None,
            title,
            lambda: Diagnosis(because, "unclean-end", _ENDED if error is not None else ""),
            expected="exit status 0 and no error",
            observed=f"exit status {status}" + (" and an error" if error is not None else ""),
            hint=hint,
        )

    def _place_of(self, program: RunningProgram) -> str:
        """Where the main thread of a program is, as the end of a sentence; empty if that cannot be seen."""
        places = [inside.main_place() for inside in self._scene().insides if inside.program is program]
        return f"; it is in {places[0]}" if places and places[0] else ""

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
        reason = self._running.trouble[0] if self._running.trouble else Diagnosis(started, "argument-not-needed")
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
            f"A log message{f' of level {level}' if level else ''} says {text!r}",
            lambda: self._why_not_logged(len(matching())),
            expected=text,
            observed="; ".join(r.msg.msg for r in rosout.messages[-3:]),
            hint=hint,
        )

    @cached_property
    def _rosout(self) -> Recording:
        # It is transient local: who asks for that hears the last ten seconds too.
        profile = QoSProfile(depth=1000, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        return self._observer.record("/rosout", Log, profile)

    def _why_not_logged(self, times: int) -> Diagnosis:
        came = {0: "No such message was logged.", 1: "It came once."}.get(times, f"It came {times} times.")
        scene = self._scene()
        return diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene) or Diagnosis(came, "no-log")

    @cached_property
    def clock(self) -> ClockDriver:
        """Simulated time of this launch (`use_sim_time=True`).

        Example:
            `ros.clock.advance(1.0, lambda: heard.count > 0)`
        """
        return ClockDriver(self._observer)
