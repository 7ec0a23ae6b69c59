"""When a student handed in: the `timestamp.txt` that nbgrader's exchange puts beside a notebook."""

from __future__ import annotations

import re

FILE_NAME = "timestamp.txt"
MOST_BYTES = 200

_MOMENT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d{1,9})?)?( ?(UTC|Z|[+-]\d\d:?\d\d))?", re.ASCII)
"""A date and a time as nbgrader and ISO 8601 write them; without a zone it is UTC."""


def moment(content: bytes) -> str | None:
    """Return what a timestamp file says, for nbgrader to read; None if it is no date and time."""
    text = content.decode("utf-8", "replace").strip()
    return text if _MOMENT.fullmatch(text) else None
