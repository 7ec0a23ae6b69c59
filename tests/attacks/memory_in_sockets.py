"""Keeps memory in the buffers of sockets that nobody reads.

Must: refused.
"""

import socket

taken = 0
hoard = []
try:
    while True:
        pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        hoard.append(pair)
        for one in pair:
            one.setblocking(False)
            one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 30)
            try:
                while True:
                    taken += one.send(bytes(1 << 16))
            except BlockingIOError:
                pass
except OSError:
    pass
print("ESCAPED" if taken > 256 << 20 else "kept", taken)
print("done")
