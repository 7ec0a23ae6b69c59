"""ROS domains: each launch claims a domain for as long as it runs, and then releases it.

DDS derives a participant's ports from the number of its domain, so launches in different domains never share a port.
"""

from __future__ import annotations

import contextlib
import os
import random
import socket
from pathlib import Path

LAST = 100
"""The highest domain ID all of whose ports are below those that Linux assigns to other programs (ROS 2 documentation,
"The ROS_DOMAIN_ID")."""
_FIRST_PORT, _PORTS_PER_DOMAIN = 7400, 250
"""The values of the RTPS 2.5 specification, section 9.6.2.4."""
_DISCOVERY = 128
"""The offset of the port on which the kit's participants announce themselves, as `fastdds.xml` sets it."""


class Domain:
    """A domain that this process uses until `release`."""

    def __init__(self, number: int, claim: socket.socket | None) -> None:
        """Keep the claim; use `claim_domain` to create a domain."""
        self.id = number
        self._claim = claim

    def release(self) -> None:
        """Release the domain. This can be called twice; it also happens whenever the process ends, in whatever way."""
        if self._claim is not None:
            self._claim.close()


def claim_domain() -> Domain:
    """Claim a domain that no other process of the kit uses, and in which there is no participant.

    On a machine with more launches than domains, launches share a domain. They still do not hear each other, because
    each process has its own multicast group (`autograder.sandbox.environment`).
    """
    order = random.SystemRandom().sample(range(1, LAST + 1), LAST)
    for number in order:
        claim = _claimed(number)
        if claim is not None:
            if is_free(number):
                return Domain(number, claim)
            claim.close()
    return Domain(next((number for number in order if is_free(number)), order[0]), None)


def _claimed(number: int) -> socket.socket | None:
    """Claim a domain among the kit's processes for as long as the returned socket is open; None if it is taken.

    Looking at the ports is not enough, because another process may look at them before the first participant exists. An
    abstract socket name belongs to the network namespace, like the ports, and disappears with its process. It needs no
    file, so a killed process leaves nothing behind, and no folder's owner or permissions matter.
    """
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0ros-domain-{number}")
    except OSError:
        claim.close()
        return None
    return claim


def is_free(domain: int) -> bool:
    """Whether no participant on this machine uses any port of a domain."""
    first = _FIRST_PORT + _PORTS_PER_DOMAIN * domain
    return all(_is_unused(port) for port in range(first, first + _PORTS_PER_DOMAIN))


def _is_unused(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return False
    return True


def group_of(domain: int) -> str | None:
    """Return the multicast group in which this user's launch in a domain discovers its programs; None if there is none.

    There is none for domain 0, because every program without a domain ID uses it, and no launch claims it.
    """
    wanted = f":{_FIRST_PORT + _PORTS_PER_DOMAIN * domain + _DISCOVERY:04X}"
    with contextlib.suppress(OSError):
        for line in Path("/proc/net/udp").read_text().splitlines()[1:] if domain else ():
            fields = line.split()
            address, user = fields[1], fields[7]
            # The kernel prints an address as a number in the byte order of this machine, so its first byte comes last.
            if address.endswith(wanted) and address[6:8] == "EF" and int(user) == os.getuid():
                return socket.inet_ntoa(bytes.fromhex(address[:8])[::-1])
    return None
