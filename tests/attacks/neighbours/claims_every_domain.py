"""Claim every domain, as the kit does."""

import socket

from _neighbour import wait

kept = []
for number in range(1, 101):
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0ros-domain-{number}")
    except OSError:
        continue
    kept.append(claim)
wait()
