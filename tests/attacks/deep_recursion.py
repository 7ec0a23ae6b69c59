"""Overflows the stack of the interpreter itself.

Must: ended by signal 11.
"""

import ctypes
import faulthandler

faulthandler.disable()
ctypes.string_at(0)
