"""Becomes a program with megabytes of arguments and environment.

Must: refused.
"""

import os
import sys

for size in (1 << 22, 1 << 20, 1 << 16):
    try:
        many = ["x" * 100_000] * (size // 100_000)
        os.execve(sys.executable, [sys.executable, "-I", "-S", "-c", "print('done')", *many], {"A": "y" * 100_000})
    except OSError:
        pass
print("done")
