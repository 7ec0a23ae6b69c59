"""Computes in many threads, and gives the lowest priority to the first one alone, at which somebody may look.

Must, alone: goes on behind all others.
"""

import hashlib
import os
import threading

begin = threading.Event()


def hog():
    begin.wait()
    block = bytes(1 << 24)
    while True:
        hashlib.sha256(block)  # lets other threads go on meanwhile


for _ in range(100):
    threading.Thread(target=hog, daemon=True).start()
os.setpriority(os.PRIO_PROCESS, 0, 19)
begin.set()
threading.Event().wait()
