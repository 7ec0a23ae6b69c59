"""Sends random bytes to every port that DDS may listen on.

Must, beside an honest node: the observer goes on.
"""

import os
import socket
import time

domain = int(os.environ["ROS_DOMAIN_ID"])
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
end = time.monotonic() + 2
while time.monotonic() < end:
    for port in range(7528 + 250 * domain, 7528 + 250 * domain + 60):
        try:
            out.sendto(os.urandom(64), ("127.0.0.1", port))
        except OSError:
            pass
print("done")
