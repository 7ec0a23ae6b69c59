"""Makes folders within folders as deep as it can, and goes down into them.

Must: refused.
"""

import os

depth = 0
os.chdir("/dev/shm")
try:
    for depth in range(100_000):  # noqa: B007
        os.mkdir("d" * 200)
        os.chdir("d" * 200)
except OSError:
    pass
print("ESCAPED" if depth > 2048 else "deep", depth)
print("done")
