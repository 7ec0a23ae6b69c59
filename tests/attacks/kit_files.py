"""Changes the kit, Python and the system around itself.

Must: refused.
"""

import os
import sys

from _tries import tries

PLACES = ["/run/kit/launcher.py", "/run/kit/probe/writing.py", "/run/kit/fastdds.xml", os.__file__, sys.executable]
PLACES += ["/etc/ld.so.cache", "/usr/bin/env", "/bin/sh"]
for path in PLACES:
    tries(path, lambda path=path: os.open(path, os.O_WRONLY))
    tries(f"new beside {path}", lambda path=path: os.open(os.path.dirname(path) + "/new", os.O_CREAT | os.O_WRONLY))
    tries(f"remove {path}", lambda path=path: os.unlink(path) or "gone")
print("done")
