"""Floods the channels of the probe and of the stacks, and writes nonsense there.

Must: refused.
"""

import os

for _ in range(2000):
    for descriptor, text in ((3, b'{"e": "node"}\n[1]\n{broken\n\xff\n' * 50), (4, b"x" * 4096)):
        try:
            os.write(descriptor, text)
        except BlockingIOError:
            pass
print("done")
