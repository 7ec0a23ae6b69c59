"""Makes rules for Landlock, each of which costs the kernel memory that no limit counts.

Must: refused.
"""

import ctypes
import struct

from _tries import call, tries

ports = ctypes.create_string_buffer(struct.pack("QQ", 0, 3), 16)
tries("a set of rules", lambda: call(444, ports, 16, 0))
print("done")
