"""Writes answers of the first process to every descriptor it has.

Must: refused.
"""

import os

for text in (b'{"ended": 1, "status": 0}', b'{"ready": true}', b'{"broken": "no"}', b'{"started": 9}', b"{}", b"\xff"):
    for descriptor in range(3, 256):
        try:
            os.write(descriptor, text)
        except OSError:
            pass
print("done")
