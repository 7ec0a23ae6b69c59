"""Closes all its descriptors and goes on without a word.

Must: goes on.
"""

import os
import time

os.closerange(0, 4096)
while True:
    time.sleep(60)
