"""`ros.lifecycle`: states of lifecycle nodes, transitions, and the steps they take."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NoReturn

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.discovery import Discovery
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.waiting import waits_for
from autograder.graph.lifecycle import LifecycleClient, Requested
from autograder.graph.parameters import NoAnswer
from autograder.graph.services import ServiceMissing
from autograder.reasons import Group, Kind, Reason, kind_of_lab

STATE = Kind("state", "the node's state is another one; no reason was established inside the program", Group.STATES)
TRANSITION_SUCCEEDED = Kind("transition-succeeded", "a transition succeeded that should not", Group.STATES)
NOT_LIFECYCLE = Kind("not-lifecycle", "the node is on the graph and offers no lifecycle services", Group.STATES)
TRANSITION_FAILED = Kind("transition-failed", "the callback of a transition did not return SUCCESS", Group.STATES)
TRANSITIONS = Kind("transitions", "the node went through other states than asked for", Group.STATES)

WORD_FROM_INSIDE = 0.5
"""Seconds that a failed check waits for what the student's process says about it."""


_LOGGED = re.compile(r"^\[\w+\] \[[\d.]+\] \[[^]]*\]: ")
"""What stands before the text of a line that was logged."""


def _other_way(seen: Sequence[tuple[str, str]], wanted: Sequence[tuple[str, str]]) -> str:
    """What the first step that is another one says about the callback before it; empty where it says nothing."""
    at = next((n for n, (a, b) in enumerate(zip(seen, wanted, strict=False)) if a != b), None)
    if at is None or seen[at][0] != wanted[at][0]:
        return ""
    during, goal = seen[at]
    callback = {"configuring": "on_configure", "activating": "on_activate", "deactivating": "on_deactivate"}.get(during)
    if during == "errorprocessing" and goal == "finalized":
        return "`on_error` did not return SUCCESS, so the node is now finalized and cannot be used again."
    if callback and goal == "errorprocessing":
        return (
            f"`{callback}` returned ERROR or raised an exception. Return FAILURE if something is not possible now: the "
            "node then goes back to its previous state."
        )
    if callback and goal == {"configuring": "unconfigured", "activating": "inactive", "deactivating": "active"}[during]:
        return f"`{callback}` returned FAILURE. The node is in its previous state, and `on_error` is not called."
    return f"`{callback}` returned SUCCESS." if callback else ""


class Lifecycle(Discovery):
    """The state machine of a lifecycle node: its state, its transitions, and the steps that it took."""

    @property
    def _client(self) -> LifecycleClient:
        return self._running.lifecycle_client(self.name)

    def _unreachable(self, title: str, error: Exception, hint: str) -> NoReturn:
        node = self.name
        scene = self._scene()
        expected, observed = node, ", ".join(self._observer.nodes())
        if isinstance(error, NoAnswer):
            reason = diagnosis.why_no_answer(scene, f"{node}/get_state")
            expected, observed = "an answer", "no answer"
        elif node in self._observer.nodes():
            reason = diagnosis.program_trouble(scene) or NOT_LIFECYCLE(
                f"`{node}` is not a lifecycle node: it offers no `{node}/get_state`.",
            )
        else:
            reason = diagnosis.why_no_node(scene, node)
        self._fail(title, reason, expected=expected, observed=observed, hint=hint)

    @waits_for("the state of `{name}`")
    def state(self, *, within: float = WITHIN) -> str:
        """Label of a node's current state; a node that does not tell it is a failed outcome.

        Args:
            within: seconds until it must have answered.

        Example:
            `before = ros.lifecycle("/camera").state()`

        Codes:
            `no-answer`, `not-lifecycle`, and those of `node.expect`.
        """
        node = self.name
        try:
            return self._client.state(within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._unreachable(f"`{node}` tells its lifecycle state", error, "")

    @waits_for("the state of `{name}`")
    def expect_state(
        self, state: str, *, within: float = WITHIN, because: str = "", code: str = "", hint: str = ""
    ) -> None:
        """A lifecycle node is in this state, or gets there.

        Args:
            state: `unconfigured`, `inactive`, `active` or `finalized`.
            within: seconds until it must be there.
            because: what another state would mean here, if the check knows it.
            code: of that reason.
            hint: a pointer for the student.

        Example:
            `ros.lifecycle("/camera").expect_state("active")`

        Codes:
            `state` or `code`, `no-answer`, `not-lifecycle`, and errors in callbacks.
        """
        node = self.name
        title = f"`{node}` is {state}"
        try:
            seen = self._client.wait_for_state(state, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._unreachable(title, error, hint)
        self._expect_that(
            seen == state,
            title,
            lambda: (kind_of_lab(code) if code else STATE)(because) if because else self._why_state(node, seen, state),
            expected=state,
            observed=seen,
            hint=hint,
        )

    def _why_state(self, node: str, seen: str, wanted: str) -> Reason:
        return self._what_they_say() or STATE(f"`{node}` is {seen}, not {wanted}.")

    def _what_they_say(self) -> Reason | None:
        """What the programs say of themselves: it takes another way than the node's answer, and may come later."""

        def look() -> Reason | None:
            return diagnosis.program_trouble(self._scene()) or diagnosis.inside_reason(self._scene())

        self._observer.wait(look, WORD_FROM_INSIDE)
        return look()

    def _last_line(self, node: str) -> str:
        """What the program that has this node printed last, without the time and the name of the logger."""
        scene = self._scene()
        programs = [it for it in scene.programs if node in scene.inside(it).nodes] or scene.programs
        lines = programs[0].output().splitlines() if len(programs) == 1 else []
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f" The last line of its log is `{_LOGGED.sub('', last)[:200]}`." if last else ""

    @waits_for("an answer of `{name}`")
    def available_transitions(self, *, within: float = WITHIN) -> Mapping[str, str]:
        """Labels of the transitions that a node offers now, each with the state it leads to.

        Args:
            within: seconds until it must have answered.

        Example:
            `ros.require("configure" in ros.lifecycle("/camera").available_transitions(), "It can be configured")`

        Codes:
            `no-answer`, `not-lifecycle`, and those of `node.expect`.
        """
        node = self.name
        try:
            return self._client.available(within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._unreachable(f"`{node}` tells its transitions", error, "")

    @waits_for("`{name}` to change its state")
    def transition(
        self, label: str, *, expect: str | None = "success", within: float = WITHIN, hint: str = ""
    ) -> Requested:
        """Request a transition by its label.

        Args:
            label: `configure`, `activate`, `deactivate`, `cleanup` or `shutdown`.
            expect: `success`, `failure` (the node answers that it did not succeed), or None: look only, no outcome.
            within: seconds until it must have been answered.
            hint: a pointer for the student.

        Example:
            `ros.lifecycle("/camera").transition("configure")`

        Codes:
            `state`, `transition-failed`, `transition-succeeded`, `no-answer`, `not-lifecycle`, and errors in callbacks.
        """
        node = self.name
        title = f"`{node}`: {label}" + {"success": " succeeds", "failure": " does not succeed", None: ""}[expect]
        self._meet(lambda: node in self._observer.nodes(), within)
        try:
            done = self._client.transition(label, within, self._without(node))
        except (ServiceMissing, NoAnswer) as error:
            self._unreachable(title, error, hint)
        if expect is None:
            return done
        if not done.offered:
            self._fail(
                title,
                STATE(
                    f"`{node}` is {done.before}; in this state, it offers {', '.join(done.available) or 'nothing'}.",
                ),
                expected=label,
                observed=done.before,
                hint=hint,
            )
        if expect == "success" and not done.success:
            self._fail(
                title,
                self._what_they_say()
                or TRANSITION_FAILED(
                    f"The callback for `{label}` did not return SUCCESS; the node is now {done.after}."
                    + self._last_line(node),
                ),
                expected="success",
                observed=f"no success, {done.after}",
                hint=hint,
            )
        if expect == "failure" and done.success:
            self._fail(
                title,
                TRANSITION_SUCCEEDED(f"The transition succeeded, but it should not; the node is now {done.after}."),
                expected="no success",
                observed=f"success, {done.after}",
                hint=hint,
            )
        outcomes.passed(title, observed=done.after)
        return done

    @waits_for("transitions of `{name}`")
    def expect_transitions(self, steps: Sequence[tuple[str, str]], *, within: float = WITHIN, hint: str = "") -> None:
        """A node took exactly these steps since it is watched.

        Args:
            steps: of each the state that was left and the one that was entered.
            within: seconds until the last of them must have come.
            hint: a pointer for the student.

        Example:
            `ros.lifecycle("/camera").expect_transitions([("inactive", "activating"), ("activating", "active")])`

        Codes:
            `transitions`, and errors in callbacks.
        """
        node = self.name
        client = self._client
        seen = [change.step for change in client.wait_for_changes(len(steps), within, self._without(node))]
        told = ", ".join(f"{a} to {b}" for a, b in seen) or "no step"
        self._expect_that(
            seen == list(steps),
            f"`{node}` goes " + ", ".join(f"{a} to {b}" for a, b in steps),
            lambda: self._what_they_say() or TRANSITIONS(_other_way(seen, steps) or f"It went {told}."),
            expected=", ".join(f"{a} to {b}" for a, b in steps),
            observed=told,
            hint=hint,
        )
