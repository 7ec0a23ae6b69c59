"""The file `submission_secret.txt`, which nbgrader's exchange puts beside a notebook and needs to return feedback."""

from __future__ import annotations

import re

FILE_NAME = "submission_secret.txt"
MOST_BYTES = 1000

_SECRET = re.compile(r"[0-9a-f]{1,512}", re.ASCII)


def secret(content: bytes) -> str:
    """Return the secret in such a file; empty if the file does not have the form that the exchange writes."""
    text = content.decode("ascii", "replace").strip()
    return text if _SECRET.fullmatch(text) else ""
