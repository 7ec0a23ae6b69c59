"""Floods its output by standard error and by a second way to the same pipe.

Must: goes on.
"""

import os

again = os.open("/proc/self/fd/1", os.O_WRONLY)
while True:
    for descriptor in (2, again):
        os.write(descriptor, b"\xe2" * 65536)
