"""Takes the events of asynchronous reading and writing, of which the whole machine has one number.

Must: refused.
"""

import ctypes

from _tries import call, tries

context = ctypes.c_ulong(0)
tries("events", lambda: call(206, 1000, ctypes.byref(context)))
print("done")
