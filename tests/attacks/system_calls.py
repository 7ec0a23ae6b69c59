"""Asks the kernel for what a node never needs.

Must: refused.
"""

import ctypes
import errno
import os

libc = ctypes.CDLL(None, use_errno=True)
CALLS = {
    "unshare user": (272, 0x10000000),
    "unshare mount": (272, 0x20000),
    "clone user": (56, 0x10000000 | 17, 0),
    "mount": (165, b"none", b"/tmp", b"tmpfs", 0, 0),
    "umount": (166, b"/home/student", 0),
    "ptrace parent": (101, 16, os.getppid(), 0, 0),
    "pidfd_getfd": (438, 0, 0, 0),
    "keyctl": (250, 0, 0),
    "bpf": (321, 0, 0, 0),
    "perf": (298, 0, 0, -1, -1, 0),
    "userfaultfd": (323, 0),
    "io_uring": (425, 1, 0),
    "setns": (308, 0, 0),
    "chroot": (161, b"/tmp"),
    "process_vm_readv": (310, os.getppid(), 0, 0, 0, 0, 0),
    "msgget": (68, 0, 0o1600),
    "mq_open": (240, b"x", 0o102, 0o600, 0),
}
for name, call in CALLS.items():
    result = libc.syscall(*call)
    if result == 0 and name == "clone user":
        os._exit(0)
    if result >= 0 or ctypes.get_errno() not in (errno.EPERM, errno.ENOSYS, errno.EACCES):
        print("ESCAPED", name, result, ctypes.get_errno())
status = open("/proc/self/status").read()
for line in status.splitlines():
    name, _, value = line.partition(":\t")
    if (name.startswith("Cap") and int(value, 16)) or (name, value) in (("Seccomp", "0"), ("NoNewPrivs", "0")):
        print("ESCAPED", line)
