"""`ros.node`: whether a node is there, its parameters and why one has another value, and what it logs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from rcl_interfaces.msg import Log
from rcl_interfaces.srv import GetParameters
from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.discovery import MATCHES_WITHIN, Discovery
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.parameter_values import undeclared, why_other
from autograder.checks.misuse import Misuse
from autograder.checks.running_launch import SETTLE
from autograder.checks.scoring import asked
from autograder.checks.waiting import waits_for
from autograder.graph.parameters import NoAnswer, get_parameters, list_parameters, set_parameter
from autograder.graph.recording import Recording
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind, Reason

PARAMETER_ACCEPTED = Kind("parameter-accepted", "the node took a value that it should refuse", Group.STATES)
PARAMETER_REFUSAL = Kind(
    "parameter-refusal", "the node refused a value, but without a reason, or did not stay as it was", Group.STATES
)

NO_LOG = Kind("no-log", "no such line was logged, or not that often", Group.OUTPUT)

_LOGGER = re.compile(r"\[\w+\] \[[\d.]+\] \[([^\]]*)\]: ")
"""What a line of a program's output begins with that a logger has written; the group is the logger's name."""
_LEVELS = {"DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
"""Numbers of rcl_interfaces/msg/Log."""

_NO_RESULT = "Callback returned an invalid type"
"""What rclpy says in place of a reason."""


class Node(Discovery):
    """A node: whether it is there, what values its parameters have, and what it logs."""

    @waits_for("the node `{name}`")
    def expect(self, *, within: float = WITHIN, hint: str = "") -> None:
        """The node with this full name is on the graph, exactly once, and lives on.

        Args:
            within: seconds until it must be there.
            hint: a pointer for the student.

        Example:
            `ros.node("/robot/talker").expect()`

        Codes:
            `no-node`, `node-name`, `namespace`, `one-name-for-all`, `duplicate-node`, and those of a program that
            ended.
        """
        name = self.name
        title = f"The node `{name}` is on the graph"
        if not self._wait_for_graph(lambda: name in self._observer.nodes(), within):
            self._fail(
                title,
                diagnosis.why_no_node(self._scene(), name),
                expected=name,
                observed=", ".join(self._observer.nodes()) or "no node",
                hint=hint,
            )
        self._settle([name])
        if name not in self._observer.nodes() or self._running.gone_program():
            # A program that dies takes its node off the graph first and prints its traceback after that.
            self._observer.wait(self._running.gone_program, SETTLE)
            self._fail(
                title,
                diagnosis.why_no_node(self._scene(), name),
                expected=name,
                observed="it was there, and went away",
                hint=hint,
            )
        self._observer.wait(lambda: self._observer.nodes().count(name) >= self._made(name), MATCHES_WITHIN)
        if self._observer.nodes().count(name) > 1:
            self._fail(
                title,
                diagnosis.why_doubled(self._scene(), name),
                expected="one node of this name",
                observed=", ".join(self._observer.nodes()),
                hint=hint,
            )
        outcomes.passed(title, observed=name)

    def _no_parameters(self, title: str, error: Exception, hint: str) -> NoReturn:
        node = self.name
        if isinstance(error, ServiceMissing):
            if node in self._observer.nodes():
                reason = diagnosis.why_no_service(self._scene(), f"{node}/get_parameters", GetParameters)
            else:
                reason = diagnosis.why_no_node(self._scene(), node)
        else:
            reason = diagnosis.why_no_answer(self._scene(), f"{node}/get_parameters")
        self._fail(title, reason, expected=node, observed=", ".join(self._observer.nodes()), hint=hint)

    @waits_for("the parameters of `{name}`")
    def parameters(self, names: Sequence[str], *, within: float = WITHIN) -> Mapping[str, Any]:
        """Values of a node's parameters; those it has not declared are left out.

        Args:
            names: of the parameters.
            within: seconds until it must have answered.

        Example:
            `rate = ros.node("/camera").parameters(["rate"]).get("rate")`

        Codes:
            `no-answer`, `no-service`, and those of `node.expect`.
        """
        node = self.name
        try:
            return get_parameters(self._observer, node, names, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._no_parameters(f"`{node}` tells its parameters", error, "")

    @waits_for("an answer of `{name}`")
    def set_parameter(self, name: str, value: Any, *, within: float = WITHIN) -> Any:
        """Ask a node to set a parameter.

        Args:
            name: of the parameter.
            value: a bool, an integer, a double, a text or a list of one of these.
            within: seconds until it must have answered.

        Returns:
            its SetParametersResult: `successful` and `reason`.

        Example:
            `reply = ros.node("/camera").set_parameter("rate", 5.0)`

        Codes:
            `no-answer`, `no-service`, and those of `node.expect`.
        """
        node = self.name
        self._meet(lambda: node in self._observer.nodes(), within)
        try:
            asked("parameter")
            return set_parameter(self._observer, node, name, value, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._no_parameters(f"`{node}` answers when `{name}` is set to {value!r}", error, "")

    @waits_for("the parameters of `{name}`")
    def expect_parameter(self, name: str, value: Any, *, within: float = WITHIN, hint: str = "") -> None:
        """A node has a parameter with this value and type.

        Args:
            name: of the parameter.
            value: with its type: 40 is an integer, 40.0 a double.
            within: seconds until it must have answered.
            hint: a pointer for the student.

        Example:
            `ros.node("/camera").expect_parameter("rate", 5.0)`

        Codes:
            `parameter-undeclared`, `parameter-value`, `parameter-as-rule`, `parameter-for-others`, `launch-argument`,
            `params-file-key`, `params-file-missing`, and those of `parameters`.
        """
        node = self.name
        title = f"Parameter `{name}` of `{node}` is {value!r}"
        try:
            have = get_parameters(self._observer, node, [name], within, self._without(node))
            declared = []
            if name not in have:
                declared = list_parameters(self._observer, node, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._no_parameters(title, error, hint)
        if name not in have:
            self._fail(title, undeclared(node, name, declared), expected=repr(value), hint=hint)
        same = type(have[name]) is type(value) and (
            abs(have[name] - value) < 1e-9 if isinstance(value, float) else have[name] == value
        )
        if not isinstance(value, (bool, int, float, str)):
            same = not isinstance(have[name], (bool, int, float, str)) and list(have[name] or ()) == list(value)
        self._expect_that(
            same,
            title,
            lambda: why_other(self._running, node, name, have[name], value),
            expected=repr(value),
            observed=repr(have[name]),
            hint=hint,
        )

    @waits_for("the parameters of `{name}`")
    def expect_parameter_refused(self, name: str, value: Any, *, within: float = WITHIN, hint: str = "") -> None:
        """A node refuses a value with a reason, keeps the old one and lives on.

        Args:
            name: of the parameter.
            value: that it must refuse.
            within: seconds until each answer must have come.
            hint: a pointer for the student.

        Example:
            `ros.node("/camera").expect_parameter_refused("rate", -1.0)`

        Codes:
            `parameter-accepted`, `parameter-refusal`, and those of `parameters`.
        """
        node = self.name
        title = f"`{node}` refuses `{name}` = {value!r} with a reason and lives on"
        before = self.parameters([name], within=within)
        try:
            asked("parameter")
            reply = set_parameter(self._observer, node, name, value, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._no_parameters(title, error, hint)
        reason = ""
        if reply.successful:
            reason = "It was accepted."
        elif not reply.reason:
            reason = "It was refused without a reason."
        elif reply.reason == _NO_RESULT:
            reason = "rclpy refused it, because the callback returned no SetParametersResult: that is no reason."
        elif self.parameters([name], within=within) != before:
            reason = "It was refused, yet the value has changed."
        self._expect_that(
            not reason,
            title,
            lambda: (PARAMETER_ACCEPTED if reply.successful else PARAMETER_REFUSAL)(reason),
            observed=reply.reason,
            hint=hint,
        )

    @waits_for("a log message of `{name}`")
    def expect_log(
        self,
        text: str,
        *,
        level: str = "",
        count: int | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """A message of this node's own logger that matches the regular expression `text` reaches /rosout.

        Args:
            text: regular expression.
            level: DEBUG, INFO, WARN, ERROR or FATAL, exactly.
            count: exactly so many; by default at least one.
            within: seconds until they must have come.
            hint: a pointer for the student.

        Example:
            `ros.node("/oven").expect_log("too hot", level="WARN")`

        Codes:
            `no-log`, and errors in callbacks.
        """
        if level and level not in _LEVELS:
            raise Misuse(f"expect_log: level={level!r} is none of {', '.join(_LEVELS)}.")
        # rosout names a node's logger with dots for slashes, and without a leading one.
        node, rosout = self.name[1:].replace("/", "."), self._rosout()

        def matching() -> list[Any]:
            return [
                r.msg
                for r in rosout.messages
                if re.search(text, r.msg.msg) and (not level or r.msg.level == _LEVELS[level]) and r.msg.name == node
            ]

        found = self._wait(lambda: len(matching()) >= (count or 1), within)
        if found and count is not None:
            self._observer.wait(lambda: len(matching()) > count, 0.3)
            found = len(matching()) == count
        self._expect_that(
            found,
            f"A log message{f' of level {level}' if level else ''} {f'says {text!r}' if text else 'comes'}",
            lambda: self._why_not_logged(len(matching()), text, level, node),
            expected=text,
            observed="; ".join(r.msg.msg for r in rosout.messages[-3:]),
            hint=hint,
        )

    def _rosout(self) -> Recording:
        # It is transient local: who asks for that hears the last ten seconds too.
        profile = QoSProfile(depth=1000, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        return self._observer.record("/rosout", Log, profile)

    def _why_not_logged(self, times: int, text: str, level: str, node: str) -> Reason:
        instead = "" if times else self._said_instead(text, level, node)
        scene = self._scene()
        found = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
        if not found and not times and not instead:
            found = diagnosis.nothing_due(scene, self.name)
        often = {0: instead or f"No such message was logged.{_unheard(scene)}", 1: "It was logged once."}
        return found or NO_LOG(often.get(times, f"It was logged {times} times."))

    def _said_instead(self, text: str, level: str, node: str) -> str:
        """Say where the same words appeared instead: at another level, from another node, or only printed."""
        said = [r.msg for r in self._rosout().messages if re.search(text, r.msg.msg)]
        own = [message for message in said if message.name == node]
        if level and own and own[-1].level != _LEVELS[level]:
            has = next((name for name, number in _LEVELS.items() if number == own[-1].level), str(own[-1].level))
            return f"`{own[-1].msg[:80]}` was logged at level {has}, not at {level}."
        if said and text and not own:
            return f"`{said[-1].msg[:80]}` was logged by `{said[-1].name}`, not by `{node}`."
        lines = (line.strip() for _, program in self._running.programs for line in program.output().splitlines())
        printed = [line for line in lines if text and re.search(text, line)]
        for line in printed:
            if "] [" not in line:
                return f"`{line[:80]}` was printed, not logged. Use `self.get_logger()` to log it."
            logger = _LOGGER.match(line)
            if logger and logger[1] != node:
                return (
                    f"`{line[logger.end() :][:80]}` was logged by a logger called `{logger[1]}`. The node's own logger "
                    f"is called `{node}`, with its namespace, and `self.get_logger()` returns it."
                )
        return ""


def _unheard(scene: diagnosis.Scene) -> str:
    """Say, where a program's source logs at level DEBUG, that such lines do not come out by default."""
    for inside in scene.insides:
        if line := inside.source.calls("debug"):
            return (
                f" Line {line} of `{inside.name}` logs at level DEBUG, and by default a logger puts out only INFO and "
                "what is more severe."
            )
    return ""
