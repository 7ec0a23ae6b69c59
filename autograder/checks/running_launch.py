"""A launch that runs: its observer, its programs, and what became of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from autograder.checks import current, picture_data
from autograder.checks.concurrency import Concurrency
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program
from autograder.checks.settling import Settling
from autograder.core.front_end import View, Watcher
from autograder.core.results import NodeLog
from autograder.diagnosis import Scene
from autograder.diagnosis.inside import read
from autograder.graph.lifecycle import LifecycleClient
from autograder.graph.observer import Observer
from autograder.graph.services import OfferedService
from autograder.reasons import Reason
from autograder.sandbox.inside.probe.events import NodeSeen
from autograder.sandbox.running_program import RunningProgram

if TYPE_CHECKING:
    from autograder.graph.actions import ActionSeen  # loads numpy, which most labs do not need
    from autograder.world import RunningWorld

SETTLE = 2.0
"""Seconds that a new program may take to show that it lives."""

AFTER_EXIT = 0.3
"""Seconds that evidence may still be under way after the last program has ended."""


class RunningLaunch:
    """What the expectations of one launch know of its programs.

    Its `observer` is there from the moment the launch begins.
    """

    observer: Observer

    def __init__(self) -> None:
        """Begin without programs."""
        self.described: list[Program] = []
        """What the launch was asked to start."""
        self.over = False
        """Whether the launch has ended."""
        self.programs: list[tuple[Program, RunningProgram]] = []
        """What has been started."""
        self.of_hidden_tests: list[RunningProgram] = []
        """Programs that a line of a hidden test has started."""
        self.missing: list[str] = []
        """Programs that no cell has written."""
        self.trouble: list[Reason] = []
        """Why a program, or the whole launch file, could not be started."""
        self.unused_arguments: Callable[[], list[str]] = list
        """Tells the arguments of the launch that its launch file does not have."""
        self.stopped: list[RunningProgram] = []
        """Programs that the check itself has stopped."""
        self.may_end: list[RunningProgram] = []
        """Programs that the check itself has stopped, or that are asked to end by themselves."""
        self.watcher: Watcher | None = None
        """Shows in a notebook what is waited for."""
        self.introduced = (0, 0)
        """How many recordings and programs there were when all programs had made their nodes, and these were asked."""
        self.met: dict[str, int] = {}
        """Nodes that have answered, or had their time to, and how many recordings there were when they were asked."""
        self.overlaps: list[tuple[str, str]] = []
        """Topic and title of each expectation of overlapping callbacks that was met."""
        self.concurrencies: dict[str, Concurrency] = {}
        """What was made last of the messages on each topic of begins and ends."""
        self.lifecycle_clients: dict[str, LifecycleClient] = {}
        self.actions: dict[str, ActionSeen] = {}
        self.offered: dict[str, OfferedService] = {}
        """Services that the check offers, by their names."""
        self.publishers: dict[tuple[str, str], Any] = {}
        """The check's own publishers, by topic and QoS profile."""
        self.known_publishers: list[Any] = []
        """Those of them that have been used: what subscribed by then knows them."""
        self.world: RunningWorld | None = None
        """The world that its programs drive in."""
        self.view: View | None = None
        """Shows that world live in a notebook."""
        self.graph: picture_data.Graph | None = None
        """The graph as it was when the launch ended."""
        self._ended: float | None = None

    def scene(self) -> Scene:
        """The launch as the diagnosis sees it."""
        return Scene(
            self.observer,
            [program for _, program in self.programs],
            self.missing,
            current.check.folder,
            rules=[node.all_rules() for node, _ in self.programs],
            parameter_rules=[node.parameter_rules() for node, _ in self.programs],
            parameters=[list(node.parameters) for node, _ in self.programs],
            trouble=self.trouble,
            stopped=self.stopped,
        )

    def logs(self, ended: Mapping[int, int | None]) -> list[NodeLog]:
        """What the programs printed, and how each ended by itself: its status by its identity."""
        return [
            NodeLog(
                program=described.program,
                text=program.output(),
                truncated=program.truncated(),
                exit_status=ended[id(program)],
                stopped_by=program.stopped_by(),
                hidden=program in self.of_hidden_tests,
            )
            for described, program in self.programs
        ]

    def all_ended(self) -> bool:
        """Whether nothing can come any more: every program has ended (or none could be started), a moment ago."""
        if any(program.running() for _, program in self.programs):
            self._ended = None
            return False
        if self._ended is None:
            self._ended = time.monotonic()
        over = time.monotonic() - self._ended
        return over > AFTER_EXIT and over - self.observer.patience.kept(self._ended) > AFTER_EXIT

    def hopeless_without(self, needs: Callable[[], object]) -> Callable[[], bool]:
        """Return a question to ask while waiting: whether what needs this on the graph cannot come any more."""
        settling = Settling(self.observer, [program for _, program in self.programs])
        return lambda: self.all_ended() or (not needs() and settling.decided())

    def gone_program(self) -> RunningProgram | None:
        """A program that has ended by itself, though it had to go on: it failed, or it ended as the last one."""
        ended = [program for _, program in self.programs if not program.running() and program not in self.may_end]
        failed = [program for program in ended if program.exit_status() != 0]
        last = ended if len(ended) == len(self.programs) else []
        return next(iter(failed + last), None)

    def gone_nodes(self) -> set[str]:
        """The names of the nodes that only programs which have ended say they made.

        The nodes of a program that was killed stay on the graph for a while, and cannot answer.
        """
        made: dict[bool, set[str]] = {True: set(), False: set()}
        for _, program in self.programs:
            made[program.running()] |= {event.name for event in read(program.events()) if isinstance(event, NodeSeen)}
        return made[False] - made[True]

    def refuse_if_over(self) -> None:
        """Look whether something new is asked of programs that have been ended, as by a cell that is run again.

        Raises:
            Misuse: the launch has ended.
        """
        if self.over:
            raise Misuse("This launch has ended. Begin another one, as with robot = launch(…).start().")

    def lifecycle_client(self, node: str) -> LifecycleClient:
        """Who asks this lifecycle node, and has recorded its changes since the first call of this."""
        if node not in self.lifecycle_clients:
            self.lifecycle_clients[node] = LifecycleClient(self.observer, node)
        return self.lifecycle_clients[node]

    def settle_programs(self) -> None:
        """Give a new program a moment to show what becomes of it, before something is held against it."""
        youngest = max((program.began for _, program in self.programs), default=0.0)
        self.observer.wait(self.gone_program, youngest + SETTLE - time.monotonic())
