"""Makes timers and waiting signals without end.

Must: refused.
"""

import ctypes
import os
import signal

from _tries import call, libc, tries

made = 0
while made < 20000 and call(222, 1, 0, ctypes.create_string_buffer(8)) == 0:  # timer_create
    made += 1
tries("timers", lambda: -1 if made < 2000 else made)
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGRTMIN + 1})
libc.sigqueue.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_void_p)
queued = 0
while queued < 20000 and libc.sigqueue(os.getpid(), signal.SIGRTMIN + 1, None) == 0:
    queued += 1
tries("signals", lambda: -1 if queued < 2000 else queued)
os.write(1, b"done\n")
os._exit(0)
