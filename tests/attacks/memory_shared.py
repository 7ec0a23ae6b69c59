"""Takes memory in ways that no limit of a process counts.

Must: refused.
"""

import ctypes
import os

libc = ctypes.CDLL(None, use_errno=True)
for name in ("memfd_create", "memfd_secret"):
    number = {"memfd_create": 319, "memfd_secret": 447}[name]
    print(name, "ESCAPED" if libc.syscall(number, b"x", 0) >= 0 else "refused")
print("shmget", "ESCAPED" if libc.shmget(0, 1 << 30, 0o1600) >= 0 else "refused")
taken = 0
try:
    with open("/dev/shm/hoard", "wb") as file:
        while True:
            taken += file.write(os.urandom(1 << 20))
except OSError:
    pass
print("ESCAPED" if taken > 16 << 20 else "shm", taken)
