"""Uses names that are long, or made of escape codes, line ends and broken text.

Must: refused.
"""

import os

for name in (b"n" * 255, b"\x1b]0;x\x07", b"line\nend", b"\xff\xfe", b"-rf", b" ", b"\xe2\x80\xae", b"CON", b"a" * 256):
    for folder in (b"/tmp/", b"/dev/shm/"):
        try:
            os.mkdir(folder + name)
            os.close(os.open(folder + name + b"/" + name, os.O_CREAT))
        except OSError:
            pass
print("done")
