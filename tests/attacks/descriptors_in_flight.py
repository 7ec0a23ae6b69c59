"""Hides descriptors in messages that nobody takes, again and again.

Must: refused.
"""

import os
import socket

from _tries import tries

hidden = 0
try:
    while hidden < 20000:
        one, other = socket.socketpair()
        null = os.open("/dev/null", os.O_RDONLY)
        for _ in range(100):
            socket.send_fds(one, [b"x"], [null] * 50)
            hidden += 50
        os.close(null)
except OSError:
    pass
tries("descriptors in flight", lambda: -1 if hidden < 2000 else hidden)
print("done")
