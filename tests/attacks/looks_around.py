"""Looks for the checks, for other programs, and for what others put into their environment.

Must: refused.
"""

import os

for folder, folders, files in os.walk("/"):
    if folder in ("/proc", "/sys", "/usr"):
        folders.clear()
    for name in [*folders, *files]:
        if "secret" in name and "site-packages" not in folder and "/lib/python" not in folder:
            print("ESCAPED", os.path.join(folder, name))
for pid in filter(str.isdigit, os.listdir("/proc")):
    for name in ("environ", "cmdline", "mem", "maps", "root", "cwd"):
        if int(pid) == os.getpid():
            continue
        try:
            if name in ("root", "cwd"):
                text = str(os.listdir(f"/proc/{pid}/{name}")).encode()
            else:
                with open(f"/proc/{pid}/{name}", "rb") as file:
                    text = file.read(100000)
        except OSError:
            continue
        if b"secret" in text.lower():
            print("ESCAPED", pid, name, text)
for name in os.environ:
    if "secret" in name.lower():
        print("ESCAPED", name)
