"""Keeps memory in pipes, made as large as the kernel lets it.

Must: refused.
"""

import fcntl
import os

taken = 0
try:
    while True:
        out, into = os.pipe2(os.O_NONBLOCK)
        try:
            fcntl.fcntl(into, 1031, 1 << 20)  # F_SETPIPE_SZ
        except OSError:
            pass
        try:
            while True:
                taken += os.write(into, bytes(1 << 16))
        except BlockingIOError:
            pass
except OSError:
    pass
print("ESCAPED" if taken > 192 << 20 else "kept", taken)
print("done")
