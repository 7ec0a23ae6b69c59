"""Which ROS domains are in use on this machine: DDS derives a participant's ports from its domain's number."""

from __future__ import annotations

import itertools
import random
import socket
from collections.abc import Iterator

LAST = 101
"""The highest domain id whose ports lie below those that Linux hands out to others (ROS 2 documentation, The
ROS_DOMAIN_ID)."""
_FIRST_PORT, _PORTS_PER_DOMAIN, _UNICAST = 7400, 250, 10
"""RTPS 2.5, 9.6.2.4: the first participant of a domain takes the port `first + per domain * domain + 10`."""


def is_free(domain: int) -> bool:
    """Whether no participant of this machine is alive in a domain, as far as can be seen from here."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("0.0.0.0", _FIRST_PORT + _PORTS_PER_DOMAIN * domain + _UNICAST))
        except OSError:
            return False
    return True


def _claimed(domain: int) -> socket.socket | None:
    """Take a domain among the kit's own processes, for as long as the socket is open; None if another one has it.

    Between the look at its ports and the first participant there is time in which another process may look as well.
    The name lives in the network namespace, as the ports do, and goes with its process.
    """
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0ros-domain-{domain}")
    except OSError:
        claim.close()
        return None
    return claim


def free_domains() -> Iterator[int]:
    """Give domains that nobody on this machine seems to use, without end; one that was given comes again late.

    The one that was given last is claimed until the next is asked for.
    """
    order = random.SystemRandom().sample(range(1, LAST + 1), LAST)
    taken_anyway = itertools.cycle(order)
    candidates = itertools.cycle(order)
    claim: socket.socket | None = None
    while True:
        earlier, claim, found = claim, None, None
        for domain in itertools.islice(candidates, LAST):
            claim = _claimed(domain) if is_free(domain) else None
            if claim is not None:
                found = domain
                break
        if earlier is not None:
            earlier.close()
        if found is None:  # on a machine with very many kernels, most claims are of those that start nothing now
            found = next((domain for domain in order if is_free(domain)), None)
        yield next(taken_anyway) if found is None else found
