"""Leaves marks wherever it can, and looks for those of an earlier launch, to learn which check this is.

Must, alone, twice: refused.
"""

import os
import time

for folder in {"/tmp", "/dev/shm", os.environ["HOME"], os.environ["ROS_LOG_DIR"]}:
    os.makedirs(folder, exist_ok=True)
    if os.path.exists(f"{folder}/mark"):
        print("ESCAPED", folder)
    open(f"{folder}/mark", "w").close()
if os.getpid() > 16:
    print("ESCAPED process ids are counted:", os.getpid())
with open("/proc/1/stat") as first, open("/proc/uptime") as uptime:
    age = float(uptime.read().split()[0]) - int(first.read().rpartition(")")[2].split()[19]) / os.sysconf("SC_CLK_TCK")
if age > 300:
    print("ESCAPED the launch is old:", age)
print("done", time.monotonic() > 0)
