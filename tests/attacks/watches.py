"""Makes watches, event queues and locks without end.

Must: refused.
"""

import os
import select

from _tries import libc, tries

made = 0
try:
    while made < 5000:
        one = libc.inotify_init()
        if one < 0:
            break
        for _ in range(100):
            libc.inotify_add_watch(one, b"/tmp", 0xFFF)
        select.epoll().register(one)
        made += 1
except OSError:
    pass
tries("watches", lambda: -1 if made < 1000 else made)
os.write(1, b"done\n")
os._exit(0)
