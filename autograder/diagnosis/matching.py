"""Which QoS policy keeps two ends of a topic apart."""

from __future__ import annotations

from rclpy.qos import QoSProfile

from autograder.diagnosis.reason import Diagnosis
from autograder.diagnosis.scene import Scene
from autograder.graph import qos
from autograder.graph.names import node_of


def why_not_matched(scene: Scene, topic: str, profile: QoSProfile, kind: str) -> Diagnosis | None:
    """Must have seen: a `kind` of the student's on the topic whose QoS does not match an endpoint with `profile`."""
    ends = scene.observer.publishers(topic) if kind == "publisher" else scene.observer.subscriptions(topic)
    for end in ends:
        offered, requested = (end.qos_profile, profile) if kind == "publisher" else (profile, end.qos_profile)
        policy = qos.first_mismatch(offered, requested)
        if policy:
            words = policy.split()[0] if policy != "liveliness lease" else "lease"
            gives, wants = qos.describe(offered)[words], qos.describe(requested)[words]
            owner = node_of(end)
            return Diagnosis(
                f"Publisher and subscription on `{topic}` do not match over {policy}: offered {qos.in_words(gives)}, "
                f"requested {qos.in_words(wants)} (the {kind} is that of `{owner}`).",
                f"qos-{words}",
                "A subscription may not ask for more than the publisher offers.",
            )
    return None
