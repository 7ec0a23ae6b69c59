"""What a lint finds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a lab."""

    cell: str
    """grade_id of the cell, or its number where it has none; empty: it is about the whole lab."""
    what: str
    """A sentence for the lab's author."""
    warning: bool = False
    """Whether a lab can be released with it."""

    def __str__(self) -> str:
        """Return it as a line to read."""
        place = f"cell `{self.cell}`: " if self.cell else ""
        return f"{'warning' if self.warning else 'error'}: {place}{self.what}"
