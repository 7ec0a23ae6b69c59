"""Expectations of parameters: their values, and which values a node refuses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from rcl_interfaces.srv import GetParameters

from autograder import diagnosis
from autograder.checks.expect import parameter_reasons
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meeting import Meeting
from autograder.checks.parts import asked
from autograder.graph import parameters
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind

PARAMETER_ACCEPTED = Kind("parameter-accepted", "the node took a value that it should refuse", Group.STATES)
PARAMETER_REFUSAL = Kind(
    "parameter-refusal", "the node refused a value, but without a reason, or did not stay as it was", Group.STATES
)

_NO_RESULT = "Callback returned an invalid type"
"""What rclpy says in place of a reason."""


class ParameterExpectations(Meeting):
    """What values the parameters of a node have."""

    def _no_parameters(self, title: str, node: str, error: Exception, hint: str) -> NoReturn:
        if isinstance(error, ServiceMissing):
            if node in self._observer.nodes():
                reason = diagnosis.why_no_service(self._scene(), f"{node}/get_parameters", GetParameters)
            else:
                reason = diagnosis.why_no_node(self._scene(), node)
        else:
            reason = diagnosis.why_no_answer(self._scene(), f"{node}/get_parameters")
        self._fail(title, reason, expected=node, observed=", ".join(self._observer.nodes()), hint=hint)

    def get_parameters(self, node: str, names: Sequence[str], *, within: float = WITHIN) -> Mapping[str, Any]:
        """Values of a node's parameters; those it has not declared are left out.

        Args:
            node: full name.
            names: of the parameters.
            within: seconds until it must have answered.

        Example:
            `rate = ros.get_parameters("/camera", ["rate"]).get("rate")`

        Codes:
            `no-answer`, `no-service`, and those of `expect_node`.
        """
        try:
            return parameters.get_parameters(self._observer, node, names, within, self._without(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` tells its parameters", node, error, "")

    def list_parameters(self, node: str, *, within: float = WITHIN) -> list[str]:
        """Names of the parameters that a node has declared.

        Args:
            node: full name.
            within: seconds until it must have answered.

        Example:
            `names = ros.list_parameters("/camera")`

        Codes:
            `no-answer`, `no-service`, and those of `expect_node`.
        """
        try:
            return parameters.list_parameters(self._observer, node, within, self._without(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` tells its parameters", node, error, "")

    def set_parameter(self, node: str, name: str, value: Any, *, within: float = WITHIN) -> Any:
        """Ask a node to set a parameter.

        Args:
            node: full name.
            name: of the parameter.
            value: a bool, an integer, a double, a text or a list of one of these.
            within: seconds until it must have answered.

        Returns:
            its SetParametersResult: `successful` and `reason`.

        Example:
            `reply = ros.set_parameter("/camera", "rate", 5.0)`

        Codes:
            `no-answer`, `no-service`, and those of `expect_node`.
        """
        self._meet(lambda: node in self._observer.nodes(), within)
        try:
            asked("parameter")
            return parameters.set_parameter(self._observer, node, name, value, within, self._without(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` answers when `{name}` is set to {value!r}", node, error, "")

    def expect_parameter(self, node: str, name: str, value: Any, *, within: float = WITHIN, hint: str = "") -> None:
        """A node has a parameter with this value and type.

        Args:
            node: full name.
            name: of the parameter.
            value: with its type: 40 is an integer, 40.0 a double.
            within: seconds until it must have answered.
            hint: a pointer for the student.

        Example:
            `ros.expect_parameter("/camera", "rate", 5.0)`

        Codes:
            `parameter-undeclared`, `parameter-value`, `parameter-as-rule`, `parameter-for-others`, `launch-argument`,
            `params-file-key`, `params-file-missing`, and those of `get_parameters`.
        """
        title = f"Parameter `{name}` of `{node}` is {value!r}"
        try:
            have = parameters.get_parameters(self._observer, node, [name], within, self._without(node))
            declared = []
            if name not in have:
                declared = parameters.list_parameters(self._observer, node, within, self._without(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(title, node, error, hint)
        if name not in have:
            self._fail(title, parameter_reasons.undeclared(node, name, declared), expected=repr(value), hint=hint)
        same = type(have[name]) is type(value) and (
            abs(have[name] - value) < 1e-9 if isinstance(value, float) else have[name] == value
        )
        if not isinstance(value, (bool, int, float, str)):
            same = not isinstance(have[name], (bool, int, float, str)) and list(have[name] or ()) == list(value)
        self._expect_that(
            same,
            title,
            lambda: parameter_reasons.why_other(self._running, node, name, have[name], value),
            expected=repr(value),
            observed=repr(have[name]),
            hint=hint,
        )

    def expect_parameter_refused(
        self, node: str, name: str, value: Any, *, within: float = WITHIN, hint: str = ""
    ) -> None:
        """A node refuses a value with a reason, keeps the old one and lives on.

        Args:
            node: full name.
            name: of the parameter.
            value: that it must refuse.
            within: seconds until each answer must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_parameter_refused("/camera", "rate", -1.0)`

        Codes:
            `parameter-accepted`, `parameter-refusal`, and those of `get_parameters`.
        """
        title = f"`{node}` refuses `{name}` = {value!r} with a reason and lives on"
        before = self.get_parameters(node, [name], within=within)
        try:
            asked("parameter")
            reply = parameters.set_parameter(self._observer, node, name, value, within, self._without(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(title, node, error, hint)
        reason = ""
        if reply.successful:
            reason = "It was accepted."
        elif not reply.reason:
            reason = "It was refused without a reason."
        elif reply.reason == _NO_RESULT:
            reason = "rclpy refused it, because the callback returned no SetParametersResult: that is no reason."
        elif self.get_parameters(node, [name], within=within) != before:
            reason = "It was refused, yet the value has changed."
        self._expect_that(
            not reason,
            title,
            lambda: (PARAMETER_ACCEPTED if reply.successful else PARAMETER_REFUSAL)(reason),
            observed=reply.reason,
            hint=hint,
        )
