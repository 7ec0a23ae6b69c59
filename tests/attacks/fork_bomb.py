"""Forks without end, and does not care for refusals; also by the raw calls, and with other programs.

Must: refused.
"""

import ctypes
import os
import subprocess
import sys

libc = ctypes.CDLL(None, use_errno=True)
made = 0


def starts(make):
    try:
        return make() != -1
    except OSError:
        return False


for _ in range(1000):
    for make in (
        os.fork,
        lambda: libc.syscall(57),  # fork
        lambda: libc.syscall(58),  # vfork
        lambda: libc.syscall(56, 17, 0, 0, 0, 0),  # clone
        lambda: libc.syscall(435, bytes(88), 88),  # clone3
    ):
        made += starts(make)
made += starts(lambda: subprocess.Popen([sys.executable, "--version"]).pid)
print("ESCAPED processes" if made else "processes", made, flush=True)
