"""Makes empty files, folders, links and attributes without end: memory of the kernel that is in no file.

Must: refused.
"""

import os

for folder in ("/tmp", "/dev/shm", os.environ["HOME"]):
    for name, make in {
        "files": lambda path: os.close(os.open(path, os.O_CREAT | os.O_WRONLY)),
        "folders": os.mkdir,
        "links": lambda path: os.symlink("x" * 4000, path),
        "hard links": lambda path: os.link("/tmp/one", path),
        "pipes": os.mkfifo,
    }.items():
        made = 0
        try:
            for made in range(100_000):
                make(f"{folder}/{name}{made}")
        except OSError:
            pass
        if made > 2048:
            print("ESCAPED", folder, name, made)
try:
    for number in range(100_000):
        os.setxattr("/tmp/files0", f"user.x{number}", b"x" * 60000)
    print("ESCAPED attributes")
except OSError:
    pass
print("done")
