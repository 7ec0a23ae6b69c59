"""The page of reason codes: what must have been seen for each, the section that explains it, and the picture."""

from __future__ import annotations

from pathlib import Path

from autograder.course.settings import Book, read_book
from autograder.reasons import Group, Kind, all_kinds

ROOT = Path(__file__).resolve().parent.parent.parent
PICTURES = {
    "timeline": "the callbacks over time",
    "qos": "what each publisher offers, and what each subscription requests",
}


def reason_codes() -> str:
    """The page of reason codes, one heading for each group of the registry."""
    book = read_book(ROOT)
    kinds = sorted(all_kinds().values(), key=lambda kind: kind.code)
    lines: list[str] = []
    for group in Group:
        lines += [f"## {group}", ""]
        for kind in kinds:
            if kind.group is group:
                lines += _entry(kind, book)
    return "\n".join(lines)


def _entry(kind: Kind, book: Book) -> list[str]:
    lines = [f"({label(kind.code)})=", f"**`{kind.code}`**", f": {_capital(kind.seen)}.", ""]
    section = book.sections.get(kind.code)
    if section is not None:
        page, _, place = section.place.partition(".html")
        lines += [f"  - Read on: [{section}](/{page}.md{place})"]
    if kind.picture:
        lines += [f"  - A picture shows {PICTURES[kind.picture]}."]
    return [*lines, ""]


def _capital(text: str) -> str:
    """A sentence's beginning, unless its first word is code."""
    return text[:1].upper() + text[1:] if text.split()[0].isalpha() else text


def label(code: str) -> str:
    """The name by which other pages point to a code."""
    return f"code-{code}"
