"""Starts threads without end, and does not care for refusals.

Must, alone: process limit.
"""

import threading
import time

while True:
    try:
        threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
    except RuntimeError:
        pass
