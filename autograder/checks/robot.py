"""A launch to look at and play with by hand: it runs for a moment, or goes on from cell to cell until it is stopped."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from autograder.checks import current
from autograder.checks.misuse import Misuse
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.core.output import tidy
from autograder.graph.names import node_of
from autograder.graph.observer import Observer
from autograder.sandbox.running_program import RunningProgram

TRIAL = 3.0
"""Seconds for which the programs run."""

_OWN = ("/rosout", "/parameter_events")


class Log(str):
    """What programs printed; a notebook shows it as it is."""

    __slots__ = ()

    def __repr__(self) -> str:
        return self or "(nothing was printed)"


def log_of(programs: Sequence[RunningProgram], name: str) -> Log:
    """Return what the programs of a launch have printed so far, or one of them."""
    chosen = [program for program in programs if name in ("", program.name)]
    if programs and not chosen:
        there = ", ".join(dict.fromkeys(program.name for program in programs))
        raise Misuse(f"log: no program {name!r} was started; there is {there}.")
    many = len(chosen) > 1
    return Log("\n".join(f"--- {p.name}\n{tidy(p.output())}" if many else tidy(p.output()).rstrip() for p in chosen))


def try_out(running: RunningLaunch) -> str:
    """Let a launch run for a few seconds, while its programs print, and tell what was on the graph."""
    observer = running.observer
    observer.wait(running.all_ended, TRIAL)
    if running.all_ended():
        ends = [f"{p.name} ended with exit status {p.exit_status()}" for _, p in running.programs]
        return "; ".join(ends) + "."
    nodes = observer.nodes()
    lines = [f"After {TRIAL:g} s: " + (f"the nodes {', '.join(nodes)}" if nodes else "no node") + "."]
    for verb, ends_of in (("publishes", observer.publishers), ("subscribes to", observer.subscriptions)):
        for topic, types in sorted(observer.topics().items()):
            owners = sorted({node_of(end) for end in ends_of(topic)})
            if owners and topic not in _OWN:
                lines.append(f"  {', '.join(owners)} {verb} {topic} ({', '.join(types)})")
    return "\n".join(lines)


_THERE_WITHIN = 5.0
"""Seconds that its nodes may take to be on the graph, before the cell goes on without them."""


class Robot:
    """What runs: of a block, or from cell to cell.

    Args:
        running: its programs, which have been started.
        stop: ends it.
    """

    def __init__(self, running: RunningLaunch, stop: Callable[[], None]) -> None:
        """Note what the programs were started from."""
        self._running = running
        self._begun_with = {node.program: _written(node.program) for node in running.described}
        self._told: list[RunningProgram] = []
        """The programs of which it has been said that they have ended."""
        self.stop = stop
        here = current.check.front_end
        self.cell = here.number if here is not None else 0
        """The number in the brackets beside the cell that began it."""

    @property
    def observer(self) -> Observer:
        """Who watches its graph."""
        return self._running.observer

    @waits_for("the programs' nodes")
    def wait_for_nodes(self) -> None:
        """Wait until each program that has not ended has a node."""

        world = self._running.world
        cars = len(world.nodes) if world is not None else 0

        def there() -> bool:
            running = [program for _, program in self._running.programs if program.running()]
            return len(self.observer.nodes()) >= len(running) + cars

        self.observer.wait(there, _THERE_WITHIN)

    def news(self) -> list[str]:
        """What has become of the programs, a sentence each. The end of a program is told once."""
        ended = [program for program in self._ended() if program not in self._told]
        self._told += ended
        return [*map(_end_of, ended), *self._changed()]

    def _ended(self) -> list[RunningProgram]:
        """Return the programs that have ended by themselves."""
        programs = [program for _, program in self._running.programs]
        return [program for program in programs if not program.running() and program not in self._running.stopped]

    def _changed(self) -> list[str]:
        return [
            f"The cell of {name} has been run again since: what runs is as it was before. Call .start() once more."
            for name, written in self._begun_with.items()
            if _written(name) != written
        ]

    def __str__(self) -> str:
        """What runs, where it can be looked at, and how it is ended."""
        running = [program.name for _, program in self._running.programs if program.running()]
        self._told = self._ended()
        lines = [*map(_end_of, self._told), *self._changed()]
        if not running:
            return "\n".join([*lines, "Nothing runs any more."])
        nodes = ", ".join(self.observer.nodes()) or "none yet"
        terminal = f"ROS_DOMAIN_ID={self.observer.domain_id} {Path(sys.prefix) / 'bin' / 'ros2'} node list"
        return "\n".join(
            [
                *lines,
                f"running: {', '.join(running)} (nodes so far: {nodes})",
                "  look at it with %ros2, as in `%ros2 node list`; end it with .stop()",
                f"  in a terminal: {terminal}",
            ]
        )


def _end_of(program: RunningProgram) -> str:
    return f"{program.name} has ended, with exit status {program.exit_status()}; .log() says what it printed."


def end_robot() -> None:
    """End the launch that goes on from cell to cell, if there is one.

    Raises:
        Misuse: nothing can go on from here.
    """
    if current.check.front_end is None or current.check.front_end.scored:
        raise Misuse("start() is for looking around in a notebook; a check is a block: with launch(…) as ros:")
    if current.check.block is not None:
        raise Misuse("A launch is started inside of another one's block; let that end before.")
    if current.check.robot is not None:
        current.check.robot.stop()
        print("What was started before has been stopped: one launch at a time goes on from cell to cell.")


def _written(program: str) -> int:
    """When a program's file was written, in nanoseconds; 0 if there is none."""
    path = current.check.folder / f"{program}.py"
    return path.stat().st_mtime_ns if path.is_file() else 0
