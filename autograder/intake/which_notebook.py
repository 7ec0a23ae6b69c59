"""Choose which of the notebooks that a student handed in counts."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from autograder.intake.entries import Claim, Kind, NotUnderstoodError
from autograder.intake.members import Member, is_hidden, is_notebook
from autograder.submission import exchange_secret, timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES

_COPY = re.compile(r"(-\d+| ?\(\d+\)|[- ]+copy ?(\d+|\(\d+\))?)$", re.IGNORECASE)
"""The suffix that platforms, browsers, desktops and JupyterLab add to a file's name if that name already exists."""
_BESIDE = (timestamp.FILE_NAME, exchange_secret.FILE_NAME)


@dataclass
class Chosen:
    """The notebook that counts, and the other files of the student."""

    claim: Claim
    member: Member | None
    """The notebook; None if the student handed in no notebook."""
    replaced: list[tuple[Claim, str]] = field(default_factory=list)
    """The student's other entries with a notebook that does not count, each with a short reason."""
    not_understood: list[tuple[Claim, NotUnderstoodError]] = field(default_factory=list)
    """The student's other entries in which it is unclear which notebook counts."""
    others: list[Member] = field(default_factory=list)
    """Notebooks in the same entry that have other names."""
    doubtful: list[Member] = field(default_factory=list)
    """Notebooks in the same entry that may have been meant, because their names are those of copies."""
    companions: int = 0
    """The number of files that are no notebooks."""


def plain_name(name: str) -> str:
    """Return a notebook's name in lower case, without its ending and without the suffix of a copy."""
    return _COPY.sub("", name.casefold().removesuffix(".ipynb"))


def is_of_lab(name: str, lab: str) -> bool:
    """Return whether a notebook has the lab's name or the name of a copy of it."""
    return lab.casefold() in (name.casefold().removesuffix(".ipynb"), plain_name(name))


def choose(claims: Sequence[Claim], lab: str, others: Collection[str] = ()) -> Chosen:
    """Return the notebook that counts: the one in the last attempt that has the lab's name, or else the only one.

    Args:
        claims: the entries of one student.
        lab: the lab whose notebook is wanted.
        others: the other labs of the course. A notebook with the name of one of them never counts.

    Raises:
        NotUnderstoodError: it is unclear which notebook counts, or there are only other files.
    """
    seen: list[Chosen] = []
    not_understood: list[tuple[Claim, NotUnderstoodError]] = []
    for claim in claims:
        try:
            seen.append(_in_entry(claim, lab, others))
        except NotUnderstoodError as reason:
            not_understood.append((claim, reason))
    companions = sum(one.companions for one in seen)
    with_notebook = [one for one in seen if one.member is not None]
    if not with_notebook and not not_understood:
        if companions:
            raise NotUnderstoodError(f"holds {_first_file(claims)[:80]!r} and no notebook")
        return seen[-1]
    attempt = max([one.claim.attempt for one in with_notebook] + [claim.attempt for claim, _ in not_understood])
    among = [one for one in with_notebook if one.claim.attempt == attempt]
    named = [one for one in among if is_of_lab(_called(one), lab)]
    unclear = next((reason for claim, reason in not_understood if claim.attempt == attempt), None)
    if not named and unclear is not None:  # the lab's notebook may be in the entry that was not understood
        raise unclear
    if not named and len({plain_name(_called(one)) for one in among}) > 1:
        names = " and ".join(sorted(repr(_called(one)[:100]) for one in among)[:2])
        raise NotUnderstoodError(f"handed in {names}, none called {lab}.ipynb")
    last = max(named or among, key=lambda one: one.claim.turn)
    last.replaced = [(one.claim, _why(one, last, lab)) for one in with_notebook if one is not last]
    last.not_understood = not_understood
    last.companions = companions
    return last


def _why(one: Chosen, last: Chosen, lab: str) -> str:
    """Say why another notebook of the same student counts."""
    if one.claim.attempt != last.claim.attempt:
        return "a later attempt counts"
    called = _called(last)
    if is_of_lab(called, lab) and not is_of_lab(_called(one), lab):
        return f"{called[:80]!r} counts, because it has the lab's name"
    if one.claim.number != last.claim.number:
        return "a later file counts"
    why = "it has exactly the lab's name" if called == f"{lab}.ipynb" else "its name is the last one"
    return f"{called[:80]!r} counts, because {why}"


def _called(one: Chosen) -> str:
    """Return the name that the student gave to the notebook."""
    assert one.member is not None
    return one.claim.called if one.claim.entry.kind is Kind.NOTEBOOK and one.claim.called else one.member.name


def _first_file(claims: Sequence[Claim]) -> str:
    names = [member.name for claim in claims for member in claim.entry.files]
    return next((name for name in names if name not in _BESIDE and not name.startswith(".")), names[0])


def _in_entry(claim: Claim, lab: str, others: Collection[str]) -> Chosen:
    """Return the notebook that counts in one folder, zip or file.

    Raises:
        NotUnderstoodError: the entry cannot be read, or it is unclear which notebook counts.
    """
    entry = claim.entry
    if entry.kind is Kind.NOTEBOOK:
        chosen = Chosen(claim, entry.files[0])
        _refuse_other_lab(_called(chosen), lab, others)
        return chosen
    if entry.kind is Kind.OTHER:
        return Chosen(claim, None, companions=1)
    files = {member: entry.below(member) for member in entry.files}
    if claim.only:  # nbgrader's folders hold the work for every lab
        files = {member: path[1:] for member, path in files.items() if path[0] == claim.only and len(path) > 1}
    files = {member: path for member, path in _unwrapped(files, lab).items() if path[-1] not in _BESIDE}
    _refuse_wrong_kinds(files, lab)
    notebooks = {member: path for member, path in files.items() if is_notebook(path[-1]) and not is_hidden(path)}
    companions = sum(not is_notebook(path[-1]) and not is_hidden(path) for path in files.values())
    if not notebooks:
        if any(is_notebook(path[-1]) for path in files.values()):
            raise NotUnderstoodError("holds only a hidden notebook, such as a checkpoint of JupyterLab")
        return Chosen(claim, None, companions=companions)
    member, doubtful = _of_notebooks(notebooks, lab)
    _refuse_other_lab(member.name, lab, others)
    beside = [other for other in notebooks if other is not member and other not in doubtful]
    return Chosen(claim, member, others=beside, doubtful=doubtful, companions=companions)


def _refuse_other_lab(name: str, lab: str, others: Collection[str]) -> None:
    other = next((other for other in others if is_of_lab(name, other)), None)
    if other is not None and not is_of_lab(name, lab):
        raise NotUnderstoodError(f"handed in only {name[:80]!r}, which is the notebook of {other}")


def _unwrapped(files: dict[Member, tuple[str, ...]], lab: str) -> dict[Member, tuple[str, ...]]:
    """Return the files with their paths, without the folders that contain all of them, because these do not matter."""
    while (
        files
        and not any(is_hidden(path[:1]) for path in files.values())
        and len({path[0] for path in files.values()}) == 1
        and all(len(path) > 1 for path in files.values())
    ):
        if next(iter(files.values()))[0] in (lab, f"{lab}.ipynb"):
            break
        files = {member: path[1:] for member, path in files.items()}
    return files


def _refuse_wrong_kinds(files: dict[Member, tuple[str, ...]], lab: str) -> None:
    """Refuse a folder with the name of the notebook, and a file or link with the name of the lab's folder."""
    for member, path in files.items():
        if path[:1] == (f"{lab}.ipynb",) and len(path) > 1:
            raise NotUnderstoodError(f"cannot be read: '{lab}.ipynb' is a folder, not a file")
        if path == (lab,):
            read(member)
            raise NotUnderstoodError(f"cannot be read: {lab!r} is a file, not a folder")


def _of_notebooks(notebooks: dict[Member, tuple[str, ...]], lab: str) -> tuple[Member, list[Member]]:
    """Return the notebook in a folder that counts, and its copies.

    It is the one with the lab's name, or else the only one, because downloads may have been renamed.
    """
    for place in ((), (lab,), ("labs", lab)):
        here = [member for member, path in notebooks.items() if path[:-1] == place]
        if here:
            break
    else:
        here = list(notebooks)
    for named in (
        [member for member in here if member.name == f"{lab}.ipynb"],
        [member for member in here if member.name.casefold() == f"{lab}.ipynb".casefold()],
        [member for member in here if is_of_lab(member.name, lab)],
        here,
    ):
        if len(named) == 1:
            copies = [other for other in here if plain_name(other.name) == plain_name(named[0].name)]
            return named[0], [other for other in copies if other is not named[0]]
        if named:
            which = "none is" if named is here else "several are"
            raise NotUnderstoodError(f"holds {len(here)} notebooks, of which {which} called {lab}.ipynb")
    raise NotUnderstoodError("holds no notebook")


def beside(chosen: Chosen, name: str, most: int) -> bytes:
    """Return the contents of a file that nbgrader's exchange put beside a notebook; empty if there is no such file."""
    entry = chosen.claim.entry
    if entry.kind in (Kind.NOTEBOOK, Kind.OTHER):
        return b""
    places = [chosen.member.path[:-1]] if chosen.member is not None else []
    for place in (*places, entry.path):
        for member in entry.files:
            if member.path == (*place, name):
                try:
                    return member.read(most)
                except Exception:  # each kind of archive raises its own errors
                    return b""
    return b""


def read(member: Member) -> bytes:
    """Return the contents of a notebook.

    Raises:
        NotUnderstoodError: the notebook cannot be read, or it is empty, for example because an upload failed.
    """
    try:
        content = member.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each kind of archive raises its own errors (zlib.error, LZMAError); go on with others
        why = getattr(error, "strerror", None) or error
        raise NotUnderstoodError(f"holds {'/'.join(member.path)[:200]!r}, which cannot be read ({why})") from error
    if not content.strip():
        raise NotUnderstoodError(f"holds {member.name[:80]!r}, which is an empty file")
    return content
