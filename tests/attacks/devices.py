"""Opens and writes devices, makes new ones, and takes many terminals.

Must: refused.
"""

import fcntl
import os
import stat

from _tries import tries

NAMES = "kmsg mem port fuse kvm net/tun vda sda loop0 loop-control mapper/control uinput vsock userfaultfd console hpet"
for name in NAMES.split():
    tries(name, lambda name=name: os.open(f"/dev/{name}", os.O_RDWR))
for kind in (stat.S_IFBLK, stat.S_IFCHR):
    tries("mknod", lambda kind=kind: os.mknod(f"/tmp/node{kind}", kind | 0o600, os.makedev(8, 0)) or "made")
terminals = []
try:
    while len(terminals) < 1000:
        terminals.append(os.open("/dev/ptmx", os.O_RDWR | os.O_NOCTTY))
except OSError:
    pass
tries("terminals", lambda: -1 if len(terminals) < 300 else len(terminals))
for terminal in terminals:
    os.close(terminal)
tries("typing for others", lambda: fcntl.ioctl(os.open("/dev/tty", os.O_RDWR), 0x5412, b"x"))
print("done")
