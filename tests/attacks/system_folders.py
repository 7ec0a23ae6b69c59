"""Looks for the machine below /sys, /boot, /root, /var and other users' homes.

Must: refused.
"""

import os

from _tries import tries

for path in (
    "/sys/kernel",
    "/sys/fs/cgroup",
    "/boot",
    "/root" + "/.ssh",
    "/var/log",
    "/var/lib",
    "/mnt",
    "/media",
    "/etc/passwd",
):
    tries(path, lambda path=path: os.stat(path))
for name in os.listdir("/home"):
    if name != "student":
        print("ESCAPED /home", name)
print("done")
