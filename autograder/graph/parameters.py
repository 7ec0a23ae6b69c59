"""A node's parameters, asked for through its parameter services."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from autograder.graph.observer import Observer
from autograder.graph.services import call_all

GiveUp = Callable[[], bool]


class NoAnswer(Exception):
    """The node's parameter service is there, but did not answer in time: nothing spins the node, or it is stuck."""


def _call(
    observer: Observer, node: str, service: str, srv_type: type, request: Any, within: float, give_up: GiveUp
) -> Any:
    # A first request can get lost while the two sides are still being matched; these requests are safe to repeat.
    for _ in range(2):
        answer = call_all(observer, f"{node}/{service}", srv_type, [request], within / 2, give_up)[0]
        if answer.response is not None:
            return answer.response
        if give_up():
            break
    raise NoAnswer(node)


def get_parameters(
    observer: Observer, node: str, names: Sequence[str], within: float, give_up: GiveUp = lambda: False
) -> Mapping[str, Any]:
    """Values of the named parameters; those that are not declared are left out.

    Raises:
        ServiceMissing: no such node, or one without parameter services.
        NoAnswer: it did not answer within `within` seconds.
    """
    found = {}
    for name in names:
        # One by one: rclpy answers a request that names an undeclared parameter with an empty list for all.
        request = GetParameters.Request(names=[name])
        values = _call(observer, node, "get_parameters", GetParameters, request, within, give_up).values
        # A service that a program offers in place of its node's can tell of types that do not exist.
        if values and ParameterType.PARAMETER_NOT_SET < values[0].type <= ParameterType.PARAMETER_STRING_ARRAY:
            found[name] = parameter_value_to_python(values[0])
    return found


def list_parameters(observer: Observer, node: str, within: float, give_up: GiveUp = lambda: False) -> list[str]:
    """Names of all declared parameters, sorted. Raises as `get_parameters`."""
    reply = _call(observer, node, "list_parameters", ListParameters, ListParameters.Request(), within, give_up)
    return sorted(reply.result.names)


def set_parameter(
    observer: Observer, node: str, name: str, value: Any, within: float, give_up: GiveUp = lambda: False
) -> SetParametersResult:
    """Ask the node to set one parameter, and give its answer. Raises as `get_parameters`."""
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    results = _call(observer, node, "set_parameters", SetParameters, request, within, give_up).results
    if not results:
        raise NoAnswer(node)
    return results[0]
