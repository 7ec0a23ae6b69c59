"""Reads the kernel's own memory, log and addresses.

Must: refused.
"""

import os

from _tries import call, read, tries

for path in ("/proc/kcore", "/proc/kmsg", "/dev/kmsg", "/dev/mem", "/dev/port", "/proc/kpagecount", "/proc/slabinfo"):
    tries(path, lambda path=path: read(path))
tries("syslog", lambda: call(103, 3, bytes(64), 64))
try:
    with open("/proc/kallsyms") as symbols:
        shown = symbols.readline().split()[:1]
    if shown and int(shown[0], 16):
        print("ESCAPED kernel addresses", shown)
except OSError:
    pass
print("done", os.getpid() > 0)
