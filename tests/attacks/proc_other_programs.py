"""Reads and writes the memory, the files and the settings of the other programs of the launch.

Must: refused.
"""

import os
import time
from functools import partial

from _tries import others, tries, write


def is_program(pid):
    """Whether it runs, and is no other program that it has become: that one lies open by its own wish."""
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as line:
            return b"launcher.py" in line.read()
    except OSError:
        return False


def of_program(pid, act):
    """Do it; of a program that ended meanwhile there is nothing to be had, so that its files open to everybody."""
    result = act()
    return result if is_program(pid) else -1


end = time.monotonic() + 2
while time.monotonic() < end:
    for pid in others():
        if pid == 1 or not is_program(pid):
            continue
        for name in ("mem", "environ", "maps", "fd/1", "root/etc", f"task/{pid}/mem"):
            look = partial(os.open, f"/proc/{pid}/{name}", os.O_RDONLY)
            tries(f"reading {name} of {pid}", partial(of_program, pid, look))
        for name in ("mem", "clear_refs"):
            look = partial(os.open, f"/proc/{pid}/{name}", os.O_WRONLY)
            tries(f"writing {name} of {pid}", partial(of_program, pid, look))
        change = partial(write, f"/proc/{pid}/oom_score_adj", b"1000")
        tries(f"oom_score_adj of {pid}", partial(of_program, pid, change))
    time.sleep(0.1)
print("done")
