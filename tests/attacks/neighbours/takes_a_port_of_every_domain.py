"""Take a port of every domain."""

import socket

from _neighbour import wait

kept = []
for number in range(1, 101):
    kept.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    kept[-1].setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    kept[-1].bind(("0.0.0.0", 7400 + 250 * number + 11))
wait()
