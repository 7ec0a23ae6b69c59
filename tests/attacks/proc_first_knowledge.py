"""Reads what the first process knows: environment, memory map, descriptors, folders, namespaces.

Must: refused.
"""

import os

from _tries import read, tries

for name in ("environ", "maps", "smaps", "pagemap", "auxv", "stack", "syscall", "io", "personality", "timers", "wchan"):
    if name != "wchan":
        tries(name, lambda path=f"/proc/1/{name}": read(path))
for name in ("fd", "fdinfo", "map_files", "root", "cwd"):
    tries(name, lambda path=f"/proc/1/{name}": os.listdir(path))
for name in ("root", "cwd", "exe", "ns/user", "ns/pid", "ns/net", "ns/mnt"):
    tries(name, lambda path=f"/proc/1/{name}": os.readlink(path))
print("done")
