"""Opens files until there is no descriptor left, and asks for more.

Must: refused.
"""

import os

opened = 0
refused = 0
while refused < 100:
    try:
        os.open("/dev/null", os.O_RDONLY)
        opened += 1
    except OSError:
        refused += 1
os.write(1, b"ESCAPED too many\ndone\n" if opened > 1024 else b"done\n")
os._exit(0)
