"""Raises its own limits, one by one.

Must: refused.
"""

import resource

from _tries import tries

for name in (
    "AS",
    "NPROC",
    "NOFILE",
    "FSIZE",
    "CORE",
    "MSGQUEUE",
    "MEMLOCK",
    "SIGPENDING",
    "DATA",
    "NICE",
    "RTPRIO",
):
    kind = getattr(resource, f"RLIMIT_{name}")
    _, hard = resource.getrlimit(kind)
    if hard == resource.RLIM_INFINITY:
        print("ESCAPED no limit of", name)
    else:
        tries(name, lambda kind=kind, hard=hard: resource.setrlimit(kind, (hard + 1, hard + 1)) or "raised")
print("done")
