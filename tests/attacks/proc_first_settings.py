"""Writes to the files in /proc that steer the first process.

Must: refused.
"""

from _tries import tries, write

for name in ("oom_score_adj", "comm", "coredump_filter", "clear_refs", "timerslack_ns", "autogroup", "sched"):
    tries(name, lambda path=f"/proc/1/{name}": write(path))
for name in ("attr/current", "uid_map", "gid_map", "setgroups", "task/1/comm", "loginuid", "timens_offsets"):
    tries(name, lambda path=f"/proc/1/{name}": write(path))
print("done")
