"""Mounts, unmounts and binds by the old and the new calls.

Must: refused.
"""

import os

from _tries import call, tries

for target in (b"/tmp", b"/proc", b"/home/student", b"/"):
    tries("tmpfs", lambda target=target: call(165, b"x", target, b"tmpfs", 0, 0))
    tries("bind", lambda target=target: call(165, b"/", target, 0, 4096, 0))
    tries("remount", lambda target=target: call(165, b"x", target, 0, 32, 0))
    tries("umount", lambda target=target: call(166, target, 2))
for number in (155, 161, 428, 429, 430, 431, 432, 433, 442):
    tries(f"call {number}", lambda number=number: call(number, b"/", b"/", 0, 0, 0))
tries("file handles", lambda: call(304, os.open("/", os.O_RDONLY), bytes(128), 0))
print("done")
