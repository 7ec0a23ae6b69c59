"""By what a student fetches feedback: the `submission_secret.txt` that nbgrader's exchange puts beside a notebook."""

from __future__ import annotations

import re

FILE_NAME = "submission_secret.txt"
MOST_BYTES = 1000

_SECRET = re.compile(r"[0-9a-f]{1,512}", re.ASCII)


def secret(content: bytes) -> str:
    """Return what such a file says; empty if it is none that the exchange makes."""
    text = content.decode("ascii", "replace").strip()
    return text if _SECRET.fullmatch(text) else ""
