"""Becomes root by setuid programs, by its own setuid file, and by asking.

Must: refused.
"""

import os
import shutil
import stat

from _tries import call, tries

for folder in ("/usr/bin", "/usr/sbin", "/usr/lib"):
    for name in os.listdir(folder):
        path = os.path.join(folder, name)
        try:
            if os.stat(path).st_mode & stat.S_ISUID and not os.statvfs(path).f_flag & os.ST_NOSUID:
                print("ESCAPED", path)
        except OSError:
            pass
shutil.copy("/bin/true", "/tmp/true")
os.chmod("/tmp/true", 0o6755)
tries("setuid file", lambda: -1 if os.statvfs("/tmp/true").f_flag & os.ST_NOSUID else "honoured")
tries("setuid", lambda: os.setuid(0) or "root")
tries("setgroups", lambda: os.setgroups([0]) or "groups")
tries("capset", lambda: call(126, b"\x22\x05\x08\x20" + bytes(4), b"\xff" * 24))
print("done")
