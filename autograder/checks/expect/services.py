"""Expectations of services, parameters and actions."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from rcl_interfaces.srv import GetParameters

from autograder import diagnosis
from autograder.arguments import params_file, remap_rules
from autograder.checks import outcomes, runtime
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.graph import GraphExpectations
from autograder.diagnosis import Diagnosis
from autograder.graph import parameters
from autograder.graph.names import type_name
from autograder.graph.services import Answer, OfferedService, ServiceMissing, call_all

if TYPE_CHECKING:
    from autograder.graph.actions import Goal

_NO_RESULT = "Callback returned an invalid type"
"""What rclpy says in place of a reason."""

_EVERY_NODE = ("use_sim_time", "start_type_description_service")
"""Parameters that rclpy declares for every node."""

_KINDS = {bool: "a bool", int: "an integer", float: "a double", str: "a text", type(None): "without a value"}

ANSWER_WITHIN = 5.0
"""Seconds that an answer may take: a local round trip takes 1 to 4 ms, a stuck node does not answer."""


def _other_value(found: Any, wanted: Any) -> Diagnosis:
    """What a parameter is instead; where its type differs, that is said."""
    kind, asked = _KINDS.get(type(found), "a list"), _KINDS.get(type(wanted), "a list")
    if kind == asked:
        return Diagnosis(f"It is {found!r}.", "parameter-value")
    return Diagnosis(
        f"It is {found!r}, {kind}, and not {asked}.",
        "parameter-value",
        "40 is an integer, 40.0 a double, '40' a text. Given another type than it declares, a node ends at its start.",
    )


class ServiceExpectations(GraphExpectations):
    """What must answer, and what it must say."""

    def prepare(self) -> None:
        """Set up the offered services."""
        super().prepare()
        self._offered: dict[str, OfferedService] = {}

    def serve(self, name: str, srv_type: type, answer: Callable[[Any, Any], Any], delay: float = 0.0) -> OfferedService:
        """Offer a service to the student's client; each answer comes after `delay` seconds."""
        self._offered[name] = OfferedService(self.observer, name, srv_type, answer, delay)
        return self._offered[name]

    def requests(self, name: str) -> list[Any]:
        """Requests that have reached a service offered by `serve`."""
        return list(self._offered[name].requests)

    def served(self, name: str) -> list[tuple[float, float]]:
        """When requests to a service offered by `serve` arrived and were answered, seconds on the system clock."""
        return list(self._offered[name].served)

    def expect_service(self, name: str, srv_type: type, *, within: float = WITHIN, hint: str = "") -> None:
        """A node offers this service with this type."""
        wanted = type_name(srv_type)
        found = self.wait_for_graph(lambda: wanted in self.observer.services().get(name, []), within)
        self.expect_that(
            found,
            f"The service `{name}` ({wanted}) is offered",
            lambda: diagnosis.why_no_service(self.scene(), name, srv_type),
            expected=f"{name} ({wanted})",
            hint=hint,
        )

    def call_many(
        self, name: str, srv_type: type, requests: Sequence[Any], *, within: float = ANSWER_WITHIN, hint: str = ""
    ) -> list[Answer]:
        """Send all requests at once; each must be answered. Missing server or answer is a failed outcome."""
        title = f"The service `{name}` answers"
        gone = self.hopeless(lambda: name in self.observer.services())
        try:
            answers = call_all(self.observer, name, srv_type, requests, within, gone)
        except ServiceMissing:
            self.fail(title, diagnosis.why_no_service(self.scene(), name, srv_type), expected=name, hint=hint)
        unanswered = sum(1 for answer in answers if answer.response is None)
        if unanswered:
            self.fail(
                title,
                diagnosis.why_no_answer(self.scene(), name),
                expected=f"an answer within {within:g} s",
                observed="no answer"
                if len(answers) == 1
                else f"{unanswered} of {len(answers)} calls without an answer",
                hint=hint,
            )
        outcomes.passed(title)
        return answers

    def call(self, name: str, srv_type: type, request: Any, *, within: float = ANSWER_WITHIN, hint: str = "") -> Any:
        """Call a service of the student's and give the response."""
        return self.call_many(name, srv_type, [request], within=within, hint=hint)[0].response

    def _no_parameters(self, title: str, node: str, error: Exception, hint: str) -> NoReturn:
        if isinstance(error, ServiceMissing):
            if node in self.observer.nodes():
                reason = diagnosis.why_no_service(self.scene(), f"{node}/get_parameters", GetParameters)
            else:
                reason = diagnosis.why_no_node(self.scene(), node)
        else:
            reason = diagnosis.why_no_answer(self.scene(), f"{node}/get_parameters")
        self.fail(title, reason, expected=node, observed=", ".join(self.observer.nodes()), hint=hint)

    def get_parameters(self, node: str, names: Sequence[str], *, within: float = WITHIN) -> Mapping[str, Any]:
        """Values of a node's parameters; those it has not declared are left out."""
        try:
            return parameters.get_parameters(self.observer, node, names, within, self.without_node(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` tells its parameters", node, error, "")

    def list_parameters(self, node: str, *, within: float = WITHIN) -> list[str]:
        """Names of the parameters that a node has declared."""
        try:
            return parameters.list_parameters(self.observer, node, within, self.without_node(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` tells its parameters", node, error, "")

    def set_parameter(self, node: str, name: str, value: Any, *, within: float = WITHIN) -> Any:
        """Ask a node to set a parameter; gives its SetParametersResult."""
        try:
            return parameters.set_parameter(self.observer, node, name, value, within, self.without_node(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(f"`{node}` answers when `{name}` is set to {value!r}", node, error, "")

    def expect_parameter(self, node: str, name: str, value: Any, *, within: float = WITHIN, hint: str = "") -> None:
        """A node has a parameter with this value and type."""
        title = f"Parameter `{name}` of `{node}` is {value!r}"
        try:
            have = parameters.get_parameters(self.observer, node, [name], within, self.without_node(node))
            declared = []
            if name not in have:
                declared = parameters.list_parameters(self.observer, node, within, self.without_node(node))
        except (ServiceMissing, parameters.NoAnswer) as error:
            self._no_parameters(title, node, error, hint)
        if name not in have:
            own = [one for one in declared if one not in _EVERY_NODE and "qos_overrides" not in one]
            self.fail(
                title,
                Diagnosis(
                    f"`{node}` has not declared a parameter `{name}`" + (f"; it has {', '.join(own)}." if own else "."),
                    "parameter-undeclared",
                    "A value given at the start reaches declared parameters only.",
                ),
                expected=repr(value),
                hint=hint,
            )
        same = type(have[name]) is type(value) and (
            abs(have[name] - value) < 1e-9 if isinstance(value, float) else have[name] == value
        )
        if not isinstance(value, (bool, int, float, str)):
            same = list(have[name]) == list(value)
        self.expect_that(
            same,
            title,
            lambda: (
                self._file_for_others(node)
                or self._given_as_a_rule(name)
                or self._given_to_another(node, name)
                or _other_value(have[name], value)
            ),
            expected=repr(value),
            observed=repr(have[name]),
            hint=hint,
        )

    def _given_as_a_rule(self, name: str) -> Diagnosis | None:
        """Whether the parameter was given with `-r`, as if it were a name to be changed."""
        for text in itertools.chain.from_iterable(self.scene().rules):
            rule = remap_rules.parse(text)
            if rule and rule.left == name:
                because = f"`{text}` is given as a remap rule; such rules rename topics and services, not parameters."
                return Diagnosis(because, "parameter-as-rule", f"Give it as a parameter: `-p {text}`.")
        return None

    def _given_to_another(self, node: str, name: str) -> Diagnosis | None:
        """Whether `-p NODE:name:=value` was meant for this node: a node's name there is one in the namespace `/`."""
        for launched, _ in self.programs:
            for option, text in itertools.pairwise(launched.arguments()):
                meant, _, parameter = text.partition(":=")[0].rpartition(":")
                if option in ("-p", "--param") and parameter == name and meant and f"/{meant}" != node:
                    because = f"`-p {text}` is for the node `/{meant}`, and this one is `{node}`."
                    hint = "Leave the node out: the value is for every node of the process then."
                    return Diagnosis(because, "parameter-for-others", hint)
        return None

    def _file_for_others(self, node: str) -> Diagnosis | None:
        """Whether the parameter files of the launch have nothing for this node."""
        for launched, _ in self.programs:
            if launched.warnings:
                hint = "Write `$(dirname)/NAME.yaml`; NAME is a cell's `%%file`."
                return Diagnosis(f"{launched.warnings[0]} The node started without it.", "params-file-missing", hint)
            words = launched.arguments()
            for option, file in itertools.pairwise(words):
                path = runtime.current.folder / file
                if option != "--params-file" or not path.is_file():
                    continue
                because = params_file.why_not_reached(path.read_text(encoding="utf-8"), node)
                if because:
                    return Diagnosis(because, "params-file-key", "The key is the node's full name, namespace included.")
        return None

    def expect_parameter_refused(
        self, node: str, name: str, value: Any, *, within: float = WITHIN, hint: str = ""
    ) -> None:
        """A node refuses a value with a reason, keeps the old one and lives on."""
        title = f"`{node}` refuses `{name}` = {value!r} with a reason and lives on"
        before = self.get_parameters(node, [name], within=within)
        try:
            reply = parameters.set_parameter(self.observer, node, name, value, within, self.without_node(node))
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
        self.expect_that(
            not reason,
            title,
            lambda: Diagnosis(reason, "parameter-accepted" if reply.successful else "parameter-refusal"),
            observed=reply.reason,
            hint=hint,
        )

    def send_goal(self, name: str, action_type: type, goal: Any, *, within: float = WITHIN, hint: str = "") -> Goal:
        """Send a goal and wait for the server's decision; a missing server or decision is a failed outcome."""
        # Actions load numpy, a quarter of a second of CPU that most labs do not need.
        from autograder.graph import actions

        title = f"The action `{name}` decides about a goal"
        try:
            sent = actions.send_goal(self.observer, name, action_type, goal, within, self.all_ended)
        except ServiceMissing:
            self.fail(
                title,
                diagnosis.program_trouble(self.scene())
                or Diagnosis(f"No node offers the action `{name}`.", "no-action"),
                expected=name,
                hint=hint,
            )
        if sent.accepted is None:
            self.fail(title, diagnosis.why_no_answer(self.scene(), name), expected="accepted or rejected", hint=hint)
        outcomes.passed(title, observed="accepted" if sent.accepted else "rejected")
        return sent
