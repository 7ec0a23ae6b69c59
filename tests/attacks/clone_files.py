"""Starts threads that have open files of their own, to get past the limit of open files.

Must: refused.
"""

import ctypes

from _tries import libc

libc.mmap.restype = ctypes.c_void_p
stack = libc.mmap(None, 65536, 3, 0x22, -1, 0)
VM, FS, FILES, SIGHAND, THREAD, SYSVSEM = 0x100, 0x200, 0x400, 0x800, 0x10000, 0x40000
if not hasattr(libc, "clone"):
    print("done")
else:
    exit_thread = ctypes.cast(libc.pause, ctypes.c_void_p)
    top = ctypes.c_void_p(stack + 65536 - 64)
    if libc.clone(exit_thread, top, VM | FS | SIGHAND | THREAD | SYSVSEM, None) > 0:
        print("ESCAPED a thread with its own files")
    print("done")
