"""A class without a platform: a folder or a zip with a folder, or a zip, for each student."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.files import read_plain
from autograder.intake.members import MOST, Member, in_folder, in_zip, is_notebook, is_zip, members, unpacked
from autograder.intake.roster import FILE_NAME as ROSTER
from autograder.intake.wrappers import beside_all, unwrapped, visible, wrapper
from autograder.submission import exchange_secret, timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES

_NAMED = 5
"""Of more bad names than this only their number is said."""


class _NotUnderstood(Exception):
    """Something was handed in, and not in a way that says which notebook counts. Nobody gets a zero for that."""


@dataclass
class HandedIn:
    """What lies in a student's folder."""

    notebook: bytes = b""
    """Empty: there is none that can be used."""
    timestamp: bytes = b""
    """Empty: nothing says when it was handed in."""
    secret: str = ""
    """As in `Claim`."""
    file: str = ""
    owner: Mapping[str, str] = field(default_factory=dict)
    late: bool = False
    """These three as in `Taken`."""


def plain_class(source: Path, lab: str, refused: list[str]) -> dict[str, HandedIn]:
    """Return what lies in each student's folder, by its name.

    Args:
        source: a folder or a zip.
        lab: whose notebooks are wanted.
        refused: gets a sentence about each thing that is left out.

    Raises:
        KitError: it is neither, or no class.
    """
    source = unwrapped(source, lab, refused)
    return (_from_folder if source.is_dir() else _from_zip)(source, lab, refused)


def _from_folder(source: Path, lab: str, refused: list[str]) -> dict[str, HandedIn]:
    found: dict[str, HandedIn] = {}
    for entry in visible(source):
        student = _owner(entry.name, lab) if entry.is_file() else entry.name
        try:
            if entry.is_symlink():
                refused.append(f"{_shown(entry)} is a link; links are not followed, so it was left out.")
            elif student in found:
                refused.append(f"{_shown(entry)} and another entry mean the same student; it was left out.")
            elif entry.is_dir():
                found[student] = _handed_in(source, student, lab)
            elif student and is_zip(entry.name):
                found[student] = HandedIn(_notebook_in_zip(_files_of(entry), lab))
            elif student:
                found[student] = HandedIn(_filled(read_plain(source, [entry.name], NOTEBOOK_BYTES + 1), entry.name))
            elif entry.name != ROSTER:
                refused.append(beside_all(entry.name))
        except OSError as error:  # such as a folder that may not be entered: the class goes on
            refused.append(f"{_shown(entry)} cannot be read ({error.strerror}); it was left out.")
        except _NotUnderstood as reason:
            refused.append(f"{_shown(entry)} {reason}; it was left out.")
    return found


def _owner(file: str, lab: str) -> str:
    """The student after whom a notebook or a zip is named; empty if it is neither, or has the lab's name."""
    stem = file.rpartition(".")[0]
    return stem.removeprefix(f"{lab}_") if is_zip(file) or (is_notebook(file) and stem != lab) else ""


def _shown(path: Path) -> str:
    return str(path).encode("utf-8", "replace").decode()


def _notebook_in(source: Path, student: str, lab: str) -> bytes:
    """Return a student's notebook; empty if there is nothing at all.

    Raises:
        OSError: the folder or the notebook may not be read, or a part of the way is a link or something else.
        _NotUnderstood: nothing says which notebook counts.
    """
    folder = source / student
    inner = folder / lab
    paths: list[tuple[str, ...]] = [(path.name,) for path in sorted(folder.iterdir()) if path != inner]
    if inner.is_symlink() or (inner.exists() and not inner.is_dir()):
        paths.append((lab, f"{lab}.ipynb"))  # reading it says what is in the way
    elif inner.is_dir():
        paths += [(lab, path.name) for path in sorted(inner.iterdir())]
    for deeper in visible(folder):
        if deeper != inner and deeper.is_dir() and not deeper.is_symlink():
            paths += [member.path[1:] for member in in_folder(source, (student, deeper.name))]
    chosen = _choose(paths, lab)
    return _filled(read_plain(source, [student, *chosen], NOTEBOOK_BYTES + 1), chosen[-1]) if chosen else b""


def _files_of(path: Path) -> list[Member]:
    """Return what one student's zip holds.

    Raises:
        _NotUnderstood: it cannot be read.
    """
    try:
        return members(path)
    except Exception as error:  # a damaged zip raises many kinds
        raise _NotUnderstood(f"cannot be read ({error})") from error


def _notebook_in_zip(held: Sequence[Member], lab: str) -> bytes:
    """Return the notebook among the files of one student's zip; folders around all of them do no harm.

    Raises:
        _NotUnderstood: it cannot be read, or nothing says which notebook counts.
    """
    files = {member.path: member for member in held}
    while files and len({parts[0] for parts in files}) == 1 and all(len(parts) > 1 for parts in files):
        if next(iter(files))[0] == lab:
            break
        files = {parts[1:]: member for parts, member in files.items()}
    chosen = _choose(list(files), lab)
    return _filled(_read(files[chosen]), chosen[-1]) if chosen else b""


def _choose(paths: Sequence[tuple[str, ...]], lab: str) -> tuple[str, ...]:
    """Which of a student's files is the notebook: by its name, or the only one, for downloads get renamed.

    Raises:
        _NotUnderstood: there are several, or only other files.
    """
    for exact in ((f"{lab}.ipynb",), (lab, f"{lab}.ipynb")):
        if exact in paths:
            return exact
    notebooks = [path for path in paths if is_notebook(path[-1])]
    at_top, in_lab = ([path for path in notebooks if path[:-1] == place] for place in ((), (lab,)))
    notebooks = at_top or in_lab or notebooks
    named = [path for path in notebooks if path[-1].casefold() == f"{lab}.ipynb".casefold()]
    if len(named) == 1 or len(notebooks) == 1:
        return (named or notebooks)[0]
    if notebooks:
        which = "several are" if named else "none is"
        raise _NotUnderstood(f"holds {len(notebooks)} notebooks, of which {which} called {lab}.ipynb")
    ours = (timestamp.FILE_NAME, exchange_secret.FILE_NAME)
    strange = [path[-1] for path in paths if path[-1] not in ours and not path[-1].startswith(".")]
    if strange:
        raise _NotUnderstood(f"holds {strange[0][:80]!r} and no notebook")
    return ()


def _handed_in(source: Path, student: str, lab: str) -> HandedIn:
    """What lies in a student's folder; raises as `_notebook_in`."""

    def beside(name: str, most: int) -> bytes:
        for folders in ([], [lab]):
            with contextlib.suppress(OSError):
                return read_plain(source, [student, *folders, name], most)
        return b""

    return HandedIn(
        _notebook_in(source, student, lab),
        beside(timestamp.FILE_NAME, timestamp.MOST_BYTES),
        exchange_secret.secret(beside(exchange_secret.FILE_NAME, exchange_secret.MOST_BYTES)),
    )


def _open_zip(source: Path, lab: str) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(source)
    except Exception as error:  # a damaged directory raises more than BadZipFile
        raise KitError(
            f"{source} is neither a folder nor a zip that can be read ({error}).",
            f"Give a folder that holds `<student>/{lab}.ipynb` for each student, or a whole zip of it.",
        ) from error


def _from_zip(source: Path, lab: str, refused: list[str]) -> dict[str, HandedIn]:
    found: dict[str, HandedIn] = {}
    students: dict[str, dict[tuple[str, ...], Member]] = {}
    packed: dict[str, Member] = {}
    bad: list[str] = []
    with _open_zip(source, lab) as archive:
        if len(archive.infolist()) > MOST:
            raise KitError(f"{source} has {len(archive.infolist())} entries; that is no class.", "Check the file.")
        files = list(in_zip(archive, bad))
        above = wrapper([member.path for member in files], lab)
        for member in files:
            inside = member.path[len(above) :] if member.path[: len(above)] == above else ()
            student = _owner(inside[0], lab) if len(inside) == 1 else ""
            if len(inside) > 1:
                students.setdefault(inside[0], {})[inside[1:]] = member
            elif student:
                packed.setdefault(student, member)
            elif member.name != ROSTER:
                refused.append(beside_all(member.name))
        for student in dict.fromkeys([*students, *packed]):
            try:
                if student in students:
                    found[student] = _in_folder(students[student], lab)
                elif is_zip(packed[student].name):
                    found[student] = HandedIn(_notebook_in_zip(_unpacked(packed[student]), lab))
                else:
                    found[student] = HandedIn(_filled(_read(packed[student]), packed[student].name))
            except _NotUnderstood as reason:
                refused.append(f"{student[:80]!r} {reason}; it was left out.")
    for student in sorted(packed.keys() & students.keys()):
        refused.append(f"{student[:80]!r} is a folder and a file of one student; the file was left out.")
    if bad:
        names = ", ".join(repr(name[:60]) for name in bad[:_NAMED])
        more = f" and {len(bad) - _NAMED} more" if len(bad) > _NAMED else ""
        refused.append(f"The zip has entries whose names lead nowhere in it; they were left out: {names}{more}.")
    return found


def _in_folder(files: Mapping[tuple[str, ...], Member], lab: str) -> HandedIn:
    """What lies in a student's folder, by the paths in it.

    Raises:
        _NotUnderstood: it cannot be read, or nothing says which notebook counts.
    """
    chosen = _choose(list(files), lab)
    stamp, secret = (
        files.get((name,)) or files.get((lab, name)) for name in (timestamp.FILE_NAME, exchange_secret.FILE_NAME)
    )
    return HandedIn(
        _filled(_read(files[chosen]), chosen[-1]) if chosen else b"",
        _read(stamp)[: timestamp.MOST_BYTES] if stamp is not None else b"",
        exchange_secret.secret(_read(secret)) if secret is not None else "",
    )


def _unpacked(member: Member) -> list[Member]:
    held = unpacked(member)
    if not held:
        raise _NotUnderstood("cannot be read as a zip")
    return [Member(inner.path[len(member.path) :], inner.read) for inner in held]


def _read(member: Member) -> bytes:
    try:
        return member.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each way of packing fails in its own way (zlib.error, LZMAError); the class goes on
        raise _NotUnderstood(f"holds {'/'.join(member.path)[:200]!r}, which cannot be read ({error})") from error


def _filled(notebook: bytes, name: str) -> bytes:
    """Return what a notebook holds; an upload that failed leaves an empty file behind.

    Raises:
        _NotUnderstood: it holds nothing.
    """
    if not notebook.strip():
        raise _NotUnderstood(f"holds {name[:80]!r}, which is an empty file")
    return notebook
