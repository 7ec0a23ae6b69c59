"""The entries of a class: folders, zips and files side by side, whose names say to which student they belong.

The names at this level were written by a learning platform, or by the person who put the class together. The names
inside an entry were written by a student, so they do not decide to whom the entry belongs.

A format turns entries into claims: a claim says to whom an entry belongs according to its name.
"""

from __future__ import annotations

import os
import pwd
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
    Budget,
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
"""The number of files that a zip may have. A class of five thousand repositories has fewer."""


class NotUnderstoodError(Exception):
    """Something was handed in, but it is unclear which notebook counts. Nobody gets a zero because of this."""


class Kind(Enum):
    """The kind of an entry."""

    FOLDER = auto()
    ZIP = auto()
    NOTEBOOK = auto()
    OTHER = auto()
    """A file of another kind."""
    LINK = auto()
    """A link, which is not followed."""


@dataclass(eq=False)
class Entry:
    """A folder, zip, file or link in a class."""

    path: tuple[str, ...]
    """The path in the source; the last part is the entry's name."""
    kind: Kind
    list_files: Callable[[], list[Member]]
    list_entries: Callable[[], list[Entry]]
    shown: str = ""
    """The path of a link, as a sentence shows it."""
    account: str = ""
    """The account of another user that a folder on disk belongs to; empty if it belongs to the person who grades."""

    @property
    def name(self) -> str:
        """The entry's name at the level of the class."""
        return self.path[-1]

    @property
    def stem(self) -> str:
        """The entry's name; for a file or zip, without the ending."""
        return self.name.rpartition(".")[0] if self.kind in (Kind.ZIP, Kind.NOTEBOOK, Kind.OTHER) else self.name

    @property
    def is_work(self) -> bool:
        """Whether the entry may contain a notebook."""
        return self.kind in (Kind.FOLDER, Kind.ZIP, Kind.NOTEBOOK)

    @property
    def files(self) -> list[Member]:
        """The files in a folder or zip; for a file, the file itself.

        Raises:
            NotUnderstoodError: the entry cannot be read, or has more files than the work of a student can have.
        """
        listed = self._listed
        if isinstance(listed, NotUnderstoodError):
            raise listed
        return listed

    @cached_property
    def _listed(self) -> list[Member] | NotUnderstoodError:
        """The files, or why there are none, because to find that out may take long."""
        try:
            return self.list_files()
        except NotUnderstoodError as error:
            return error
        except TooManyError as error:
            return NotUnderstoodError(f"cannot be the work of one student: {error}")
        except Exception as error:  # a damaged zip raises many kinds of errors
            return NotUnderstoodError(f"cannot be read ({getattr(error, 'strerror', None) or error})")

    @cached_property
    def inside(self) -> list[Entry]:
        """The entries in a folder or zip, which may contain a whole class; empty if it cannot be read."""
        try:
            return self.list_entries()
        except Exception:  # a damaged zip raises many kinds of errors, which are reported when its files are read
            return []

    def below(self, member: Member) -> tuple[str, ...]:
        """Return the path of a file in this folder or zip."""
        # A zip counts as a folder with its name without the ending, so both paths have the same length.
        return member.path[len(self.path) :] if self.kind in (Kind.FOLDER, Kind.ZIP) else (member.name,)


@dataclass
class Listed:
    """The contents of a source."""

    entries: list[Entry]
    bad: list[str] = field(default_factory=list)
    """Names in a zip that are no valid paths in it."""

    def bad_names(self) -> list[str]:
        """Return a sentence about the bad names, if there are any."""
        if not self.bad:
            return []
        names = some([repr(name[:60]) for name in self.bad], ", ")
        return [f"Some names in the zip are no valid paths; these entries were left out: {names}."]


def listed(source: Path, lab: str) -> Listed:
    """Return the entries of a folder or zip.

    Raises:
        KitError: the source is neither a folder nor a zip, or is an empty zip, or has too many files for a class.
    """
    if source.is_dir():
        return Listed(_of_folder(source, ()))
    try:
        archive = zipfile.ZipFile(source)
    except Exception as error:  # a zip with a damaged directory raises more than BadZipFile
        raise KitError(
            f"{source} is neither a folder nor a zip that can be read ({error}).",
            f"Give a folder that holds `<student>/{lab}.ipynb` for each student, or a whole zip of it.",
        ) from error
    if not archive.infolist():
        raise KitError(f"{source} is an empty zip.", "Download or pack it again.")
    if len(archive.infolist()) > _MOST_OF_CLASS:
        raise KitError(
            f"{source} has {len(archive.infolist())} entries, which is too many for a class.", "Check the file."
        )
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
            inside = partial(_of_folder, source, where)
            entries.append(Entry(where, Kind.FOLDER, listing, inside, account=account_of(path)))
        else:
            entries.append(_file(Member(where, partial(read_plain, source, where))))
    return entries


def account_of(path: Path) -> str:
    """Return the account of another user to whom a folder or a link belongs; empty if it belongs to this user.

    Raises:
        OSError: there is no such folder.
    """
    owner = path.lstat().st_uid
    if owner == os.geteuid():
        return ""
    try:
        return pwd.getpwuid(owner).pw_name
    except KeyError:  # it has been deleted, or is one of a container
        return f"number {owner}"


def _few(files: Callable[[], Iterator[Member]]) -> list[Member]:
    """Return the files of one student, including those in zips that can be read.

    Raises:
        TooManyError: there are more files than the work of a student can have.
    """
    found: list[Member] = []
    budget = Budget()
    for file in files():
        found += looked_into(file, budget)
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
            f"is a zip in which no name is a valid path, such as {bad[0][:60]!r}" if bad else "is an empty zip"
        )
    return files


def grouped(files: Sequence[Member], above: tuple[str, ...], empty: Sequence[tuple[str, ...]] = ()) -> list[Entry]:
    """Return the entries of a zip, or of a folder in it.

    Args:
        files: the files of the zip.
        above: the path of the folder.
        empty: the paths of the folders that the zip lists, whether or not they contain anything.
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
    """A statement that an entry belongs to a student."""

    entry: Entry
    owner: Mapping[str, str]
    """The platform's names for the student, by kind, such as `name`, `email`, `id`, `canvas_id` or `github`."""
    called: str = ""
    """The name that the student gave to the file, without what the platform put before it."""
    attempt: tuple[Any, ...] = ()
    """A value that is greater for a later attempt of the same student."""
    number: int = 0
    """A number that is greater for a later file of the same attempt, if the platform counts them."""
    turn: tuple[Any, ...] = ()
    """The rank of the file in its attempt. The file with the greatest rank counts."""
    handed_in: str = ""
    """The date and time of the submission, in a form that nbgrader reads; empty if they are unknown."""
    late: bool = False
    """Whether the platform has marked the submission as late."""
    by_hand: bool = False
    """Whether a person has added the entry, because its name does not have the platform's form."""
    only: str = ""
    """The folder in the entry that contains the work for this lab; empty if the work may be anywhere in the entry."""


@dataclass
class Recognised:
    """The entries of a class, as a format understands them."""

    claims: list[Claim] = field(default_factory=list)
    strange: list[str] = field(default_factory=list)
    """Sentences about entries that cannot be assigned to a student."""
    aside: list[Entry] = field(default_factory=list)
    """Entries that are no submissions for this lab, such as work for another lab or the platform's own files."""
