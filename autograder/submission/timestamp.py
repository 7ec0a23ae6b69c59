"""The file `timestamp.txt`, which nbgrader's exchange puts beside a notebook and which says when it was handed in."""

from __future__ import annotations

import re

FILE_NAME = "timestamp.txt"
MOST_BYTES = 200

_MOMENT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d{1,9})?)?( ?(UTC|Z|[+-]\d\d:?\d\d))?", re.ASCII)
"""A date and a time in the form of nbgrader or ISO 8601. Without a time zone it is UTC."""


def moment(content: bytes) -> str | None:
    """Return the text of a timestamp file for nbgrader; None if it is not a date and time."""
    text = content.decode("utf-8", "replace").strip()
    return text if _MOMENT.fullmatch(text) else None
