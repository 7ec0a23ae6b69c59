"""A course's settings, `course.toml`: with the sections of its lectures that explain the reasons.

What concerns nbgrader stands in nbgrader's own file, `nbgrader_config.py`.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from autograder.core.errors import KitError

SETTINGS_FILE = "course.toml"


class CourseSettings(BaseModel):
    """What `course.toml` may say; a course without one has these values."""

    model_config = ConfigDict(extra="forbid")

    title: str = "The labs"
    """Heading of the students' start page."""
    labs: list[str] = []
    """The labs in the course's order; those that it leaves out follow by their names."""
    executor: str = "local"
    """Who runs the jobs of a class, `NAME` or `NAME://ADDRESS`, by the names of `autograder.grading.executors`."""
    lectures: dict[str, str] = {}
    """The lectures, by the names that hints use for them, such as `Week 2`: the page of each in the book."""
    sections: dict[str, dict[str, list[str]]] = {}
    """By a lecture's name and a section's title: the codes of the reasons that this section explains."""

    @model_validator(mode="after")
    def _each_code_has_one_section(self) -> Self:
        unknown = [name for name in self.sections if name not in self.lectures]
        codes = Counter(code for titles in self.sections.values() for found in titles.values() for code in found)
        twice = [code for code, times in codes.items() if times > 1]
        if unknown:
            raise ValueError(f"`sections` names a lecture that `lectures` does not have, {unknown[0]!r}")
        if twice:
            raise ValueError(f"`sections` has the code {twice[0]!r} in two sections")
        return self


def read_settings(root: Path) -> CourseSettings:
    """Read the settings of the course at `root`.

    Raises:
        KitError: the file cannot be read, or says what no course can say.
    """
    path = root / SETTINGS_FILE
    try:
        return CourseSettings.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return CourseSettings()
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise KitError(f"{path} is no TOML: {error}.", "Repair that line.") from error
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        if first["type"] == "extra_forbidden":
            known = ", ".join(CourseSettings.model_fields)
            raise KitError(f"{path} sets `{key}`, which is no setting of a course.", f"Settings: {known}.") from error
        if not key:  # what the settings say together
            raise KitError(f"{path}: {first['msg'].removeprefix('Value error, ')}.", "Repair that table.") from error
        raise KitError(f"{path}: `{key}` cannot be {first['input']!r}: {first['msg']}.", "Repair that line.") from error


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
