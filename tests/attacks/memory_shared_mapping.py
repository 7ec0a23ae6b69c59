"""Takes memory by mappings that are made to be shared, which count for no process alone.

Must, alone: memory limit.
"""

import mmap
import time

SIZE = 1 << 20
hoard = []
while True:
    try:
        piece = mmap.mmap(-1, 8 * SIZE)
        for place in range(0, 8 * SIZE, 4096):
            piece[place] = 1
        hoard.append(piece)
    except OSError:
        time.sleep(0.1)
