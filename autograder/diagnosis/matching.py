"""Which QoS policy keeps two ends of a topic apart."""

from __future__ import annotations

from rclpy.qos import QoSProfile

from autograder.diagnosis.scene import Scene
from autograder.graph import qos
from autograder.graph.names import node_of
from autograder.reasons import Group, Kind, Reason

QOS_RELIABILITY = Kind("qos-reliability", "offered and requested reliability do not match", Group.SILENCE, "qos")
QOS_DURABILITY = Kind("qos-durability", "offered and requested durability do not match", Group.SILENCE, "qos")
QOS_DEADLINE = Kind("qos-deadline", "offered and requested deadline do not match", Group.SILENCE, "qos")
QOS_LIVELINESS = Kind("qos-liveliness", "offered and requested liveliness do not match", Group.SILENCE, "qos")
QOS_LEASE = Kind("qos-lease", "offered and requested lease do not match", Group.SILENCE, "qos")

MISMATCH = {
    "reliability": QOS_RELIABILITY,
    "durability": QOS_DURABILITY,
    "deadline": QOS_DEADLINE,
    "liveliness": QOS_LIVELINESS,
    "lease": QOS_LEASE,
}
"""The kinds by the policies over which two ends do not match."""


def why_not_matched(scene: Scene, topic: str, profile: QoSProfile, kind: str) -> Reason | None:
    """Must have seen: a `kind` of the student's on the topic whose QoS does not match an endpoint with `profile`."""
    ends = scene.observer.publishers(topic) if kind == "publisher" else scene.observer.subscriptions(topic)
    for end in ends:
        offered, requested = (end.qos_profile, profile) if kind == "publisher" else (profile, end.qos_profile)
        policy = qos.first_mismatch(offered, requested)
        if policy:
            words = policy.split()[0] if policy != "liveliness lease" else "lease"
            gives, wants = qos.describe(offered)[words], qos.describe(requested)[words]
            owner = node_of(end)
            return MISMATCH[words](
                f"The {policy} of the publisher on `{topic}` does not match that of the subscription: offered is "
                f"{qos.in_words(gives)}, requested is {qos.in_words(wants)}. The {kind} belongs to `{owner}`.",
                "A subscription must not request more than the publisher offers.",
            )
    return None
