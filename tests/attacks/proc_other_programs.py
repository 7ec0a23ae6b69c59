"""Reads and writes the memory, the files and the settings of the other programs of the launch.

Must: refused.
"""

import os
import time

from _tries import others, tries, write

end = time.monotonic() + 2
while time.monotonic() < end:
    for pid in others():
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as line:
                if pid == 1 or b"launcher.py" not in line.read():
                    continue  # a program that has started another one itself lies open by its own wish
        except OSError:
            continue
        for name in ("mem", "environ", "maps", "fd/1", "root/etc", f"task/{pid}/mem"):
            tries(f"reading {name} of {pid}", lambda path=f"/proc/{pid}/{name}": os.open(path, os.O_RDONLY))
        for name in ("mem", "clear_refs"):
            tries(f"writing {name} of {pid}", lambda path=f"/proc/{pid}/{name}": os.open(path, os.O_WRONLY))
        tries(f"oom_score_adj of {pid}", lambda path=f"/proc/{pid}/oom_score_adj": write(path, b"1000"))
    time.sleep(0.1)
print("done")
