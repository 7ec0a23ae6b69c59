"""Asks for the name of the machine that grades, by which a student could tell whose it is.

Must: refused.
"""

import os
import pathlib
import socket

names = {os.uname().nodename, socket.gethostname(), pathlib.Path("/proc/sys/kernel/hostname").read_text().strip()}
if names != {"robot"}:
    print("ESCAPED", names)
print("done")
