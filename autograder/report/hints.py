"""How a student goes on after a finding: hints one at a time, and the section of a lecture that explains the reason."""

from __future__ import annotations

import re
from dataclasses import dataclass

from autograder.core.results import Outcome
from autograder.course.book import Book, Section

_PIECE = re.compile(r";\s+|(?<=[.?!])\s+(?=[A-Z`])")


@dataclass(frozen=True)
class Hint:
    """One hint; the next one tells more."""

    text: str
    section: Section | None = None
    """Where to read on."""


def hints(outcome: Outcome, book: Book) -> list[Hint]:
    """Return an outcome's hints, the one that tells least first: where to read on, then what to look at or to do."""
    pieces = [piece.strip() for piece in _PIECE.split(outcome.hint) if piece.strip()]
    pointing = [(piece, book.named_in(piece)) for piece in pieces]
    read = [Hint(_sentence(text), section) for text, section in pointing if section is not None]
    section = book.sections.get(outcome.code)
    if not read and section is not None:
        read = [Hint(f"{section}.", section)]
    named = {hint.text for hint in read}
    return [*read, *(Hint(text) for text in map(_sentence, pieces) if text not in named)]


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "?", "!", ":", "…", "`")) else f"{text}."
