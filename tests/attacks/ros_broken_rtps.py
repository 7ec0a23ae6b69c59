"""Sends packets that begin as RTPS does and go on with nonsense: lengths, counts, submessages.

Must, beside an honest node: the observer goes on.
"""

import os
import random
import socket
import struct
import time

domain = int(os.environ["ROS_DOMAIN_ID"])
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
end = time.monotonic() + 2
while time.monotonic() < end:
    packet = b"RTPS" + bytes([2, 3, 1, 15]) + os.urandom(12)
    for _ in range(random.randrange(8)):
        kind = random.choice([0x06, 0x07, 0x08, 0x09, 0x0C, 0x0E, 0x13, 0x15, 0x16])
        body = os.urandom(random.randrange(400))
        packet += struct.pack("<BBH", kind, random.randrange(16), random.choice([len(body), 0, 65535])) + body
    for port in range(7528 + 250 * domain, 7528 + 250 * domain + 40):
        out.sendto(packet, ("127.0.0.1", port))
print("done")
