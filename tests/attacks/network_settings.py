"""Changes the network: interfaces, routes, addresses, raw packets.

Must: refused.
"""

import fcntl
import socket
import struct

from _tries import tries

with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
    for request in (0x8914, 0x8916, 0x890B, 0x8922):  # flags, address, route, size
        packed = struct.pack("16sH14s", b"lo", 0, bytes(14))
        tries(hex(request), lambda request=request, packed=packed: fcntl.ioctl(any_socket, request, packed))
tries("raw", lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, 1))
with socket.socket(16, socket.SOCK_RAW, 0) as route:
    add_link = struct.pack("IHHII", 32, 16, 0x605, 1, 0) + bytes(16)
    route.send(add_link)
    answer = route.recv(4096)
    if struct.unpack_from("i", answer, 16)[0] == 0:
        print("ESCAPED a new interface")
print("done")
