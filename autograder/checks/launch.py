"""`launch` and `launch_file`, and what they give: the student's programs and an observer, on a domain of their own.

The arguments are those of a ROS launch description: program, namespace, name, remappings, parameters.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from types import TracebackType
from typing import Any, Self

from autograder.checks import contradictions, current, outcomes, picture_data
from autograder.checks.building import why_no_package, why_not_found
from autograder.checks.command_line import CommandLine
from autograder.checks.launch_file import LaunchFile
from autograder.checks.misuse import Misuse, refuse_no_rules, refuse_other_class, refuse_text
from autograder.checks.program import Program, file_of, refuse_to_start, why_missing, words_of
from autograder.checks.recording import record
from autograder.checks.robot import Log, Robot, end_robot, log_of, try_out
from autograder.checks.ros import Ros
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.scoring import Score, part, score
from autograder.checks.waiting import NotLaunchedError
from autograder.checks.world import World, told_by_others
from autograder.core.processes import no_threads
from autograder.graph.domains import claim_domain
from autograder.graph.observer import ForgedGraph, Observer
from autograder.launch_files import remove_written
from autograder.reasons import Reason, Refused
from autograder.sandbox.environment import profile_environment, remove_logs
from autograder.sandbox.running_programs import RunningPrograms

_PROBE_WRITES = 0.3
"""Seconds after which the probe of a program has written what it saw last, so that a picture has the end of a run."""


class Launch(Ros):
    """A running launch: `ros` in a check cell. What can be asked of it stands in `autograder/checks/ros.py`."""

    def __init__(
        self,
        nodes: Sequence[Program],
        listen: Iterable[tuple[str, type]],
        serve: Iterable[tuple[Any, ...]],
        lifecycle: Iterable[str],
        file: LaunchFile | None = None,
        packages: Sequence[str] = (),
        world: World | str | None = None,
    ) -> None:
        """Use `launch` or `launch_file`."""
        super().__init__(RunningLaunch())
        refuse_text("launch", listen=listen, serve=serve, lifecycle=lifecycle)
        self._listen, self._serve, self._lifecycle = list(listen), list(serve), list(lifecycle)
        for topic, msg_type in self._listen:
            refuse_other_class(f'launch: listen, "{topic}"', msg_type, "message")
        self._packages = [*packages, *(file.packages() if file else ())]
        self._running.described = list(nodes)
        self._file = file
        self._world = World(world) if isinstance(world, str) else world
        self._group: RunningPrograms | None = None
        self._robot: Robot | None = None
        self._entered = False

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
        if self._world is not None:
            if self._world.room.endswith(".yaml"):
                current.check.use(self._world.room)
            self._running.world = self._world.start(self._observer.domain_id)
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
            end_robot()
            current.check.robot = robot = self._enter()
            try:
                robot.wait_for_nodes()
            except BaseException:  # the cell has no name for it yet, by which it could be stopped
                robot.stop()
                raise
            print(robot)
        elif self._group is not None:
            self._running.refuse_if_over()
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
        prefixes = [current.check.prefix(package) for package in self._packages]
        program = self._group.start(
            launched.program, words, environment, cores=launched.cores, file=file, prefixes=prefixes,
            assume_success=launched.assume_success,
        )  # fmt: skip
        self._running.programs.append((launched, program))
        if outcomes.in_hidden_lines():
            self._running.of_hidden_tests.append(program)

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

    def stop(self) -> None:
        """End a launch that `start` began, with all its programs.

        Example:
            `robot.stop()`
        """
        self._end()

    def show(
        self,
        listen: Iterable[tuple[str, type]] = (),
        *,
        scan: str = "",
        buttons: Mapping[str, Callable[[], object]] | None = None,
    ) -> None:
        """Show the world of the launch live, below the cell, while the cells after it go on.

        It stops with the launch; then the picture of the world with the trails takes its place. At grading it does
        nothing.

        Args:
            listen: (topic, message class) of further topics: the view shows their rates and their last messages.
            scan: the relative name of the topic whose rays are shown, as long as scans come on it; by default the
                rays are those of the world's own lidar.
            buttons: what each further button of the view does when it is clicked, by the words on it; a text that is
                returned is told below the picture.

        Example:
            `robot.show(buttons={"Cancel": lambda: goal.cancel()})`
        """
        here, topics = current.check.front_end, list(listen)
        for topic, msg_type in topics:
            refuse_other_class(f'show: listen, "{topic}"', msg_type, "message")
        if self._world is None:
            raise Misuse('show: this launch has no world; write launch(…, world="room").')
        if not self._entered or self._running.over:
            raise Misuse("show: nothing runs; begin with robot = launch(…).start(), then robot.show().")
        if here is None:
            return
        if self._running.view is not None:
            self._running.view.close()
        self._running.view = here.show(self._running, topics, scan, buttons or {})

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
        if self._running.over:
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
        """A block whose expectations give points of their own; see `autograder.checks.scoring`.

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
        if self._running.over:
            return
        self._running.over = True
        try:
            # What still runs is ended here: how is no fact about the program.
            ended = {id(program): program.exit_status() for _, program in self._running.programs}
            self._look_back()
        finally:
            self._close()
        current.check.findings.logs += self._running.logs(ended)

    def _look_back(self) -> None:
        """Keep what only the running programs show: in a notebook for a picture, else what contradicts itself."""
        if current.check.records is not None and self._running.programs:
            with contextlib.suppress(ForgedGraph, ValueError):  # a program may have told nonsense of itself
                current.check.records.append(record(self._running, self._insides()))
        here = current.check.front_end
        if here is not None:
            with contextlib.suppress(ForgedGraph):
                self._running.graph = picture_data.graph(self._observer)
            # A check draws its picture when it fails, and a student should not wait for what nobody looks at.
            if not here.scored and any(program.running() for _, program in self._running.programs):
                self._observer.pause(_PROBE_WRITES)
            return
        varied = [node.may_vary_names() for node, _ in self._running.programs]
        if self._running.world is not None:
            current.check.findings.flags += told_by_others(self._running.world, self._observer)
        current.check.findings.flags += contradictions.flags(self._scene(), self._running.overlaps, varied)

    def _close(self) -> None:
        """End the programs and everything that watched them."""
        try:
            if self._group is not None:
                self._group.end()
            if self._running.watcher is not None:
                self._running.watcher.close()
            if self._running.view is not None:
                self._running.view.close()
            if self._running.world is not None:
                self._running.world.close()
        finally:
            if current.check.block is self._robot:
                current.check.block = None
            if current.check.robot is self._robot:
                current.check.robot = None
            self._observer.close()
            remove_written(current.check.folder)
            remove_logs()


def launch(
    *programs: str | Program,
    namespace: str = "",
    name: str = "",
    remappings: Sequence[tuple[str, str]] = (),
    parameters: Mapping[str, Any] | None = None,
    params_file: str = "",
    use_sim_time: bool = False,
    ros_arguments: Sequence[str] | CommandLine = (),
    cores: int = 2,
    listen: Iterable[tuple[str, type]] = (),
    serve: Iterable[tuple[str, type, Callable[[Any, Any], Any], float] | tuple[Any, ...]] = (),
    lifecycle: Iterable[str] = (),
    packages: Sequence[str] = (),
    world: World | str | None = None,
) -> Launch:
    """Describe a launch; `with` starts it and ends it.

    Args:
        programs: names of programs (`%%node NAME`), or `Program`s with arguments of their own.
        namespace: for all programs, such as `/rear_camera`.
        name: node name, as `-r __node:=NAME`.
        remappings: remap rules, first match wins.
        parameters: initial values.
        params_file: a parameter file of the student's.
        use_sim_time: take time from `/clock`, which `ros.clock.advance` drives.
        ros_arguments: further words after `--ros-args`, for programs that have none of their own; a `command_line` is
            what the student typed.
        cores: CPUs that each program may use.
        listen: (topic, message class) to record from before the start.
        serve: (service, class, answer, delay in seconds) that the observer offers.
        lifecycle: full names of lifecycle nodes whose transition events are recorded from before the start.
        packages: packages of the student's that the programs import from; each is built first.
        world: the world that the programs drive in, or the name of its room, such as `room`.
    """
    refuse_text("launch", packages=packages)
    refuse_no_rules("launch", remappings)
    given = dict(parameters or {})
    if use_sim_time:
        given["use_sim_time"] = True
    nodes = []
    for program in programs:
        node = program if isinstance(program, Program) else Program(program)
        nodes.append(
            replace(
                node,
                namespace=node.namespace or namespace,
                name=node.name or name,
                remappings=[*node.remappings, *remappings],
                parameters={**given, **node.parameters},
                params_file=node.params_file or params_file,
                ros_arguments=node.ros_arguments or ros_arguments,
                cores=min(node.cores, cores),
            )
        )
    needed = dict.fromkeys([*packages, *(node.package for node in nodes if node.package)])
    return Launch(nodes, listen, serve, lifecycle, packages=list(needed), world=world)


def launch_file(
    file: str,
    arguments: Mapping[str, str] | None = None,
    *,
    package: str,
    namespace: str = "",
    programs: Mapping[str, Program] | None = None,
    includes: Mapping[str, str] | None = None,
    listen: Iterable[tuple[str, type]] = (),
    lifecycle: Iterable[str] = (),
    world: World | str | None = None,
) -> Launch:
    """Describe the launch that a student's launch file describes; `with` starts it and ends it.

    Args:
        file: a launch file in ROS 2's YAML schema, such as `vehicle.launch.yaml`. Of a package that is built it is
            the installed one, as `ros2 launch PACKAGE FILE` finds it: anywhere below `share/PACKAGE`.
        arguments: launch arguments, as `name:=value` after `ros2 launch PACKAGE FILE`.
        package: the name of the package that the student's programs are said to be in.
        namespace: as if a launch file included this one after `push_ros_namespace` with it.
        programs: the course's own program to start where the file says `exec: NAME`, by that name.
        includes: the course's own launch file to read where the file includes NAME, by that name; it may start any
            program of the lab.
        listen: (topic, message class) to record from before the start.
        lifecycle: full names of lifecycle nodes whose transition events are recorded from before the start.
        world: the world that the programs drive in, or the name of its room, such as `room`.
    """
    described = LaunchFile(file, dict(arguments or {}), package, dict(programs or {}), dict(includes or {}), namespace)
    return Launch([], listen, (), lifecycle, described, world=world)
