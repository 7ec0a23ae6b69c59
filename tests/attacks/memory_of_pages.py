"""Pins pages in pipes, and touches one byte of every two megabytes.

Must: refused.
"""

import mmap
import os

from _tries import call, tries

out, into = os.pipe()
tries("vmsplice", lambda: call(278, into, bytes(16), 1, 0))
tries("tee", lambda: call(276, out, into, 1, 0))
hoard = []
try:
    while True:
        hoard.append(mmap.mmap(-1, 64 << 20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))
        hoard[-1].madvise(15)  # no huge pages
        for place in range(0, 64 << 20, 2 << 20):
            hoard[-1][place] = 1
except (OSError, MemoryError):
    pass
print("ESCAPED" if len(hoard) > 64 else "mapped", len(hoard))
hoard.clear()
print("done")
