"""Takes the first process its CPU time, its limits and its descriptors away.

Must, alone: refused.
"""

import os
import struct

from _tries import call, libc, tries

nothing = struct.pack("QQ", 0, 0)
for limit in range(16):
    tries(f"prlimit {limit}", lambda limit=limit: call(302, 1, limit, nothing, 0))
tries("affinity", lambda: os.sched_setaffinity(1, {0}))
tries("idle", lambda: os.sched_setscheduler(1, os.SCHED_IDLE, os.sched_param(0)))
tries("attr", lambda: call(314, 1, struct.pack("IIQiIQQQ", 48, 5, 0, 19, 0, 0, 0, 0), 0))
tries("nice", lambda: libc.setpriority(0, 1, 19))
tries("nice of all", lambda: libc.setpriority(2, os.getuid(), 19))
tries("ioprio", lambda: call(251, 1, 1, 3 << 13))
print("done")
