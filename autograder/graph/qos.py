"""QoS as the graph shows it, and the policy that prevents two endpoints from matching."""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.duration import Duration
from rclpy.qos import QoSProfile

_INFINITE = 2**62
"""The nanoseconds from which a duration on the graph means "never"; the middleware's own infinity is about 2**63."""


POLICIES = frozenset({"reliability", "durability", "deadline", "lifespan", "liveliness", "lease"})
"""The policies that the graph shows; history and depth are not among them."""


Policies = Mapping[str, str | float | None]


def seconds(duration: Duration) -> float | None:
    """Return a duration in seconds; None for "never", which the middleware represents as zero or as infinity."""
    nanoseconds = duration.nanoseconds
    return None if nanoseconds <= 0 or nanoseconds >= _INFINITE else nanoseconds * 1e-9


def describe(profile: QoSProfile) -> dict[str, str | float | None]:
    """Return the policies that the graph shows, in words and seconds. History and depth are not among them."""
    return {
        "reliability": profile.reliability.name.lower(),
        "durability": profile.durability.name.lower(),
        "deadline": seconds(profile.deadline),
        "lifespan": seconds(profile.lifespan),
        "liveliness": profile.liveliness.name.lower(),
        "lease": seconds(profile.liveliness_lease_duration),
    }


def in_words(value: str | float | None) -> str:
    """Return a policy's value as it is written in a sentence: `best effort`, `0.2 s`, `none`."""
    if value is None:
        return "none"
    return value.replace("_", " ") if isinstance(value, str) else f"{value:g} s"


def first_mismatch(offered: QoSProfile, requested: QoSProfile) -> str | None:
    """Return the first policy that prevents a publisher (offered) from matching a subscription (requested), or None.

    The DDS rule is that a request must not be stricter than the offer. It applies to reliability, durability, deadline,
    liveliness and the liveliness lease.
    """
    return mismatch_between(describe(offered), describe(requested))


def mismatch_between(offered: Policies, requested: Policies) -> str | None:
    """Do the same as `first_mismatch` for profiles that `describe` has put into words."""
    return next(iter(mismatches(offered, requested)), None)


def mismatches(offered: Policies, requested: Policies) -> list[str]:
    """Return every policy in which a request is stricter than the offer, the one that is named first in front."""
    stricter = {
        "reliability": requested["reliability"] == "reliable" and offered["reliability"] == "best_effort",
        "durability": requested["durability"] == "transient_local" and offered["durability"] == "volatile",
        "deadline": _longer(offered["deadline"], requested["deadline"]),
        "liveliness": requested["liveliness"] == "manual_by_topic" and offered["liveliness"] == "automatic",
        "liveliness lease": _longer(offered["lease"], requested["lease"]),
    }
    return [policy for policy, found in stricter.items() if found]


def _longer(offered: str | float | None, requested: str | float | None) -> bool:
    return isinstance(requested, float) and (not isinstance(offered, float) or offered > requested)
