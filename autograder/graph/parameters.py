"""Reads and sets a node's parameters through its parameter services."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from autograder.graph.observer import Observer
from autograder.graph.services import ServiceMissing, call_all

GiveUp = Callable[[], bool]


class NoAnswer(Exception):
    """The node's service exists, but did not answer in time, because nothing spins the node or it is stuck."""


def _call(
    observer: Observer, node: str, service: str, srv_type: type, request: Any, within: float, give_up: GiveUp
) -> Any:
    # A first request can get lost while the two sides are still being matched; these requests are safe to repeat.
    for second in (False, True):
        try:
            answer = call_all(observer, f"{node}/{service}", srv_type, [request], within / 2, give_up)[0]
        except ServiceMissing:
            if second or give_up():
                raise
            continue  # the node may have all of the time to start
        if answer.response is not None:
            return answer.response
        if give_up():
            break
    raise NoAnswer(node)


def get_parameters(
    observer: Observer, node: str, names: Sequence[str], within: float, give_up: GiveUp = lambda: False
) -> Mapping[str, Any]:
    """Return the values of the named parameters, except those that are not declared.

    Raises:
        ServiceMissing: there is no such node, or it has no parameter services.
        NoAnswer: the node did not answer within `within` seconds.
    """
    found = {}
    for name in names:
        # Each is requested alone, because rclpy answers with an empty list if any parameter in a request is undeclared.
        request = GetParameters.Request(names=[name])
        values = _call(observer, node, "get_parameters", GetParameters, request, within, give_up).values
        # A program may offer a service of its own in place of its node's, and answer with types that do not exist.
        if values and ParameterType.PARAMETER_NOT_SET < values[0].type <= ParameterType.PARAMETER_STRING_ARRAY:
            found[name] = parameter_value_to_python(values[0])
    return found


def list_parameters(observer: Observer, node: str, within: float, give_up: GiveUp = lambda: False) -> list[str]:
    """Return the sorted names of all declared parameters. Raise the same exceptions as `get_parameters`."""
    reply = _call(observer, node, "list_parameters", ListParameters, ListParameters.Request(), within, give_up)
    return sorted(reply.result.names)


def set_parameter(
    observer: Observer, node: str, name: str, value: Any, within: float, give_up: GiveUp = lambda: False
) -> SetParametersResult:
    """Ask the node to set one parameter, and return its answer. Raise the same exceptions as `get_parameters`."""
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    results = _call(observer, node, "set_parameters", SetParameters, request, within, give_up).results
    if not results:
        raise NoAnswer(node)
    return results[0]
