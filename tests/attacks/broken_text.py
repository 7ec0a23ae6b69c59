"""Prints broken UTF-8, NULs, surrogates, escape codes and endless lines.

Must: refused.
"""

import os

for text in (
    b"\xe2\x82",
    b"\xff" * 100,
    b"\x00" * 100,
    b"\xed\xa0\x80",
    b"\x1b[2J\x1b]52;c;eA==\x07",
    b"\xe2\x80\xae",
    b"\r" * 99,
):
    os.write(1, text + b"\n")
    os.write(2, text)
os.write(1, b"\xf0\x9f" * 2000 + b"\n")
print("\ud800".encode("utf-8", "surrogatepass") + b"x" * 50000)
print("done")
