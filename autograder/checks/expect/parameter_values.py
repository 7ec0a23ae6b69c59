"""Why a parameter does not exist, or has another value than the one asked for, and where its value comes from."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

from autograder.arguments import params_file, remap_rules
from autograder.arguments.remap_rules import PARAMETER_VALUE
from autograder.checks import current
from autograder.checks.program import Program
from autograder.checks.running_launch import RunningLaunch
from autograder.diagnosis import Scene
from autograder.graph import parameters
from autograder.graph.names import nearest
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind, Reason

PARAMETER_UNDECLARED = Kind("parameter-undeclared", "the node has no parameter of this name", Group.STATES)
LAUNCH_ARGUMENT = Kind(
    "launch-argument", "the launch was given an argument that the launch file does not have", Group.STATES
)
PARAMS_FILE_MISSING = Kind(
    "params-file-missing", "the launch file names a parameter file that is not there", Group.STATES
)
PARAMETER_AS_RULE = Kind(
    "parameter-as-rule", "the value was given with `-r`, which only renames topics and services", Group.STATES
)
PARAMETER_FOR_OTHERS = Kind("parameter-for-others", "the value was given to a node of another name", Group.STATES)
PARAMS_FILE_KEY = Kind("params-file-key", "no key of the parameter file is this node's name", Group.STATES)

_EVERY_NODE = ("use_sim_time", "start_type_description_service")
"""Parameters that rclpy declares for every node."""
_KINDS = {bool: "a bool", int: "an integer", float: "a double", str: "a string", type(None): "without a value"}
_WITHIN = 2.0


def own(declared: Collection[str]) -> list[str]:
    """Return the parameters of a node that rclpy did not declare for it."""
    return [name for name in declared if name not in _EVERY_NODE and "qos_overrides" not in name]


def undeclared(node: str, name: str, declared: Collection[str]) -> Reason:
    """That a node has not declared a parameter, and what it has; or that it declared it without a value."""
    has = own(declared)
    if name in has:
        because = f"`{node}` has declared `{name}` without a default, and nothing gave it a value."
        return PARAMETER_VALUE(because, "The second argument of `declare_parameter` is the default.")
    return PARAMETER_UNDECLARED(
        f"`{node}` has not declared a parameter `{name}`" + (f"; it has {', '.join(has)}." if has else "."),
        "A value that is given when the node starts only reaches parameters that the node has declared.",
    )


def why_other(running: RunningLaunch, node: str, name: str, found: Any, wanted: Any) -> Reason:
    """Why the parameter `name` of `node` is `found` and not `wanted`: a reason that is established, or what it is."""
    scene = running.scene()
    programs = _programs_of(running, scene, node)
    reasons: tuple[Callable[[], Reason | None], ...] = (
        lambda: _file_for_others(programs, node),
        lambda: _given_as_a_rule(programs, name),
        lambda: _given_to_another(programs, node, name),
        lambda: _given_by_another_name(running, programs, node, name, found),
        lambda: _given_twice(programs, name, found),
        lambda: _no_such_argument(running, found),
    )
    found_it = next((reason for ask in reasons if (reason := ask())), None)
    return found_it or _other_value(found, wanted, _origin(scene, programs, node, name))


def _programs_of(running: RunningLaunch, scene: Scene, node: str) -> list[Program]:
    """Return the programs that have this node according to their probes; all programs if no probe knows it.

    What the launch gives to another program does not reach this node, so it explains none of the node's values.
    """
    having = scene.inside_of(node)
    programs = [launched for launched, _ in running.programs]
    return [launched for launched, inside in zip(programs, scene.insides, strict=True) if inside in having]


def _given_as_a_rule(programs: Sequence[Program], name: str) -> Reason | None:
    """Whether the parameter was given with `-r`, as if it were a remap rule."""
    for launched in programs:
        for text in launched.all_rules():
            rule = remap_rules.parse(text)
            if rule and rule.left == name:
                because = f"`{text}` is given as a remap rule; such rules rename topics and services, not parameters."
                return PARAMETER_AS_RULE(because, f"Give it as a parameter: `-p {text}`.")
    return None


def _given_to_another(programs: Sequence[Program], node: str, name: str) -> Reason | None:
    """Whether `-p NODE:name:=value` was meant for this node: a node's name there is one in the namespace `/`."""
    for launched in programs:
        for text in launched.parameter_rules():
            meant, _, parameter = text.partition(":=")[0].rpartition(":")
            if parameter == name and meant and f"/{meant}" != node:
                because = f"`-p {text}` is for the node `/{meant}`, but this node is `{node}`."
                hint = "Remove the node name; the value then applies to every node of the process."
                return PARAMETER_FOR_OTHERS(because, hint)
    return None


def _given_by_another_name(
    running: RunningLaunch, programs: Sequence[Program], node: str, name: str, found: Any
) -> Reason | None:
    """Whether values were given under names that the node has not declared, and none under this one."""
    given = {one for launched in programs for one in _given(launched, node)}
    if name in given or not given:
        return None
    try:
        declared = own(parameters.list_parameters(running.observer, node, _WITHIN, running.all_ended))
    except (ServiceMissing, parameters.NoAnswer):
        return None
    strange = sorted(given - set(declared))
    if not strange:
        return None
    short = [one for one in strange if name.endswith(one)]
    one = nearest(name, strange) or (short or strange)[0]
    return PARAMETER_UNDECLARED(
        f"It is {found!r}. A value was given for `{one}`, which `{node}` has not declared; it has "
        f"{', '.join(declared)}.",
        "ROS 2 silently ignores values for parameters that are not declared.",
    )


def _given_twice(programs: Sequence[Program], name: str, found: Any) -> Reason | None:
    """Whether `-p` gives the parameter more than one value: unlike with remap rules, the last one counts."""
    for launched in programs:
        given = [text for text in launched.parameter_rules() if text.partition(":=")[0] == name]
        if len(given) > 1:
            because = f"It is {found!r}: `-p` gives `{name}` {len(given)} values, and the last one counts."
            return PARAMETER_VALUE(because, "Give it once.")
    return None


def _given(launched: Program, node: str) -> Iterator[str]:
    """Return the names of the parameters to which a program's arguments and files give values for this node."""
    for text in launched.parameter_rules():
        meant, _, parameter = text.partition(":=")[0].rpartition(":")
        if not meant or f"/{meant}" == node:
            yield parameter
    for option, file in itertools.pairwise(launched.arguments()):
        if option == "--params-file":
            yield from params_file.names_for(params_file.text_of(current.check.folder, file), node)


def _no_such_argument(running: RunningLaunch, found: Any) -> Reason | None:
    """Whether the launch was given arguments that the launch file does not have."""
    unused = running.unused_arguments()
    if not unused:
        return None
    given = ", ".join(f"`{name}`" for name in unused)
    return LAUNCH_ARGUMENT(
        f"It is {found!r}. The launch was given {given}, and the launch file has no argument of that name.",
        "Declare it with `- arg:` and a `name`; `ros2 launch` silently ignores arguments that are not declared.",
    )


def _file_for_others(programs: Sequence[Program], node: str) -> Reason | None:
    """Whether the parameter files that these programs are given have nothing for this node."""
    for launched in programs:
        if launched.warnings:
            hint = "Write `$(dirname)/NAME.yaml`; NAME is a cell's `%%file`."
            if "the build installs no" in launched.warnings[0]:
                hint = "Compare the path with `data_files` in setup.py: only the files listed there are installed."
            return PARAMS_FILE_MISSING(f"{launched.warnings[0]} The node started without it.", hint)
        for option, file in itertools.pairwise(launched.arguments()):
            if option != "--params-file":
                continue
            because = params_file.why_not_reached(params_file.text_of(current.check.folder, file), node)
            if because:
                hint = "The key is the node's full name, namespace included; `/**/NAME` is a node in every namespace."
                return PARAMS_FILE_KEY(because, hint)
    return None


def _origin(scene: Scene, programs: Sequence[Program], node: str, name: str) -> str:
    """Return a sentence that says where a parameter has its value from, or an empty text if that was not seen."""
    for launched in programs:
        for text in launched.parameter_rules():
            meant, _, parameter = text.partition(":=")[0].rpartition(":")
            if parameter == name and (not meant or f"/{meant}" == node):
                return f" `-p {text}` gave it this value."
        for option, file in itertools.pairwise(launched.arguments()):
            if option == "--params-file" and name in params_file.names_for(
                params_file.text_of(current.check.folder, file), node
            ):
                return f" `{Path(file).name}` gave it this value."
    for inside in scene.insides:
        for seen in inside.parameters:
            line = inside.source.declares(name)
            if (seen.node, seen.name) == (node, name) and seen.sets:
                return f" `{inside.name}` or a request has set it since the node started."
            if (seen.node, seen.name) == (node, name) and line:
                declared = inside.source.line(line)
                return f" Nothing gave it a value, so it has its default: {inside.name}.py:{line} (`{declared}`)."
    return ""


def _other_value(found: Any, wanted: Any, origin: str) -> Reason:
    """Say which value the parameter has instead, where it comes from, and whether its type differs."""
    kind, asked = _KINDS.get(type(found), "a list"), _KINDS.get(type(wanted), "a list")
    if kind == asked:
        return PARAMETER_VALUE(f"It is {found!r}.{origin}")
    return PARAMETER_VALUE(
        f"It is {found!r}, {kind}, and not {asked}.{origin}",
        "40 is an integer, 40.0 a double, '40' a string. If a value does not have the declared type, the "
        "node ends when it starts.",
    )
