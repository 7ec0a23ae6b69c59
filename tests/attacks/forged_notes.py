"""Forges notes of the probe: deep nesting, huge numbers, wrong types, other programs' names, long lines.

Must: refused.
"""

import os
import time

NOTES = [
    b'{"e": "memory_error"}',
    b"[" * 4000, b'{"e": ' * 500, b'{"e": 1' + b"0" * 3900 + b"}", b'{"e": NaN, "line": [[]]}',
    b'{"e": "in_callback", "what": ["client.call"], "line": 7, "code": null}', b'{"e": "node", "name": {"a": [{}]}}',
    b'{"e": "' + b"x" * 60000, b'"' + b"\\ud800" * 500 + b'"', b"\x00" * 4000, b'{"\\ud800": "\\udfff"}',
]  # fmt: skip
for _ in range(100):
    for note in NOTES:
        try:
            os.write(3, note + b"\n")
        except BlockingIOError:
            time.sleep(0.001)
print("done")
