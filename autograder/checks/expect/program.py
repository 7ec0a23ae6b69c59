"""`ros.program`: a program that the launch has started: whether it runs, how it ended, how it ends at a signal."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from autograder import diagnosis
from autograder.checks import current, outcomes
from autograder.checks.expect.expectations import WITHIN, Noun
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.core.output import tidy
from autograder.diagnosis import last_traceback
from autograder.diagnosis.programs import EXITED, NOT_SPINNING, SPINNING_ENDED
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.running_program import RunningProgram

EXIT_STATUS = Kind("exit-status", "the program ended with another status", Group.OUTPUT)
SIGNAL_IGNORED = Kind(
    "signal-ignored",
    "a signal told the program to end, but it was still running when the time for this was over",
    Group.OUTPUT,
)
UNCLEAN_END = Kind(
    "unclean-end",
    "told to end by a signal, the program ended with another status than 0 or printed an error",
    Group.OUTPUT,
)
STILL_RUNNING = Kind("still-running", "a program runs on that should have ended", Group.OUTPUT)

_SAID = {"SIGINT": "Ctrl-C (SIGINT)", "SIGTERM": "SIGTERM"}
"""How a program is told to end, in words."""

_STAMP = re.compile(r" \[\d+\.\d+\]")
"""The time in a line of the log."""

_ENDED = "`main` has to catch the exceptions that spinning then raises: `KeyboardInterrupt` and "
_ENDED += "`ExternalShutdownException`. After that, call `rclpy.try_shutdown()`, which does nothing if the signal has "
_ENDED += "already shut down rclpy."
_UNTAKEN = "The program did not handle the signal, so the signal ended it immediately. `rclpy.init()` handles both "
_UNTAKEN += "signals, but not for a context of your own and not with `SignalHandlerOptions.NO`."

_SPINS_WITHIN = 3.0
"""Seconds for which a program is let alone until it spins: before that it has not reached what catches the signal."""

_COMES_TO_REST = 0.1
"""Seconds in which a program that has just answered waits again. A signal that comes before that lets `spin` return
without an exception, and then nothing is seen of what the program does with one."""

_CONTEXT_GONE = "the given context is not valid"
_RACE_OF_RCLPY = re.compile(rf", in _wait_for_ready_callbacks\n(?: .*\n)+\S+: .*{_CONTEXT_GONE}")
"""What rclpy raises once in a while if the signal comes just when it begins to wait: no mistake of the program's.

It makes a wait set then, and where the wait has a time limit a timer before that; either wants a context.
"""
_TRIES = 3
"""Runs of a program that end like that, after which nobody believes in chance any more."""


def _comes_back(where: str, never_spun: bool) -> str:
    """Say when the call returns in which a program still is that should have ended; empty if that is not known."""
    if "spin_until_future_complete(" in where:
        over = " or its `timeout_sec` is over" if "timeout_sec" in where else ""
        return (
            f"`spin_until_future_complete` returns as soon as its future is done{over}. The future of `call_async` is "
            "done when the response arrives; a future of your own is done when you call `set_result` on this same "
            "object."
        )
    if any(call in where for call in (".send_goal(", ".cancel_goal(", ".get_result(")):
        return (
            "This call returns only if another thread spins the node meanwhile. If no other thread does, call the "
            "`_async` variant and spin until the future is done."
        )
    if never_spun and (".call(" in where or ".done()" in where):
        return "Nothing spins the node while it waits here, but a response is processed only while the node is spun."
    return "`spin` does not return by itself." if ".spin(" in where else ""


class StartedProgram(Noun):
    """A program that the launch has started; after a restart, its last run."""

    _full_name = False

    def __init__(self, running: RunningLaunch, name: str, start: Callable[[Program], None]) -> None:
        """Ask about the program of this name; that there is none is a failed outcome.

        Args:
            running: the launch.
            name: of the program, or of its node as the launch names it: that tells several runs of one program apart.
            start: starts one more program of the launch.
        """
        super().__init__(running, name)
        self._start = start
        self._program  # noqa: B018 - a missing one fails here

    @property
    def _program(self) -> RunningProgram:
        """The last started program of this name; a missing one is a failed outcome."""
        for node, program in reversed(self._running.programs):
            if self.name in (node.program, node.node_name()):
                return program
        self._fail(f"The program `{self.name}` is there", diagnosis.program_trouble(self._scene()))

    def running(self) -> bool:
        """Whether it has not ended."""
        return self._program.running()

    def exit_status(self) -> int | None:
        """Its exit status, negative for a signal; None while it runs."""
        return self._program.exit_status()

    def output(self) -> str:
        """What it has printed so far.

        Example:
            `printed = ros.program("talker").output()`
        """
        return self._program.output()

    def signal(self, number: int) -> None:
        """Send it a signal, such as `signal.SIGINT`, which is what Ctrl-C does."""
        self._program.signal(number)

    def events(self) -> list[dict[str, Any]]:
        """Return the raw events of its probe. They are evidence for reasons only."""
        return self._program.events()

    def seen_runs(self, kind: str, name: str) -> int | None:
        """Return how often the probe saw a callback begin. This is evidence for reasons only.

        Args:
            kind: `subscription` or `service`.
            name: full name of its topic or service.

        Returns:
            None where the inside of the program cannot be seen.

        Example:
            `runs = ros.program("recorder").seen_runs("subscription", "/frames")`
        """
        things = [t for inside in self._scene().insides if inside.name == self.name for t in inside.callbacks]
        return next((thing.runs for thing in things if (thing.kind, thing.name) == (kind, name)), None)

    def stop(self, *, kill: bool = False) -> None:
        """End it: politely (SIGTERM), or without a chance to clean up.

        Args:
            kill: end it without a chance to clean up.

        Example:
            `ros.program("talker").stop()`
        """
        program = self._program
        self._running.may_end.append(program)
        self._running.stopped.append(program)
        program.stop(grace=0.0 if kill else 2.0)

    def restart(self) -> None:
        """Start it once more, with the words that it was started with before; it has ended, or `stop` has ended it.

        One that was killed is still on the graph for a while: its topics have one publisher more than there is.

        Example:
            `ros.program("planner").restart()`
        """
        wanted = self._program
        if wanted.running():
            raise Misuse(f"restart: `{self.name}` still runs; end it with ros.program({self.name!r}).stop() before.")
        self._start(next(launched for launched, program in self._running.programs if program is wanted))

    def expect_started(self) -> None:
        """The launch started it: its words could be read, and its package or cell is there.

        Example:
            `ros.program("camera").expect_started()`

        Codes:
            those of words that cannot be read, such as `rule-syntax`.
        """
        outcomes.passed(f"The program `{self.name}` is there")

    @waits_for("the program `{name}`")
    def expect_running(self, *, hint: str = "") -> None:
        """A program has not ended.

        Args:
            hint: a pointer for the student.

        Example:
            `ros.program("talker").expect_running()`

        Codes:
            `crashed`, `exited` and other reasons why a program ends.
        """
        name = self.name
        self._expect_that(
            self._program.running(),
            f"`{name}` is still running",
            lambda: diagnosis.program_trouble(self._scene()),
            hint=hint,
        )

    @waits_for("the end of the program `{name}`")
    def expect_exit(self, *, status: int | None = None, within: float = WITHIN, hint: str = "") -> None:
        """A program ends by itself.

        Args:
            status: its exit status; by default any.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Example:
            `ros.program("stopper").expect_exit(status=0)`

        Codes:
            `still-running`, `exit-status`, `shutdown-in-callback`, and reasons why a program ends or does not.
        """
        name = self.name
        program = self._program
        self._running.may_end.append(program)
        title = f"`{name}` ends by itself" + ("" if status is None else f" with exit status {status}")
        if not self._wait(lambda: not program.running(), within):
            where = self._place_of(program)
            hint = f"{_comes_back(where, self._never_spun(program))} {hint}".strip()
            others = self._other_runs(program)
            reason = diagnosis.reason_inside([one for one in self._scene().insides if one.program not in others])
            if reason and reason.kind in (SPINNING_ENDED, NOT_SPINNING):  # a program that ends need not spin
                reason = None
            self._fail(
                title,
                reason or STILL_RUNNING(f"It is still running after {within:g} s{where}."),
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
            lambda: diagnosis.shut_down_inside(self._scene()) or self._why_this_status(program),
            expected=str(status),
            observed=str(ended),
            hint=hint,
        )

    def _other_runs(self, program: RunningProgram) -> list[RunningProgram]:
        """Return earlier runs of the same program, which explain nothing about the last one."""
        return [one for _, one in self._running.programs if one.name == program.name and one is not program]

    def _why_this_status(self, program: RunningProgram) -> Reason:
        """Why a program that had to end did so with another status: an error, or what it said last."""
        scene = self._scene()
        reason = diagnosis.program_trouble(replace(scene, stopped=[*scene.stopped, *self._other_runs(program)]))
        if reason is not None and reason.kind not in (EXITED, NOT_SPINNING):  # it had to end, and need not spin
            return reason
        said = [line.strip() for line in tidy(program.output()).splitlines() if line.strip()]
        last = f" The last line it printed is `{_STAMP.sub('', said[-1])[:120]}`." if said else ""
        return EXIT_STATUS(f"It ended with status {program.exit_status()}.{last}")

    @waits_for("the end of the program `{name}`")
    def expect_clean_end(self, *, by: str = "SIGINT", within: float = 3.0, hint: str = "") -> None:
        """A program that is told to end does so: with exit status 0, and without printing an error.

        Where rclpy was interrupted as it began to wait, the program shows nothing; it is started again, and told again.
        If that happens three times, an instructor decides.

        Args:
            by: the signal that tells it: `SIGINT`, as Ctrl-C does, or `SIGTERM`, as launch and systemd do.
            within: seconds until it must have ended.
            hint: a pointer for the student.

        Example:
            `ros.program("talker").expect_clean_end(by="SIGTERM")`

        Codes:
            `signal-ignored`, `unclean-end`, and those of `expect_running`.
        """
        name = self.name
        if by not in _SAID:
            raise Misuse(f"expect_clean_end: by={by!r} is none of {', '.join(_SAID)}.")
        self.expect_running()
        title = f"`{name}` ends cleanly at {_SAID[by]}"
        for _ in range(_TRIES - 1):
            if not self._ends_interrupted(title, by, within, hint):
                return
            self.restart()
        if self._ends_interrupted(title, by, within, hint):
            # A program that prints such an error itself ends like this each time, and rclpy hardly ever does.
            current.check.findings.flags.append(f"`{name}` ended {_TRIES} times with an error that rclpy rarely has.")
            outcomes.unknown(title, f"The signal came {_TRIES} times just when rclpy began to wait.")

    def _ends_interrupted(self, title: str, by: str, within: float, hint: str) -> bool:
        """Tell a program to end, and return whether rclpy was interrupted as it began to wait."""
        program = self._program
        self._running.may_end.append(program)
        self._observer.wait(lambda: self._spun(program) or not program.running(), _SPINS_WITHIN)
        self._observer.pause(_COMES_TO_REST)
        said_before = len(program.output())
        program.signal(getattr(signal, by))
        if not self._observer.wait(lambda: not program.running(), within) and self._woke_too_soon(program, by):
            program.signal(getattr(signal, by))
            self._observer.wait(lambda: not program.running(), within)
        if program.running():
            because, advice = f"{within:g} s after {_SAID[by]}, it is still running{self._place_of(program)}.", ""
            if left := self._thread_left(program):
                because, advice = f"{because} {left.because}", left.hint
            reason = SIGNAL_IGNORED(because, advice)
            self._fail(title, reason, expected="ended", observed="still running", hint=hint)
        self._running.stopped.append(program)
        status, said = program.exit_status(), program.output()[said_before:]
        error = last_traceback(said, self.name) if status or "Traceback (most recent call last)" in said else None
        if error is not None and _CONTEXT_GONE in error.because and _RACE_OF_RCLPY.search(said):
            return True
        because = f"After {_SAID[by]}, it ended with exit status {status}."
        if error is not None:
            because = f"{error.because}. This happened after {_SAID[by]}; the exit status is {status}."
        advice = _ENDED if error is not None else _UNTAKEN if status == -getattr(signal, by) else ""
        self._expect_that(
            status == 0 and error is None,
            title,
            lambda: UNCLEAN_END(because, advice),
            expected="exit status 0 and no error",
            observed=f"exit status {status}" + (" and an error" if error is not None else ""),
            hint=hint,
        )
        return False

    def _spun(self, program: RunningProgram) -> bool:
        """Whether a program has begun to spin; its node is on the graph before its `__init__` has ended."""
        inside = self._scene().inside(program)
        return any(executor.spins for executor in inside.executors)

    def _woke_too_soon(self, program: RunningProgram, by: str) -> bool:
        """Whether rclpy may have missed SIGTERM, which is no fault of the program.

        rclpy 7.1 wakes its executor first and shuts the context down after that (`signal_handler.cpp`). An executor
        that looks at the context in between waits again, for as long as nothing else wakes it.
        """
        return by == "SIGTERM" and "spin" in self._place_of(program)

    def _never_spun(self, program: RunningProgram) -> bool:
        """Whether it is known that no executor of the program has spun so far."""
        inside = self._scene().inside(program)
        return inside.attached and not any(executor.spins for executor in inside.executors)

    def _thread_left(self, program: RunningProgram) -> Reason | None:
        """Say which thread keeps a program alive whose `main` has ended, if that is known."""
        insides = (inside for inside in self._scene().insides if inside.program is program)
        return next((found for inside in insides if (found := diagnosis.thread_left(inside))), None)

    def _place_of(self, program: RunningProgram) -> str:
        """Say, as the end of a sentence, where the main thread of a program is; empty if that cannot be seen."""
        places = [inside.main_place() for inside in self._scene().insides if inside.program is program]
        return f"; it is in {places[0]}" if places and places[0] else ""
