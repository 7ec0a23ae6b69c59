"""Writes wherever it can until it is refused, in many files since the size of each is limited.

Must: refused.
"""

import os

PLACES = "/tmp /dev/shm /dev / /etc /home /home/student /run /run/kit /usr /var/tmp /proc"

for folder in PLACES.split():
    taken = 0
    try:
        for number in range(64):
            with open(os.path.join(folder, f"fill{number}"), "wb", buffering=0) as file:
                for _ in range(4):
                    taken += file.write(bytes(1 << 20))
    except OSError:
        pass
    if taken > (16 << 20 if folder in ("/tmp", "/dev/shm") else 0):
        print("ESCAPED", folder, taken)
