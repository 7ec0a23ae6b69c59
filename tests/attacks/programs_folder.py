"""Changes its own folder: writes, links, renames, other rights, other times.

Must: refused.
"""

import os

from _tries import tries

HERE = "/home/student"
own = os.path.basename(__file__)
tries("write", lambda: os.open(f"{HERE}/new.py", os.O_CREAT | os.O_WRONLY))
tries("truncate", lambda: os.open(f"{HERE}/{own}", os.O_WRONLY | os.O_TRUNC))
tries("symlink", lambda: os.symlink("/etc/passwd", f"{HERE}/honest.py.txt") or "made")
tries("link", lambda: os.link(f"{HERE}/{own}", f"{HERE}/other.py") or "made")
tries("rename", lambda: os.rename(f"{HERE}/{own}", f"{HERE}/other.py") or "made")
tries("replace the folder", lambda: os.rename(HERE, "/home/other") or "made")
tries("chmod", lambda: os.chmod(f"{HERE}/{own}", 0o777) or "done")
tries("utime", lambda: os.utime(f"{HERE}/{own}", (1, 1)) or "done")
tries("remove", lambda: os.unlink(f"{HERE}/honest.py") or "done")
tries("xattr", lambda: os.setxattr(f"{HERE}/{own}", "user.x", b"y") or "done")
print("done")
