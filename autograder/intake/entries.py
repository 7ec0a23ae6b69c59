"""What lies side by side in a class: folders, zips and files, whose names decide whose they are.

The names at this level were written by a learning platform, or by who put the class together. What lies inside an
entry was written by a student, and decides nothing about whose it is.

A format makes claims of the entries: whose each is, by its name.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from autograder.core.errors import KitError
from autograder.core.files import read_plain
from autograder.intake.members import (
    MOST,
    Member,
    TooManyError,
    bad_names,
    empty_folders,
    in_folder,
    in_zip,
    is_notebook,
    is_unseen,
    is_zip,
    looked_into,
    packed_in,
    unpacked,
)
from autograder.intake.words import some

_MOST_OF_CLASS = 500_000
"""Files in a zip; a class of five thousand repositories has fewer."""


class NotUnderstoodError(Exception):
    """Something was handed in, and not in a way that says which notebook counts. Nobody gets a zero for that."""


class Kind(Enum):
    """What an entry is."""

    FOLDER = auto()
    ZIP = auto()
    NOTEBOOK = auto()
    OTHER = auto()
    """A file of another kind."""
    LINK = auto()
    """Which is not followed."""


@dataclass(eq=False)
class Entry:
    """One thing in a class."""

    path: tuple[str, ...]
    """From the source on; the last part is its name."""
    kind: Kind
    list_files: Callable[[], list[Member]]
    list_entries: Callable[[], list[Entry]]
    shown: str = ""
    """How a sentence calls a link."""

    @property
    def name(self) -> str:
        """Its name at the level of the class."""
        return self.path[-1]

    @property
    def stem(self) -> str:
        """Its name; of a file and a zip without the ending."""
        return self.name.rpartition(".")[0] if self.kind in (Kind.ZIP, Kind.NOTEBOOK, Kind.OTHER) else self.name

    @property
    def is_work(self) -> bool:
        """Whether it may hold a notebook."""
        return self.kind in (Kind.FOLDER, Kind.ZIP, Kind.NOTEBOOK)

    @cached_property
    def files(self) -> list[Member]:
        """The files in it; of a file, that file.

        Raises:
            NotUnderstoodError: it cannot be looked into, or is too large for anybody's work.
        """
        try:
            return self.list_files()
        except NotUnderstoodError:
            raise
        except TooManyError as error:
            raise NotUnderstoodError(f"cannot be anybody's work: {error}") from error
        except Exception as error:  # a damaged zip raises many kinds
            why = getattr(error, "strerror", None) or error
            raise NotUnderstoodError(f"cannot be read ({why})") from error

    @cached_property
    def inside(self) -> list[Entry]:
        """What lies in a folder or zip, if that should be one around a class; nothing if it cannot be read."""
        try:
            return self.list_entries()
        except Exception:  # a damaged zip raises many kinds; reading its files says which
            return []

    def below(self, member: Member) -> tuple[str, ...]:
        """Return a file's path in this folder or zip."""
        # A zip counts as a folder of its name without the ending, so its path is as long.
        return member.path[len(self.path) :] if self.kind in (Kind.FOLDER, Kind.ZIP) else (member.name,)


@dataclass
class Listed:
    """What lies in a source."""

    entries: list[Entry]
    bad: list[str] = field(default_factory=list)
    """Names in a zip that lead nowhere in it."""

    def bad_names(self) -> list[str]:
        """Return a sentence about the bad names, if there are any."""
        if not self.bad:
            return []
        names = some([repr(name[:60]) for name in self.bad], ", ")
        return [f"The zip has entries whose names lead nowhere in it; they were left out: {names}."]


def listed(source: Path, lab: str) -> Listed:
    """Return what lies in a folder or zip.

    Raises:
        KitError: it is neither, or no class.
    """
    if source.is_dir():
        return Listed(_of_folder(source, ()))
    try:
        archive = zipfile.ZipFile(source)
    except Exception as error:  # a damaged directory raises more than BadZipFile
        raise KitError(
            f"{source} is neither a folder nor a zip that can be read ({error}).",
            f"Give a folder that holds `<student>/{lab}.ipynb` for each student, or a whole zip of it.",
        ) from error
    if not archive.infolist():
        raise KitError(f"{source} is an empty zip: there is nothing in it.", "Download or pack it once more.")
    if len(archive.infolist()) > _MOST_OF_CLASS:
        raise KitError(f"{source} has {len(archive.infolist())} entries; that is no class.", "Check the file.")
    bad: list[str] = []
    files = list(in_zip(archive, bad))
    return Listed(grouped(files, (), list(empty_folders(archive))), bad)


def _of_folder(source: Path, parts: tuple[str, ...]) -> list[Entry]:
    entries = []
    for path in sorted(source.joinpath(*parts).iterdir()):
        where = (*parts, path.name)
        if is_unseen(path.name):
            continue
        if path.is_symlink():
            shown = str(path).encode("utf-8", "replace").decode()
            entries.append(Entry(where, Kind.LINK, list, list, shown))
        elif path.is_dir():
            listing = partial(_few, partial(in_folder, source, where))
            entries.append(Entry(where, Kind.FOLDER, listing, partial(_of_folder, source, where)))
        else:
            entries.append(_file(Member(where, partial(read_plain, source, where))))
    return entries


def _few(files: Callable[[], Iterator[Member]]) -> list[Member]:
    """The files of one student, with those in zips that can be read.

    Raises:
        TooManyError: there are more than that can be.
    """
    found: list[Member] = []
    for file in files():
        found += looked_into(file)
        if len(found) > MOST:
            raise TooManyError(f"it holds more than {MOST} files")
    return found


def _file(member: Member) -> Entry:
    if is_zip(member.name):
        above = (*member.path[:-1], member.name[: -len(".zip")])
        held = partial(unpacked, member)
        return Entry(member.path, Kind.ZIP, partial(_some, member, held), lambda: grouped(packed_in(member), above))
    kind = Kind.NOTEBOOK if is_notebook(member.name) else Kind.OTHER
    return Entry(member.path, kind, lambda: [member], list)


def _some(member: Member, held: Callable[[], list[Member]]) -> list[Member]:
    files = held()
    if not files:
        bad = bad_names(member)
        raise NotUnderstoodError(
            f"is a zip whose names lead nowhere in it, such as {bad[0][:60]!r}" if bad else "is an empty zip"
        )
    return files


def grouped(files: Sequence[Member], above: tuple[str, ...], empty: Sequence[tuple[str, ...]] = ()) -> list[Entry]:
    """Return what lies side by side in a zip, or in a folder of it.

    Args:
        files: of the zip.
        above: the folder.
        empty: paths of folders that the zip names, whether they hold anything or not.
    """
    depth = len(above)
    folders: dict[str, list[Member]] = {
        path[depth]: [] for path in empty if len(path) == depth + 1 and path[:depth] == above
    }
    single: list[Member] = []
    for member in files:
        if member.path[:depth] != above:
            continue
        if len(member.path) > depth + 1:
            folders.setdefault(member.path[depth], []).append(member)
        else:
            single.append(member)
    entries = [
        Entry(
            (*above, name),
            Kind.FOLDER,
            partial(_few, partial(iter, held)),
            partial(grouped, held, (*above, name), empty),
        )
        for name, held in folders.items()
    ]
    entries = [*entries, *map(_file, single)]
    return sorted((entry for entry in entries if not is_unseen(entry.name)), key=lambda entry: entry.path)


@dataclass(frozen=True)
class Claim:
    """An entry that is somebody's."""

    entry: Entry
    owner: Mapping[str, str]
    """What the platform calls the student, by kind: `name`, `email`, `id`, `canvas_id`, `moodle_id`, `github`."""
    called: str = ""
    """A file's name as the student gave it, without what the platform put before it."""
    attempt: tuple[Any, ...] = ()
    """Of two attempts of one student, the greater one is the later."""
    number: int = 0
    """The same for the files of one attempt, where the platform counts them."""
    turn: tuple[Any, ...] = ()
    """Of the files of one attempt, the one with the greatest counts."""
    handed_in: str = ""
    """Date and time, as nbgrader reads them; empty if nothing says so."""
    late: bool = False
    """The platform has marked it as late."""
    by_hand: bool = False
    """Its name is not of the platform's form: somebody has added it."""
    only: str = ""
    """The folder in the entry in which the work for this lab lies; empty: anywhere."""


@dataclass
class Recognised:
    """What a format makes of the entries of a class."""

    claims: list[Claim] = field(default_factory=list)
    strange: list[str] = field(default_factory=list)
    """Sentences about what was recognised and is nobody's."""
    aside: list[Entry] = field(default_factory=list)
    """What is of another lab, or tells whose the others are: it is not used, and needs not be."""
