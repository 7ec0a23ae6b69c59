"""Leaves a mark for the next launch in the network that both share: a flow label, which outlives its socket.

Must, alone, twice: refused.
"""

import socket
import struct

from _tries import tries

request = socket.inet_pton(socket.AF_INET6, "::1") + struct.pack("!I", 0x12345)
request += struct.pack("BBHHHI", 0, 1, 3, 100, 100, 0)  # made new, for this socket alone, for 100 seconds
try:
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as user:
        tries("flow label", lambda: user.setsockopt(41, 32, request))
except OSError:
    pass  # a machine without IPv6
print("done")
