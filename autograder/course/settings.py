"""Read a course's settings from `course.toml`, which also says which sections of the lectures explain which reasons.

Settings of nbgrader are in nbgrader's own file, `nbgrader_config.py`.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, NonNegativeFloat, ValidationError, model_validator

from autograder.core.errors import KitError

SETTINGS_FILE = "course.toml"


class CourseSettings(BaseModel):
    """The settings that `course.toml` may contain. A course without this file has the default values."""

    model_config = ConfigDict(extra="forbid")

    title: str = "The labs"
    """The heading of the students' start page."""
    labs: list[str] = []
    """The labs in the course's order. Labs that are not listed follow in the order of their names."""
    executor: str = "local"
    """The executor that runs the jobs of a class, as `NAME` or `NAME://ADDRESS`; see `autograder.grading.executors`."""
    history_for_students: bool = False
    """Whether the feedback page shows the history of the points: when the lab was graded, and what changed and why."""
    weights: dict[str, NonNegativeFloat] = {}
    """The weight of each lab in the term's total; a lab that is not listed has the weight 1."""
    lectures: dict[str, str] = {}
    """The page of each lecture in the book, by the name that hints use for the lecture, such as `Week 2`."""
    sections: dict[str, dict[str, list[str]]] = {}
    """The codes of the reasons that a section explains, by the lecture's name and the section's title."""

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
        KitError: the file is not valid TOML, or contains an unknown setting or a wrong value.
    """
    path = root / SETTINGS_FILE
    try:
        return CourseSettings.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return CourseSettings()
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise KitError(f"{path} is not valid TOML: {error}.", "Repair that line.") from error
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        if first["type"] == "extra_forbidden":
            known = ", ".join(CourseSettings.model_fields)
            raise KitError(
                f"{path} sets `{key}`, which is not a setting of a course.", f"Settings: {known}."
            ) from error
        if not key:  # the settings contradict each other
            raise KitError(f"{path}: {first['msg'].removeprefix('Value error, ')}.", "Repair that table.") from error
        raise KitError(f"{path}: `{key}` cannot be {first['input']!r}: {first['msg']}.", "Repair that line.") from error


@dataclass(frozen=True)
class Section:
    """A section of a lecture."""

    lecture: str
    """The lecture's name in hints, such as `Week 2`."""
    title: str
    page: str
    """The lecture's page in the book, without the file ending."""

    def __str__(self) -> str:
        """Return the section as a hint names it."""
        return f"{self.lecture}, section '{self.title}'"

    @property
    def place(self) -> str:
        """The link to the section from the book's first page."""
        slug = re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")
        return f"{self.page}.html#{slug}"


@dataclass(frozen=True)
class Book:
    """The lectures of a course. The book is empty if the course has no lectures."""

    pages: dict[str, str] = field(default_factory=dict)
    """The lectures' pages, by the names that hints use."""
    sections: dict[str, Section] = field(default_factory=dict)
    """The section that explains a reason, by the reason's code."""
    address: str = ""
    """The link to the folder of the lectures as HTML; empty if there is none."""

    def named_in(self, text: str) -> Section | None:
        """Return the first section that a text names, as in `Week 2, section 'Groups'`; None if it names none."""
        names = "|".join(map(re.escape, self.pages)) or "(?!)"
        found = re.search(rf"\b({names}), (?:sections? )?'([^']+)'", text, re.IGNORECASE)
        if found is None:
            return None
        lecture = next(name for name in self.pages if name.casefold() == found[1].casefold())
        return Section(lecture, found[2], self.pages[lecture])


NO_BOOK = Book()
"""The book of a course without lectures in its settings."""


def read_book(root: Path, address: str = "") -> Book:
    """Read what `course.toml` says about the lectures of the course at `root`.

    Args:
        root: the course's folder.
        address: the link to the folder of the lectures as HTML.

    Raises:
        KitError: see `read_settings`.
    """
    settings = read_settings(root)
    explained = {
        code: Section(lecture, title, settings.lectures[lecture])
        for lecture, titles in settings.sections.items()
        for title, codes in titles.items()
        for code in codes
    }
    return Book(settings.lectures, explained, address)
