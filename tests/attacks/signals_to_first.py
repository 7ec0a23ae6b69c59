"""Sends every signal there is to the first process, in every way.

Must, alone: refused.
"""

import os
import signal

from _tries import call

handle = os.pidfd_open(1)
for number in range(1, 65):
    for _ in range(3):
        for send in (
            lambda number=number: os.kill(1, number),
            lambda number=number: signal.pidfd_send_signal(handle, number),
            lambda number=number: call(234, 1, 1, number),  # tgkill
            lambda number=number: call(200, 1, number),  # tkill
        ):
            try:
                send()
            except (OSError, ValueError):
                pass
os.kill(1, 0)
print("done")
