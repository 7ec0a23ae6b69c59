"""Asks the kernel about sockets of others and for events of devices; only the interfaces are to be told.

Must: refused.
"""

import socket

from _tries import tries

for protocol in range(1, 23):
    tries(f"netlink {protocol}", lambda protocol=protocol: socket.socket(16, socket.SOCK_RAW, protocol))
socket.socket(16, socket.SOCK_RAW, 0).close()
print("done")
