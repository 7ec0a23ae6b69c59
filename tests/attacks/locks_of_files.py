"""Locks single bytes of a file, each of which costs the kernel memory that no limit counts.

Must: refused.
"""

import fcntl
import os
import struct

from _tries import tries

file = os.open(__file__, os.O_RDONLY)  # others may have filled /tmp
lock = struct.pack("hhqqi4x", fcntl.F_RDLCK, 0, 0, 1, 0)
for command in (fcntl.F_SETLK, fcntl.F_SETLKW, 37, 38):  # the last two belong to the open file: F_OFD_SETLK, …LKW
    tries(f"command {command}", lambda command=command: fcntl.fcntl(file, command, lock))
tries("lockf", lambda: fcntl.lockf(file, fcntl.LOCK_SH, 1, 2))
print("done")
