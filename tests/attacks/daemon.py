"""Leaves the launch as a daemon does: fork, setsid, fork again.

Must: refused.
"""

import os

from _tries import tries


def daemon():
    child = os.fork()
    if child == 0:
        os.setsid()
        os.fork()
        os._exit(0)
    return child


tries("daemon", daemon)
tries("posix_spawn", lambda: os.posix_spawn("/bin/true", ["true"], {}))
tries("system", lambda: -1 if os.system("true") else "ran")
print("done")
