"""The verbs of `ros2 param`."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import get_parameter_value, parameter_dict_from_yaml_file, parameter_value_to_python

from autograder.ros2.failure import Failure
from autograder.ros2.node import absolute, find_node
from autograder.ros2.options import add_graph_options
from autograder.ros2.session import Session, ask

_ANSWER_WITHIN = 5.0
"""The seconds that a node may take to list its parameters; the real tool waits only one second."""

_KINDS = {
    ParameterType.PARAMETER_NOT_SET: "not set",
    ParameterType.PARAMETER_BOOL: "boolean",
    ParameterType.PARAMETER_INTEGER: "integer",
    ParameterType.PARAMETER_DOUBLE: "double",
    ParameterType.PARAMETER_STRING: "string",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte array",
    ParameterType.PARAMETER_BOOL_ARRAY: "boolean array",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer array",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double array",
    ParameterType.PARAMETER_STRING_ARRAY: "string array",
}


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 param` to the parser."""
    parser = _verb(verbs, "list", "Output a list of available parameters", _list, node=False)
    parser.add_argument("node_name", nargs="?", help="Name of the ROS node")
    parser.add_argument("--param-prefixes", nargs="+", default=[], help="Only list parameters with these prefixes")
    parser.add_argument("--param-type", action="store_true", help="Print parameter types with parameter names")
    parser.add_argument("--filter", metavar="REGEX", type=_regex, help="Only list parameters that begin like this")
    parser = _verb(verbs, "get", "Get parameter", _get)
    parser.add_argument("parameter_name", help="Name of the parameter")
    parser.add_argument("--hide-type", action="store_true", help="Hide the type information")
    parser = _verb(verbs, "set", "Set parameter", _set)
    parser.add_argument("parameter_name", help="Name of the parameter")
    parser.add_argument("value", help="Value of the parameter")
    parser = _verb(verbs, "describe", "Show descriptive information about declared parameters", _describe)
    parser.add_argument("parameter_names", nargs="+", help="Names of the parameters")
    _verb(verbs, "dump", "Show all of the parameters of a node in a YAML file format", _dump)
    parser = _verb(verbs, "load", "Load parameter file for a node", _load)
    parser.add_argument("parameter_file", type=Path, help="Parameter file")
    parser.add_argument("--no-use-wildcard", action="store_true", help="Do not load parameters in '/**'")
    parser = _verb(verbs, "delete", "Delete parameter", _delete)
    parser.add_argument("parameter_name", help="Name of the parameter")


def _verb(verbs: Any, name: str, text: str, run: Any, node: bool = True) -> Any:
    parser = add_graph_options(verbs.add_parser(name, help=text))
    if node:
        parser.add_argument("node_name", help="Name of the ROS node")
    parser.add_argument("--include-hidden-nodes", action="store_true", help="Consider hidden nodes as well")
    parser.add_argument("--timeout", metavar="N", type=int, default=1, help="Wait N seconds for the node (default: 1)")
    parser.set_defaults(run=run)
    return parser


def _regex(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a regular expression: {error}") from None


def _found(session: Session, options: Any) -> str:
    name = absolute(options.node_name)
    find_node(session, name, options.include_hidden_nodes, "Node not found", options.timeout)
    return name


def _names(session: Session, node: str, prefixes: list[str]) -> list[str]:
    request = ListParameters.Request(prefixes=prefixes)
    answer = ask(session, node, "list_parameters", ListParameters, request, _ANSWER_WITHIN)
    if answer is None:
        raise Failure(f"Exception while calling service of node '{node}': None")
    return sorted(answer.result.names)


def _values(session: Session, node: str, names: list[str]) -> list[ParameterValue]:
    return list(ask(session, node, "get_parameters", GetParameters, GetParameters.Request(names=names)).values)


def _descriptors(session: Session, node: str, names: list[str]) -> list[Any]:
    request = DescribeParameters.Request(names=names)
    return list(ask(session, node, "describe_parameters", DescribeParameters, request).descriptors)


def _list(session: Session, options: Any) -> None:
    if options.node_name:
        nodes = [_found(session, options)]
    else:
        services = dict(session.services(hidden=True))
        every = dict.fromkeys(session.node_names(options.include_hidden_nodes))
        nodes = [name for name in every if f"{name}/list_parameters" in services]
    for node in nodes:
        if not options.node_name:
            print(f"{node}:")
        try:
            names = _names(session, node, options.param_prefixes)
            names = [name for name in names if options.filter is None or options.filter.match(name)]
        except Failure as failure:  # the other nodes may answer
            print(failure, file=sys.stderr)
            continue
        kinds = {}
        if options.param_type:
            kinds = {one.name: f" (type: {_KINDS[one.type]})" for one in _descriptors(session, node, names)}
        for name in names:
            print(f"  {name}{kinds.get(name, '')}")


def _plain(value: ParameterValue) -> Any:
    """Convert a value to a Python value, in which arrays are lists."""
    found = parameter_value_to_python(value)
    return list(found) if value.type >= ParameterType.PARAMETER_BYTE_ARRAY else found


def _get(session: Session, options: Any) -> None:
    values = _values(session, _found(session, options), [options.parameter_name])
    if not values:
        raise Failure("Parameter not set")
    if values[0].type == ParameterType.PARAMETER_NOT_SET:  # the parameter is declared, but has no value yet
        print(None if options.hide_type else "Parameter not set.")
        return
    kind = _KINDS[values[0].type].capitalize()
    label = f"{kind.removesuffix(' array')} values are:" if kind.endswith(" array") else f"{kind} value is:"
    print(*([] if options.hide_type else [label]), _plain(values[0]))


def _set_one(session: Session, node: str, name: str, value: ParameterValue) -> Any:
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    results = ask(session, node, "set_parameters", SetParameters, request).results
    if not results:
        raise Failure("Setting parameter failed: the node gave no answer")
    return results[0]


def _say(result: Any, what: str) -> None:
    reason = f": {result.reason}" if result.reason else ""
    print(f"{what}{reason}", file=sys.stdout if result.successful else sys.stderr)


def _set(session: Session, options: Any) -> None:
    value = get_parameter_value(options.value)
    result = _set_one(session, _found(session, options), options.parameter_name, value)
    _say(result, "Set parameter successful" if result.successful else "Setting parameter failed")


def _delete(session: Session, options: Any) -> None:
    node, name = _found(session, options), options.parameter_name
    result = _set_one(session, node, name, ParameterValue(type=ParameterType.PARAMETER_NOT_SET))
    _say(result, "Deleted parameter successfully" if result.successful else "Deleting parameter failed")


def _describe(session: Session, options: Any) -> None:
    for one in _descriptors(session, _found(session, options), options.parameter_names):
        print(f"Parameter name: {one.name}\n  Type: {_KINDS[one.type]}")
        if one.description:
            print(f"  Description: {one.description}")
        print("  Constraints:")
        if one.read_only:
            print("    Read only: true")
        for limits in [*one.floating_point_range, *one.integer_range][:1]:
            print(f"    Min value: {limits.from_value}\n    Max value: {limits.to_value}")
            if limits.step:
                print(f"    Step: {limits.step}")
        if one.additional_constraints:
            print(f"    Additional constraints: {one.additional_constraints}")


def _dump(session: Session, options: Any) -> None:
    node = _found(session, options)
    names = _names(session, node, [])
    nested: dict[str, Any] = {}
    for name, value in zip(names, _values(session, node, names), strict=False):
        *above, last = name.split(".")
        place = nested
        for part in above:
            place = place.setdefault(part, {})
        place[last] = _plain(value)
    print(yaml.safe_dump({node: {"ros__parameters": nested}}, default_flow_style=False))


def _load(session: Session, options: Any) -> None:
    node = _found(session, options)
    try:
        found = parameter_dict_from_yaml_file(
            str(options.parameter_file), not options.no_use_wildcard, target_nodes=[node]
        )
    except OSError as error:
        raise Failure(f"{options.parameter_file}: {error.strerror}") from None
    except (RuntimeError, yaml.YAMLError, AttributeError, TypeError) as error:
        raise Failure(str(error)) from None
    for name, parameter in found.items():
        result = _set_one(session, node, name, parameter.value)
        _say(result, f"Set parameter {name} {'successful' if result.successful else 'failed'}")
