"""Opens TCP connections to itself, whose buffers grow to megabytes each.

Must: refused.
"""

import socket

from _tries import tries

for family in (socket.AF_INET, socket.AF_INET6):
    tries("TCP", lambda family=family: socket.socket(family, socket.SOCK_STREAM))
    tries("non-blocking TCP", lambda family=family: socket.socket(family, socket.SOCK_STREAM | socket.SOCK_NONBLOCK))
    tries("SCTP", lambda family=family: socket.socket(family, socket.SOCK_SEQPACKET, 132))
    tries("MPTCP", lambda family=family: socket.socket(family, socket.SOCK_STREAM, 262))
socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close()  # DDS needs it
print("done")
