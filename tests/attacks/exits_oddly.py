"""Ends in the middle of everything: threads that run, handlers that raise, output not written.

Must: refused.
"""

import atexit
import os
import signal
import threading

signal.signal(signal.SIGTERM, lambda *_: 1 / 0)
threading.excepthook = lambda *_: None
atexit.register(lambda: os.write(1, b"done\n") and os._exit(0))
threading.Thread(target=lambda: [None for _ in iter(int, 1)], daemon=True).start()
raise SystemExit(0)
