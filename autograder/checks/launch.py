"""`launch`: starts a student's programs and an observer on a ROS domain of their own.

The arguments are those of a ROS launch description: program, namespace, name, remappings, parameters.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from autograder.arguments import params_file, remap_rules
from autograder.checks import contradictions, findings, outcomes, runtime
from autograder.checks.command_line import CommandLine, CommandLineError
from autograder.checks.expect.lifecycle import LifecycleExpectations
from autograder.checks.expect.messages import MessageExpectations
from autograder.checks.expect.programs import ProgramExpectations
from autograder.checks.expect.services import ServiceExpectations
from autograder.checks.parts import part
from autograder.checks.program import Node
from autograder.checks.scoring import Score, score
from autograder.checks.try_out import Log, log_of, try_out
from autograder.checks.waiting import NotLaunchedError, watched
from autograder.core.front_end import Watcher
from autograder.core.results import NodeLog
from autograder.diagnosis import Diagnosis
from autograder.graph.observer import Observer
from autograder.launch_files import LaunchFileError, read_launch_file, remove_written
from autograder.sandbox.environment import profile_environment, remove_logs
from autograder.sandbox.nodes import Program, ProgramGroup


@watched
class Launch(MessageExpectations, ServiceExpectations, LifecycleExpectations, ProgramExpectations):
    """A running launch: `ros` in a check cell."""

    def __init__(
        self,
        nodes: Sequence[Node],
        listen: Iterable[tuple[str, type]],
        serve: Iterable[tuple[Any, ...]],
        lifecycle: Iterable[str],
        file: tuple[str, Mapping[str, str], str] | None = None,
        programs: Mapping[str, Node] | None = None,
        includes: Mapping[str, str] | None = None,
        around: str = "",
    ) -> None:
        """Use `launch` or `launch_file`."""
        self.nodes = list(nodes)
        self._file = file
        self._stand_ins = dict(programs or {})
        self._includes, self._around = dict(includes or {}), around
        self._listen, self._serve, self._lifecycle = list(listen), list(serve), list(lifecycle)
        self.programs: list[tuple[Node, Program]] = []
        self._missing: list[str] = []
        self._trouble: list[Diagnosis] = []
        self._group: ProgramGroup | None = None
        self.watch: Watcher | None = None

    def __enter__(self) -> Launch:
        here = runtime.current.front_end
        if here is not None:
            here.ready()
        self.domain_id = runtime.current.next_domain()
        # The middleware reads its profile once, before the first participant of the process.
        os.environ.update(profile_environment())
        os.environ.pop("ROS_AUTOMATIC_DISCOVERY_RANGE", None)
        self.observer = Observer(self.domain_id, findings.current.patience)
        if here is not None:
            self.watch = here.watch(self.observer, lambda: [program for _, program in self.programs])
        self.prepare()
        try:
            self._group = runtime.current.sandbox.group()
            for topic, msg_type in self._listen:
                self.observer.record(topic, msg_type)
            for offer in self._serve:
                self.serve(*offer)
            for node in self._lifecycle:
                self.watch_transitions(node)
            for launched in self.nodes or self._from_file():
                self.start(launched)
            if here is not None and self._trouble and not here.scored:  # what only listens would never say so
                raise NotLaunchedError(self._trouble[0])
        except BaseException:
            self._end()
            raise
        return self

    def _from_file(self) -> list[Node]:
        """What the student's launch file starts; nothing when it cannot be read, which every expectation then tells."""
        if self._file is None:
            return []
        name, arguments, package = self._file

        def find(wanted: str) -> Path:
            if wanted != package:
                raise KeyError(wanted)
            return folder

        folder = runtime.current.folder.resolve()
        programs = set(self._stand_ins) or {path.stem for path in folder.glob("*.py")}
        runtime.current.use(name)
        try:
            found = read_launch_file(folder / name, arguments, find, programs, self._includes, self._around)
        except LaunchFileError as error:
            self._trouble.append(Diagnosis(str(error), "launch-file", error.hint))
            return []
        self.nodes = [
            Node(
                one.program,
                ros_arguments=one.ros_arguments(),
                arguments_of_its_own=one.arguments,
                environment=one.environment,
                warnings=one.warnings,
            )
            for one in found
        ]
        self.nodes = [self._stand_in(node) for node in self.nodes]
        return self.nodes

    def _stand_in(self, node: Node) -> Node:
        """The course's own program in place of the student's, if the check has one, started with the same words."""
        course = self._stand_ins.get(node.program)
        if course is None:
            return node
        own = [*course.arguments_of_its_own, *node.arguments_of_its_own]
        return replace(node, program=course.program, arguments_of_its_own=own)

    def start(self, node: Node | str) -> None:
        """Start one more program.

        Args:
            node: a program's name, or a `Node` with arguments.
        """
        launched = Node(node) if isinstance(node, str) else node
        runtime.current.use(f"{launched.program}.py")
        if launched.params_file:
            runtime.current.use(launched.params_file)
        if not runtime.current.has(f"{launched.program}.py"):
            self._miss(launched.program)
            return
        environment = {**launched.environment, **profile_environment(), "ROS_DOMAIN_ID": str(self.domain_id)}
        try:
            words = launched.arguments()
        except CommandLineError as error:
            self._trouble.append(Diagnosis(error.because, error.code, error.hint))
            return
        refused = remap_rules.refused_parameter(words)
        if refused:
            self._trouble.append(Diagnosis(*refused))
            return
        unreadable = params_file.unreadable(words, runtime.current.folder)
        if unreadable is not None:
            hint = "Look at the indentation there, and at brackets and quotation marks."
            self._trouble.append(Diagnosis(unreadable.because, "params-file", hint))
            return
        assert self._group is not None  # begun on entering
        program = self._group.start(launched.program, words, environment, cores=launched.cores)
        self.programs.append((launched, program))

    def _miss(self, program: str) -> None:
        """No cell has written this program."""
        here = runtime.current.front_end
        if here is None:
            self._missing.append(program)
            return
        because, hint = here.why_missing("node", program)
        self._trouble.append(Diagnosis(because, "program-missing", hint))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        try:
            return outcomes.ends_block(error)
        finally:
            self._end()

    def log(self, program: str = "") -> Log:
        """Return what the programs, or one of them, have printed so far; also after the block."""
        return log_of(self, program)

    def pause(self, seconds: float) -> None:
        """Let the programs run for so many seconds, and show what they print: for experiments, not for checks."""
        self.observer.pause(seconds)

    def __repr__(self) -> str:
        names = ", ".join(f'"{node.program}"' for node in self.nodes) or "…"
        return f"launch({names}): begin a block with it, `with launch({names}) as ros:`"

    def _ipython_display_(self) -> None:
        """As the last line of a cell: run for a moment and show what happens."""
        if self.programs or runtime.current.front_end is None:
            print(self)
        else:
            try_out(self)

    def part(self, title: str) -> AbstractContextManager[None]:
        """A block whose expectations give points of their own; see `autograder.checks.parts`."""
        return part(title)

    def score(self, points: float | Mapping[str, float]) -> Score:
        """The score of the cell, over all its launches since the last score: all or nothing, or points by part."""
        return score(points)

    def _end(self) -> None:
        # What still runs is ended here: how is no fact about the program.
        ended = {id(program): program.exit_status() for _, program in self.programs}
        if runtime.current.front_end is None:
            varied = [
                bool(node.parameters or node.params_file or node.arguments_of_its_own) for node, _ in self.programs
            ]
            findings.current.flags += contradictions.flags(self.scene(), self.overlaps, varied)
        try:
            if self._group is not None:
                self._group.end()
            if self.watch is not None:
                self.watch.close()
        finally:
            findings.current.patience = self.observer.patience
            self.observer.close()
            remove_written(runtime.current.folder)
            remove_logs()
        for launched, program in self.programs:
            findings.current.logs.append(
                NodeLog(
                    program=launched.program,
                    text=program.output(),
                    truncated=program.truncated(),
                    exit_status=ended[id(program)],
                    stopped_by=program.stopped_by(),
                )
            )


def launch(
    *programs: str | Node,
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
) -> Launch:
    """Describe a launch; `with` starts it and ends it.

    Args:
        programs: names of programs (`%%node NAME`), or `Node`s with arguments of their own.
        namespace: for all programs, such as `/rear_camera`.
        name: node name, as `-r __node:=NAME`.
        remappings: remap rules, first match wins.
        parameters: initial values.
        params_file: a parameter file of the student's.
        use_sim_time: take time from `/clock`, which `ros.advance` drives.
        ros_arguments: further words after `--ros-args`, for programs that have none of their own; a `command_line` is
            what the student typed.
        cores: CPUs that each program may use.
        listen: (topic, message class) to record from before the start.
        serve: (service, class, answer, delay in seconds) that the observer offers.
        lifecycle: full names of lifecycle nodes whose transition events are recorded from before the start.
    """
    given = dict(parameters or {})
    if use_sim_time:
        given["use_sim_time"] = True
    nodes = []
    for program in programs:
        node = Node(program) if isinstance(program, str) else program
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
    return Launch(nodes, listen, serve, lifecycle)


def launch_file(
    file: str,
    arguments: Mapping[str, str] | None = None,
    *,
    package: str,
    namespace: str = "",
    programs: Mapping[str, Node] | None = None,
    includes: Mapping[str, str] | None = None,
    listen: Iterable[tuple[str, type]] = (),
    lifecycle: Iterable[str] = (),
) -> Launch:
    """Describe the launch that a student's launch file describes; `with` starts it and ends it.

    Args:
        file: a launch file in ROS 2's YAML schema, such as `vehicle.launch.yaml`.
        arguments: launch arguments, as `name:=value` after `ros2 launch PACKAGE FILE`.
        package: the name of the package that the student's programs are said to be in.
        namespace: as if a launch file included this one after `push_ros_namespace` with it.
        programs: the course's own program to start where the file says `exec: NAME`, by that name.
        includes: the course's own launch file to read where the file includes NAME, by that name; it may start any
            program of the lab.
        listen: (topic, message class) to record from before the start.
        lifecycle: full names of lifecycle nodes whose transition events are recorded from before the start.
    """
    return Launch([], listen, (), lifecycle, (file, dict(arguments or {}), package), programs, includes, namespace)
