"""Kills everything that it may.

Must, alone: ended by signal 9.
"""

import os
import signal

try:
    os.kill(-1, signal.SIGKILL)
except ProcessLookupError:
    pass
os.kill(os.getpid(), signal.SIGKILL)
