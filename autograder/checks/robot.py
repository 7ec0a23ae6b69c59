"""A launch that goes on from cell to cell, until it is stopped: to be looked at, and played with, by hand."""

from __future__ import annotations

import sys
from pathlib import Path

from autograder.checks import runtime
from autograder.checks.expect.expectations import Expectations
from autograder.checks.misuse import Misuse
from autograder.graph.observer import Observer
from autograder.sandbox.limits import MIB, Limits

LIMITS = Limits(cpu_seconds=3600, wall_seconds=12 * 3600, output_bytes=256 * MIB)
"""A day in a notebook is longer than a check; memory, processes and disk are the same."""

_THERE_WITHIN = 5.0
"""Seconds that its nodes may take to be on the graph, before the cell goes on without them."""


class Robot(Expectations):
    """What a launch can do besides, in a notebook."""

    def __init__(self) -> None:
        """Nothing runs yet."""
        super().__init__()
        self._begun_with: dict[str, int] = {}
        """Programs, and when the file of each was written that it was started from."""

    told_in = 0
    """The number of the cell that has said already what runs."""

    @property
    def observer(self) -> Observer:
        """Who watches its graph."""
        return self._observer

    def _enter(self, limits: Limits | None) -> None:
        """Begin."""
        raise NotImplementedError

    def _go_on(self) -> None:
        """Begin, without a block that ends it."""
        if runtime.current.front_end is None or runtime.current.front_end.scored:
            raise Misuse("start() is for looking around in a notebook; a check is a block: with launch(…) as ros:")
        if runtime.current.block is not None:
            raise Misuse("A launch is started inside of another one's block; let that end before.")
        before = runtime.current.robot
        if before is not None:
            before.stop()
            print("What was started before has been stopped: one launch at a time goes on from cell to cell.")
        self._enter(LIMITS)
        self._begun_with = {node.program: _written(node.program) for node in self._running.described}
        runtime.current.robot = self

        def there() -> bool:
            running = [program for _, program in self._running.programs if program.running()]
            return len(running) < len(self._running.programs) or len(self._observer.nodes()) >= len(running)

        self._observer.wait(there, _THERE_WITHIN)
        self.told_in = runtime.current.front_end.number
        print(self.status())

    def stop(self, name: str = "", *, kill: bool = False) -> None:
        """End a program, or all."""
        raise NotImplementedError

    def news(self) -> list[str]:
        """What has become of the programs since they were started, a sentence each."""
        ended = [
            f"{program.name} has ended, with exit status {program.exit_status()}; .log() says what it printed."
            for _, program in self._running.programs
            if not program.running() and program not in self._running.stopped
        ]
        changed = [
            f"The cell of {name} has been run again since: what runs is as it was before. Call .start() once more."
            for name, written in self._begun_with.items()
            if _written(name) != written
        ]
        return ended + changed

    def status(self) -> str:
        """What runs, where it can be looked at, and how it is ended."""
        running = [program.name for _, program in self._running.programs if program.running()]
        lines = self.news()
        if not running:
            return "\n".join([*lines, "Nothing runs any more."])
        nodes = ", ".join(self._observer.nodes()) or "none yet"
        domain = self._observer.domain_id
        return "\n".join(
            [
                *lines,
                f"running: {', '.join(running)} (nodes: {nodes})",
                "  look at it with %ros2, as in `%ros2 node list`; end it with .stop()",
                f"  in a terminal: ROS_DOMAIN_ID={domain} {Path(sys.prefix) / 'bin' / 'ros2'} node list",
            ]
        )


def _written(program: str) -> int:
    """When a program's file was written, in nanoseconds; 0 if there is none."""
    path = runtime.current.folder / f"{program}.py"
    return path.stat().st_mtime_ns if path.is_file() else 0
