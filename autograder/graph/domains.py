"""ROS domains: each launch claims one for as long as it runs, and gives it back.

DDS derives a participant's ports from its domain's number, so launches in different domains never meet at a port.
"""

from __future__ import annotations

import contextlib
import os
import random
import socket
from pathlib import Path

LAST = 100
"""The highest domain id with all its ports below those that Linux hands out to others (ROS 2 documentation, The
ROS_DOMAIN_ID)."""
_FIRST_PORT, _PORTS_PER_DOMAIN = 7400, 250
"""RTPS 2.5, 9.6.2.4."""
_DISCOVERY = 128
"""The offset of the port on which the kit's participants announce themselves, as `fastdds.xml` says."""


class Domain:
    """A domain that was given to this process, until `release`."""

    def __init__(self, number: int, claim: socket.socket | None) -> None:
        """Use `claim_domain`."""
        self.id = number
        self._claim = claim

    def release(self) -> None:
        """Give it back. Can be called twice; the end of the process, however it comes, does the same."""
        if self._claim is not None:
            self._claim.close()


def claim_domain() -> Domain:
    """Claim a domain that no other process of the kit has, and in which no participant is alive.

    On a machine with more launches than domains, one is shared: they still do not hear each other, since each process
    has a multicast group of its own (`autograder.sandbox.environment`).
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
    """Take a domain among the kit's own processes, for as long as the socket is open; None if another one has it.

    A look at the ports is not enough: between it and the first participant another process may look as well. A name
    of this kind lives in the network namespace, as the ports do, and goes with its process. It needs no file, so
    nothing is left by a process that was killed, and nothing depends on whose folder it is.
    """
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0ros-domain-{number}")
    except OSError:
        claim.close()
        return None
    return claim


def is_free(domain: int) -> bool:
    """Whether no participant of this machine is alive in a domain, whichever of its ports it has."""
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
    """Return the multicast group in which this user's launch in a domain finds its programs; None if there is none.

    Every program that names no domain uses domain 0, so no launch claims it.
    """
    wanted = f":{_FIRST_PORT + _PORTS_PER_DOMAIN * domain + _DISCOVERY:04X}"
    with contextlib.suppress(OSError):
        for line in Path("/proc/net/udp").read_text().splitlines()[1:] if domain else ():
            fields = line.split()
            address, user = fields[1], fields[7]
            # An address is written as the number that its four bytes are on this machine: its first byte comes last.
            if address.endswith(wanted) and address[6:8] == "EF" and int(user) == os.getuid():
                return socket.inet_ntoa(bytes.fromhex(address[:8])[::-1])
    return None
