"""Enters the namespaces of every process, and asks for the namespaces above its own.

Must: refused.
"""

import fcntl
import os

from _tries import call, others, tries

for pid in others():
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:  # it has ended meanwhile
        continue
    tries(f"setns {pid}", lambda handle=handle: call(308, handle, 0x20000000 | 0x20000 | 0x10000000))
    tries(f"pidfd_getfd {pid}", lambda handle=handle: call(438, handle, 0, 0))
for name in ("user", "pid", "mnt", "net", "ipc"):
    own = os.open(f"/proc/self/ns/{name}", os.O_RDONLY)
    tries(f"setns {name}", lambda own=own: call(308, own, 0))
    for request in (0xB701, 0xB702):  # NS_GET_USERNS, NS_GET_PARENT
        tries(f"parent of {name}", lambda own=own, request=request: call(308, fcntl.ioctl(own, request), 0))
print("done")
