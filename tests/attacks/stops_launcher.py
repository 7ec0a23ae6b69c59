"""Freezes the process that started it, and goes on.

Must, alone: goes on.
"""

import os
import signal
import time

os.kill(os.getppid(), signal.SIGSTOP)
print("stopped", flush=True)
time.sleep(60)
