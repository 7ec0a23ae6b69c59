"""`ros.qos`: what the ends of a topic offer and request, and whether they match."""

from __future__ import annotations

from typing import Any, get_args

from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder import diagnosis
from autograder.checks.expect.endpoints import End, Ends
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.misuse import Misuse
from autograder.checks.waiting import waits_for
from autograder.diagnosis.silence import MISMATCH
from autograder.graph import qos
from autograder.graph.names import node_of
from autograder.reasons import Group, Kind

QOS_LIFESPAN = Kind("qos-lifespan", "the end has another lifespan than asked for", Group.ENDS)

_WORDS = {
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_topic"),
}
"""What the policies that are not times can be."""

Policies = dict[str, str | float | None]


class Qos(Ends):
    """The QoS of a topic: what its publishers offer and its subscriptions request."""

    @waits_for("an endpoint on `{name}`")
    def expect(
        self,
        *,
        of: End = "publisher",
        node: str = "",
        within: float = WITHIN,
        hint: str = "",
        **policies: str | float | None,
    ) -> None:
        """Every end of one kind on the topic has these QoS policies.

        Args:
            of: which ends, `publisher` or `subscription`.
            node: full name of the node whose ends are meant; by default everybody's are.
            within: seconds until there must be such an end.
            hint: a pointer for the student.
            policies: any of `reliability` (`reliable`, `best_effort`), `durability` (`volatile`, `transient_local`),
                `liveliness` (`automatic`, `manual_by_topic`), and in seconds, or None for "never", `deadline`,
                `lifespan` and `lease`. History and depth are not on the graph.

        Example:
            `ros.qos("/map").expect(reliability="reliable", durability="transient_local")`

        Codes:
            `qos-reliability` and so on by the policy, and those of `expect_publisher` and `expect_subscription`.
        """
        topic = self.name
        _refuse_misspelt(of, policies)
        wanted = _in_words(policies, policies)
        title = f"The {of} on `{topic}` has {wanted}"
        if not self._wait_for_graph(lambda: self._ends(topic, None, of, node), within):
            self._fail(
                title,
                diagnosis.why_no_endpoint(self._scene(), topic, None, of, node),
                expected=f"a {of} on {topic}",
                observed=self._topics(),
                hint=hint,
            )
        self._all_there(topic, of)
        ends = self._ends(topic, None, of, node)
        wrong = [found for end in ends for found in _differences(end, of, policies)]
        self._expect_that(
            not wrong,
            title,
            lambda: MISMATCH.get(wrong[0][0], QOS_LIFESPAN)(" ".join(dict.fromkeys(said for _, said in wrong))),
            expected=wanted,
            observed="; ".join(_in_words(policies, qos.describe(end.qos_profile)) for end in ends),
            hint=hint,
        )

    def _all_there(self, topic: str, kind: End) -> None:
        """Wait until the constructors of these nodes have ended, because they may still create further endpoints."""
        self._settle_owners(lambda: self._ends(topic, None, kind, ""), again=False)

    @waits_for("both ends of `{name}`")
    def expect_match(self, *, within: float = WITHIN, hint: str = "") -> None:
        """Every subscription to the topic accepts the QoS that every publisher of it offers.

        Args:
            within: seconds until there must be a publisher and a subscription.
            hint: a pointer for the student.

        Example:
            `ros.qos("/scan").expect_match()`

        Codes:
            those of `expect_publisher` and `expect_subscription`, and `qos-reliability` and so on by the policy.
        """
        topic = self.name
        title = f"Publishers and subscriptions on `{topic}` match"

        def ends(kind: End) -> list[TopicEndpointInfo]:
            return self._ends(topic, None, kind, "")

        if not self._wait_for_graph(lambda: ends("publisher") and ends("subscription"), within):
            missing: End = "subscription" if ends("publisher") else "publisher"
            self._fail(
                title,
                diagnosis.why_no_endpoint(self._scene(), topic, None, missing),
                expected=f"a publisher and a subscription on {topic}",
                observed=self._topics(),
                hint=hint,
            )
        self._all_there(topic, "publisher")
        self._all_there(topic, "subscription")
        reasons = [
            diagnosis.why_not_matched(self._scene(), topic, end.qos_profile, "publisher")
            for end in ends("subscription")
        ]
        reason = next((found for found in reasons if found), None)
        self._expect_that(not reason, title, lambda: reason, hint=hint)


def _refuse_misspelt(of: str, policies: Policies) -> None:
    if of not in get_args(End):
        raise Misuse(f"qos: of={of!r} is neither 'publisher' nor 'subscription'.")
    unknown = sorted(policies.keys() - qos.POLICIES)
    if unknown or not policies:
        known = ", ".join(sorted(qos.POLICIES))
        raise Misuse(f"qos knows no policy called {', '.join(unknown) or 'nothing'}. It knows {known}.")
    for policy, value in policies.items():
        words = _WORDS.get(policy)
        if words is not None and value not in words:
            raise Misuse(f"qos: {policy}={value!r} is neither {' nor '.join(map(repr, words))}.")
        if words is None and not (value is None or (isinstance(value, (int, float)) and value > 0)):
            raise Misuse(f"qos: {policy}={value!r} is no time; it is a number of seconds above 0, or None.")


def _in_words(policies: Policies, values: Policies) -> str:
    return ", ".join(f"{policy} {qos.in_words(values[policy])}" for policy in policies)


def _differences(end: TopicEndpointInfo, kind: str, policies: Policies) -> list[tuple[str, str]]:
    """Return the policies of an endpoint that are not as required, each with a sentence."""
    owner, have = node_of(end), qos.describe(end.qos_profile)
    return [
        (
            policy,
            f"The {kind} of `{owner}`: its {policy} is {qos.in_words(have[policy])}, not {qos.in_words(value)}.",
        )
        for policy, value in policies.items()
        if not _same(have[policy], value)
    ]


def _same(have: Any, want: Any) -> bool:
    if isinstance(want, (int, float)) and isinstance(have, (int, float)):
        return abs(have - want) <= 1e-6 + 0.001 * abs(want)
    return bool(have == want)
