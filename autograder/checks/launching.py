"""`launch` and `launch_file`: describe what a check starts.

The arguments are those of a ROS launch description: program, namespace, name, remappings, parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from autograder.checks.command_line import CommandLine
from autograder.checks.launch import Launch
from autograder.checks.launched_file import LaunchedFile
from autograder.checks.misuse import refuse_text
from autograder.checks.program import Program


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
    """
    refuse_text("launch", packages=packages, remappings=remappings)
    given = dict(parameters or {})
    if use_sim_time:
        given["use_sim_time"] = True
    nodes = []
    for program in programs:
        node = Program(program) if isinstance(program, str) else program
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
    return Launch(nodes, listen, serve, lifecycle, packages=list(needed))


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
    """
    described = LaunchedFile(
        file, dict(arguments or {}), package, dict(programs or {}), dict(includes or {}), namespace
    )
    return Launch([], listen, (), lifecycle, described)
