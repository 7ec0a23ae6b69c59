"""Which grades a feedback page shows: a file beside the page holds their digest."""

from __future__ import annotations

from pathlib import Path

MARK = ".grades"
"""The file beside a feedback page with a digest of the grades that the page shows."""


def shows(page: Path, digest: str | None) -> bool:
    """Return whether a feedback page is there and shows the grades with this digest."""
    mark = page.with_name(MARK)
    return page.is_file() and mark.is_file() and mark.read_text(encoding="utf-8") == digest
