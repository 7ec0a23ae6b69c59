"""`ros` in a check cell: a student's programs and an observer, on a ROS domain of their own."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import cached_property
from types import TracebackType
from typing import Any, Self

from rclpy.qos import QoSProfile

from autograder.checks import contradictions, current, outcomes, seen
from autograder.checks.building import why_no_package, why_not_found
from autograder.checks.expect.action import Action
from autograder.checks.expect.activity import Activity
from autograder.checks.expect.draw import Draw
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.facts import Facts
from autograder.checks.expect.graph import Graph
from autograder.checks.expect.lifecycle import Lifecycle
from autograder.checks.expect.node import Node
from autograder.checks.expect.program import StartedProgram
from autograder.checks.expect.publisher import RELIABLE_DEEP, Publisher
from autograder.checks.expect.qos import Qos
from autograder.checks.expect.server import Server
from autograder.checks.expect.service import Service
from autograder.checks.expect.topic import Topic
from autograder.checks.launched_file import LaunchedFile
from autograder.checks.misuse import Misuse, refuse_text
from autograder.checks.parts import part
from autograder.checks.program import Program
from autograder.checks.robot import Robot, make_room
from autograder.checks.running import Running
from autograder.checks.scoring import Score, score
from autograder.checks.starting import file_of, refuse_to_start, why_missing, words_of
from autograder.checks.try_out import Log, log_of, try_out
from autograder.checks.waiting import NotLaunchedError, waits_for
from autograder.core.processes import no_threads
from autograder.graph.domains import claim_domain
from autograder.graph.lifecycle import Change, in_order
from autograder.graph.observer import ForgedGraph, Observer
from autograder.graph.publishing import ClockDriver
from autograder.launch_files import remove_written
from autograder.packages.workspace import INSTALLED
from autograder.pictures import Runs
from autograder.reasons import Reason, Refused
from autograder.sandbox.environment import profile_environment, remove_logs
from autograder.sandbox.program_group import ProgramGroup


class Launch(Facts):
    """A running launch: `ros` in a check cell. Its nouns, such as `ros.topic`, know what can be asked of each thing."""

    def __init__(
        self,
        nodes: Sequence[Program],
        listen: Iterable[tuple[str, type]],
        serve: Iterable[tuple[Any, ...]],
        lifecycle: Iterable[str],
        file: LaunchedFile | None = None,
        packages: Sequence[str] = (),
    ) -> None:
        """Use `launch` or `launch_file`."""
        super().__init__(Running())
        refuse_text("launch", listen=listen, serve=serve, lifecycle=lifecycle)
        self._packages = [*packages, *(file.packages() if file else ())]
        self._running.described = list(nodes)
        self._file = file
        self._listen, self._serve, self._lifecycle = list(listen), list(serve), list(lifecycle)
        self._group: ProgramGroup | None = None
        self._robot: Robot | None = None
        self._entered = self._over = False

    def __enter__(self) -> Launch:
        if current.check.block is not None:
            raise Misuse("A launch begins inside another one; let the first block end before.")
        current.check.block = self._enter()
        return self

    def _enter(self) -> Robot:
        """Begin to watch, and start the programs."""
        if self._entered:
            raise Misuse("This launch has run already; call launch(…) again for another one.")
        here = current.check.front_end
        if here is not None:
            here.ready()
        domain = claim_domain()
        # The middleware reads its profile once, before the first participant of the process.
        os.environ.update(profile_environment())
        os.environ.pop("ROS_AUTOMATIC_DISCOVERY_RANGE", None)
        try:
            self._running.observer = Observer(
                domain.id, current.check.findings.patience, domain.release, current.check.bag
            )
        except RuntimeError as error:  # rclpy's RCLError is one
            raise no_threads("the launch") or error from None
        self._entered = True
        current.check.findings.begin_block()
        try:
            if here is not None:
                self._running.watcher = here.watch(
                    self._observer, lambda: [program for _, program in self._running.programs]
                )
            self._begin()
            trouble = self._running.trouble
            if here is not None and trouble and not here.scored:  # what only listens would never say so
                raise NotLaunchedError(trouble[0])
        except BaseException:
            self._end()
            raise
        self._robot = Robot(self._running, self._end)
        return self._robot

    def _begin(self) -> None:
        """Listen, and then start the programs."""
        if not self._build():
            return
        self._group = current.check.sandbox.group()
        for topic, msg_type in self._listen:
            self._observer.record(topic, msg_type)
        for offer in self._serve:
            self.server(*offer)
        for node in self._lifecycle:
            self._running.lifecycle_client(node)
        if self._file is not None:
            try:
                self._running.described = self._file.nodes()
                self._running.unused_arguments = self._file.unused
            except Refused as error:  # which every expectation then tells
                self._running.trouble.append(error.reason)
        for launched in self._running.described:
            self._start(launched)

    def _build(self) -> bool:
        """Build the packages that the launch needs; whether it has them all."""
        reasons = [reason for package in self._packages if (reason := why_no_package(package)) is not None]
        self._running.trouble += reasons
        return not reasons

    def start(self, node: Program | str | None = None) -> Self:
        """Start one more program. Without one, begin a launch that goes on from cell to cell, until `stop()`.

        The latter is for looking around in a notebook; one such launch runs at a time.

        Args:
            node: a program's name, or a `Program` with arguments.

        Example:
            `ros.start(Program("listener", name="late"))`
        """
        if node is None:
            refuse_to_start(self._running.described)
            make_room()
            current.check.robot = robot = self._enter()
            try:
                robot.wait_for_nodes()
            except BaseException:  # the cell has no name for it yet, by which it could be stopped
                robot.stop()
                raise
            print(robot)
        elif self._group is not None:
            self._start(node)
        elif not self._entered:  # else a package was not built, which every expectation tells
            raise Misuse("This launch does not run yet: name all its programs in launch(…), then .start() begins it.")
        return self

    def _start(self, node: Program | str) -> None:
        launched = Program(node) if isinstance(node, str) else node
        file = file_of(launched)
        current.check.use(file)
        if launched.params_file:
            current.check.use(launched.params_file)
        if launched.package:
            reason = why_not_found(launched.package, launched.program)
            if reason is not None:
                self._running.trouble.append(reason)
                return
        elif not current.check.has(file):
            self._miss(launched.program)
            return
        words = words_of(launched)
        if isinstance(words, Reason):
            self._running.trouble.append(words)
            return
        environment = {"ROS_DOMAIN_ID": str(self._observer.domain_id), **launched.environment, **profile_environment()}
        assert self._group is not None  # begun on entering
        prefixes = [f"{INSTALLED}/{package}" for package in self._packages]
        program = self._group.start(
            launched.program, words, environment, cores=launched.cores, file=file, prefixes=prefixes
        )
        self._running.programs.append((launched, program))

    def _miss(self, program: str) -> None:
        """No cell has written this program."""
        if current.check.front_end is None:
            self._running.missing.append(program)
        else:
            self._running.trouble.append(why_missing(program))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        try:
            return outcomes.ends_block(error)
        finally:
            self._end()

    def topic(self, name: str, msg_type: type | None = None) -> Topic:
        """A topic: who publishes and subscribes, and what arrives.

        Args:
            name: full name.
            msg_type: message class; only `expect_unused` and counts of 0 do without.

        Example:
            `chatter = ros.topic("/chatter", String)`
        """
        return Topic(self._running, name, msg_type)

    def publisher(self, name: str, msg_type: type, qos: QoSProfile | int = RELIABLE_DEEP) -> Publisher:
        """A publisher of the check's own, made when it is first used.

        Args:
            name: full name of the topic.
            msg_type: message class.
            qos: what is offered, a profile or a depth.

        Example:
            `numbers = ros.publisher("/numbers", Int64)`
        """
        return Publisher(self._running, name, msg_type, qos)

    def qos(self, topic: str) -> Qos:
        """The QoS of a topic.

        Args:
            topic: full name.

        Example:
            `ros.qos("/map").expect(durability="transient_local")`
        """
        return Qos(self._running, topic)

    def node(self, name: str) -> Node:
        """A node: whether it is there, its parameters and what it logs.

        Args:
            name: full name.

        Example:
            `ros.node("/talker").expect()`
        """
        return Node(self._running, name)

    def lifecycle(self, node: str) -> Lifecycle:
        """The state machine of a lifecycle node.

        Args:
            node: full name.

        Example:
            `ros.lifecycle("/camera").expect_state("active")`
        """
        return Lifecycle(self._running, node)

    def service(self, name: str, srv_type: type) -> Service:
        """A service of the student's.

        Args:
            name: full name.
            srv_type: service class.

        Example:
            `total = ros.service("/add", AddTwoInts).call(AddTwoInts.Request(a=1, b=2)).sum`
        """
        return Service(self._running, name, srv_type)

    def server(
        self,
        name: str,
        srv_type: type | None = None,
        answer: Callable[[Any, Any], Any] | None = None,
        delay: float = 0.0,
    ) -> Server:
        """A service that the check offers to the student's client, from the first call of this on.

        Args:
            name: full name.
            srv_type: service class; not needed for a service that is offered already.
            answer: is given a request and a response, and returns the response.
            delay: seconds from the arrival of a request to its answer.

        Example:
            `ros.server("/gate", Trigger, lambda request, response: response, delay=0.2)`
        """
        return Server(self._running, name, srv_type, answer, delay)

    def action(self, name: str, action_type: type) -> Action:
        """An action of the student's.

        Args:
            name: full name.
            action_type: action class.

        Example:
            `goal = ros.action("/dock", Fibonacci).send_goal(Fibonacci.Goal(order=5), accepted=True)`
        """
        return Action(self._running, name, action_type)

    def activity(self, topic: str) -> Activity:
        """Callbacks that publish `NAME begin` and `NAME end` (`std_msgs/String`) when they begin and end.

        Record the topic from the start, with `launch(…, listen=[(topic, String)])`: an end whose begin was missed could
        be taken for that of a later run.

        Args:
            topic: full name of the topic on which they do.

        Example:
            `ros.activity("/activity").expect_overlap(["camera", "planner"])`
        """
        return Activity(self._running, topic)

    def program(self, name: str) -> StartedProgram:
        """A program that was started; a missing one is a failed outcome.

        Args:
            name: of the program, or of its node as the launch names it: that tells several runs of one program apart.

        Example:
            `ros.program("talker").expect_clean_end(by="SIGTERM")`

        Codes:
            `program-missing`, `nothing-started`.
        """
        return StartedProgram(self._running, name, self._start)

    @property
    def graph(self) -> Graph:
        """What is on the graph at this moment.

        Example:
            `ros.graph.nodes()`
        """
        return Graph(self._running)

    @property
    def draw(self) -> Draw:
        """Pictures of what happened, for a notebook.

        Example:
            `ros.draw.timeline(seconds=2)`
        """
        return Draw(self._running)

    @cached_property
    def clock(self) -> ClockDriver:
        """Simulated time of this launch (`use_sim_time=True`).

        Example:
            `ros.clock.advance(1.0, lambda: heard.count > 0)`
        """
        return ClockDriver(self._observer)

    @waits_for("what `ros.wait` asks for")
    def wait(
        self, ready: Callable[[], object], within: float = WITHIN, needs: Callable[[], object] | None = None
    ) -> bool:
        """Wait until something is so, and tell whether it is: this records no outcome.

        Args:
            ready: what is waited for; anything true will do. It is asked again and again.
            within: seconds until it must have come. The wait ends earlier when every program has ended.
            needs: whether that is on the graph without which it cannot come. Once nothing new appears on the graph
                and it is still missing, the wait ends.

        Example:
            `came = ros.wait(lambda: heard.count >= 3, within=5)`
        """
        return self._wait(ready, within, needs)

    def pause(self, for_seconds: float) -> None:
        """Let the programs run for exactly so long: for experiments in which the length of a time matters.

        Args:
            for_seconds: how long, in seconds. To wait for something, use `wait` or an expectation.

        Example:
            `ros.pause(0.5)`
        """
        if for_seconds < 0:
            raise Misuse(f"pause: {for_seconds!r} is no time; it is a number of seconds, 0 or more.")
        self._observer.pause(for_seconds)

    def changes(self, *nodes: str) -> list[Change]:
        """State changes of lifecycle nodes so far, in the order of publication.

        Args:
            nodes: full names; by default all nodes that are watched.

        Example:
            `steps = [change.step for change in ros.changes("/camera")]`
        """
        return in_order([self._running.lifecycle_client(node) for node in nodes or self._running.lifecycle_clients])

    def runs(self) -> Runs:
        """What the programs' callbacks did so far, run by run: when, how long, on which thread, in which group.

        Seen from inside the programs, the first 2000 runs of each; a moment old.

        Example:
            `print(ros.runs().longest_pause("heartbeat"))`
        """
        return seen.runs(self._insides())

    def programs(self) -> list[Program]:
        """What this launch was asked to start, or what its launch file starts: programs with their arguments.

        Example:
            `starts = len(ros.programs())`
        """
        return list(self._running.described)

    def stop(self) -> None:
        """End a launch that `start` began, with all its programs.

        Example:
            `robot.stop()`
        """
        self._end()

    def log(self, program: str = "") -> Log:
        """Return what the programs, or one of them, have printed so far; also after the block.

        Args:
            program: its name; by default all of them.

        Example:
            `print(ros.log("talker"))`
        """
        return log_of([one for _, one in self._running.programs], program)

    def __repr__(self) -> str:
        if self._robot is not None and current.check.robot is self._robot:
            return str(self._robot)
        if self._over:
            return "This launch has ended; .log() says what its programs printed."
        names = ", ".join(f'"{node.program}"' for node in self._running.described) or "…"
        return f"launch({names}): begin a block with it, `with launch({names}) as ros:`"

    def _ipython_display_(self) -> None:
        """As the last line of a cell: run for a moment and show what happens."""
        here = current.check.front_end
        if self._entered or here is None:
            if here is None or self._robot is None or here.number != self._robot.cell:
                print(self)
            return
        try:
            with self:
                seen = try_out(self._running)
        except NotLaunchedError as reason:
            print(reason)
            return
        names = ", ".join(f'"{node.program}"' for node in self._running.described)
        print(f"{seen}\nTo look closer: with launch({names}) as ros: …")

    def part(self, title: str) -> AbstractContextManager[None]:
        """A block whose expectations give points of their own; see `autograder.checks.parts`.

        Args:
            title: what the part is called in the score and in the report.

        Example:
            `with ros.part("the name"): ros.node("/talker").expect()`
        """
        return part(title)

    def score(self, points: float | Mapping[str, float]) -> Score:
        """The score of the cell, over all its launches since the last score.

        Args:
            points: of the cell, all or nothing; or of each part, by its title.

        Example:
            `ros.score({"the name": 1, "the numbers": 2})`
        """
        return score(points)

    def _end(self) -> None:
        if self._over:
            return
        self._over = True
        try:
            # What still runs is ended here: how is no fact about the program.
            ended = {id(program): program.exit_status() for _, program in self._running.programs}
            self._look_back()
        finally:
            self._close()
        current.check.findings.logs += self._running.logs(ended)

    def _look_back(self) -> None:
        """Keep what only the running programs show: in a notebook for a picture, else what contradicts itself."""
        if current.check.front_end is not None:
            with contextlib.suppress(ForgedGraph):
                self._running.graph = seen.graph(self._observer)
            return
        varied = [node.may_vary_names() for node, _ in self._running.programs]
        current.check.findings.flags += contradictions.flags(self._scene(), self._running.overlaps, varied)

    def _close(self) -> None:
        """End the programs and everything that watched them."""
        try:
            if self._group is not None:
                self._group.end()
            if self._running.watcher is not None:
                self._running.watcher.close()
        finally:
            if current.check.block is self._robot:
                current.check.block = None
            if current.check.robot is self._robot:
                current.check.robot = None
            self._observer.close()
            remove_written(current.check.folder)
            remove_logs()
