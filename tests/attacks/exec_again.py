"""Becomes another program, in the hope that it is free of the filter.

Must: refused.
"""

import os
import sys

LATER = """
import os
for act in (os.fork, lambda: os.open("/proc/1/mem", os.O_RDWR), lambda: os.mkdir("/home/student/x")):
    try:
        print("ESCAPED", act())
    except OSError:
        pass
print("done")
"""
os.execv(sys.executable, [sys.executable, "-I", "-S", "-c", LATER])
