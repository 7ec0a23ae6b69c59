"""Where a course explains what: the sections of its lectures, by the codes of reasons, as `course.toml` has them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from autograder.course.settings import read_settings


@dataclass(frozen=True)
class Section:
    """A section of a lecture."""

    lecture: str
    """As hints name it, such as `Week 2`."""
    title: str
    page: str
    """The lecture's page in the book, without its ending."""

    def __str__(self) -> str:
        """As a hint names it."""
        return f"{self.lecture}, section '{self.title}'"

    @property
    def place(self) -> str:
        """Its place in the book, as a link from the book's first page."""
        slug = re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")
        return f"{self.page}.html#{slug}"


@dataclass(frozen=True)
class Book:
    """A course's lectures; those of a course that names none are empty."""

    pages: dict[str, str] = field(default_factory=dict)
    """The lectures' pages by the names that hints use."""
    sections: dict[str, Section] = field(default_factory=dict)
    """The section that explains a reason, by the reason's code."""
    address: str = ""
    """Link to the folder of the lectures as HTML; empty if there is none."""

    def named_in(self, text: str) -> Section | None:
        """Return the section that a text points to, as `Week 2, section 'Groups'` does; None if none."""
        names = "|".join(map(re.escape, self.pages)) or "(?!)"
        found = re.search(rf"\b({names}), (?:section )?'([^']+)'", text, re.IGNORECASE)
        if found is None:
            return None
        lecture = next(name for name in self.pages if name.casefold() == found[1].casefold())
        return Section(lecture, found[2], self.pages[lecture])


NO_BOOK = Book()
"""That of a course which says nothing of its lectures."""


def read_book(root: Path, address: str = "") -> Book:
    """Read what `course.toml` says of the lectures of the course at `root`.

    Args:
        root: the course's folder.
        address: link to the folder of the lectures as HTML.

    Raises:
        KitError: the file cannot be read.
    """
    settings = read_settings(root)
    explained = {
        code: Section(lecture, title, settings.lectures[lecture])
        for lecture, titles in settings.sections.items()
        for title, codes in titles.items()
        for code in codes
    }
    return Book(settings.lectures, explained, address)
