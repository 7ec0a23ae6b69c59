"""Leaves notes in what the system keeps of its files in memory, for the next launch of the check.

Must, alone, twice: refused.
"""

import ctypes
import mmap
import os

from _tries import call, libc, tries

file = os.open(os.__file__, os.O_RDONLY)
os.pread(file, 1, 0)  # a note: this page is in memory now
tries("reads only what is in memory", lambda: os.preadv(file, [bytearray(1)], 0, os.RWF_NOWAIT))
tries("takes a page out of memory", lambda: os.posix_fadvise(file, 0, 0, os.POSIX_FADV_DONTNEED))
tries("reads pages ahead", lambda: call(187, file, 0, 4096))
pages = mmap.mmap(file, 4096, access=mmap.ACCESS_COPY)
address = ctypes.addressof(ctypes.c_char.from_buffer(pages))
tries(
    "asks which pages are in memory",
    lambda: libc.mincore(ctypes.c_void_p(address), 4096, ctypes.create_string_buffer(1)),
)
