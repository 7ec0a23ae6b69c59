"""Does not end when it is asked to.

Must: goes on.
"""

import signal
import time

for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
print("ready")
while True:
    time.sleep(1)
