"""Which of the notebooks that one student handed in counts."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from autograder.intake.entries import Claim, Kind, NotUnderstoodError
from autograder.intake.members import Member, is_hidden, is_notebook
from autograder.submission import exchange_secret, timestamp
from autograder.submission.notebook_file import NOTEBOOK_BYTES

_COPY = re.compile(r"(-\d+| ?\(\d+\)|[- ]+copy ?(\d+|\(\d+\))?)$", re.IGNORECASE)
"""What platforms, browsers, desktops and JupyterLab put behind the name of a file that they have already."""
_BESIDE = (timestamp.FILE_NAME, exchange_secret.FILE_NAME)


@dataclass
class Chosen:
    """The notebook that counts, and what was in its way."""

    claim: Claim
    member: Member | None
    """None: the student handed in nothing at all."""
    replaced: list[tuple[Claim, str]] = field(default_factory=list)
    """Of the same student's, with a notebook each in whose place this one came, and why, in a few words."""
    not_understood: list[tuple[Claim, NotUnderstoodError]] = field(default_factory=list)
    """Of the same student's, beside the one that counts."""
    others: list[Member] = field(default_factory=list)
    """Notebooks beside the one that counts that have other names."""
    doubtful: list[Member] = field(default_factory=list)
    """Notebooks that may have been meant: copies by their names, beside the one that counts."""
    companions: int = 0
    """Files that are no notebooks."""


def plain_name(name: str) -> str:
    """Return a notebook's name without its ending, and without what was put behind it because there was one already."""
    return _COPY.sub("", name.casefold().removesuffix(".ipynb"))


def is_of_lab(name: str, lab: str) -> bool:
    """Whether a notebook has the lab's name, or is a copy of one that had it."""
    return lab.casefold() in (name.casefold().removesuffix(".ipynb"), plain_name(name))


def choose(claims: Sequence[Claim], lab: str, others: Collection[str] = ()) -> Chosen:
    """Return the notebook that counts: in the last attempt the one with the lab's name, or else the only one.

    Args:
        claims: what one student handed in.
        lab: whose notebook is wanted.
        others: the other labs of the course; a notebook with the name of one never counts.

    Raises:
        NotUnderstoodError: nothing says which it is, or there are only other files.
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
    if not named and unclear is not None:  # the lab's notebook may be in there
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
    """Why another notebook of the same student counts."""
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
    """The notebook's name as the student gave it."""
    assert one.member is not None
    return one.claim.called if one.claim.entry.kind is Kind.NOTEBOOK and one.claim.called else one.member.name


def _first_file(claims: Sequence[Claim]) -> str:
    names = [member.name for claim in claims for member in claim.entry.files]
    return next((name for name in names if name not in _BESIDE and not name.startswith(".")), names[0])


def _in_entry(claim: Claim, lab: str, others: Collection[str]) -> Chosen:
    """What counts in one folder, zip or file.

    Raises:
        NotUnderstoodError: it cannot be looked into, or nothing says which notebook counts.
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
    """The files by their paths without the folders around all of them, which do no harm."""
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
    """Refuse a folder in the notebook's place, and a file or a link in that of the lab's folder."""
    for member, path in files.items():
        if path[:1] == (f"{lab}.ipynb",) and len(path) > 1:
            raise NotUnderstoodError(f"holds what cannot be read: '{lab}.ipynb' is a folder, not a file")
        if path == (lab,):
            read(member)
            raise NotUnderstoodError(f"holds what cannot be read: {lab!r} is a file, not a folder")


def _of_notebooks(notebooks: dict[Member, tuple[str, ...]], lab: str) -> tuple[Member, list[Member]]:
    """Which of a folder's notebooks counts: by its name, or the only one, for downloads get renamed; and its copies."""
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
    """Return what nbgrader's exchange put beside a student's notebook; nothing if it did not."""
    entry = chosen.claim.entry
    if entry.kind in (Kind.NOTEBOOK, Kind.OTHER):
        return b""
    places = [chosen.member.path[:-1]] if chosen.member is not None else []
    for place in (*places, entry.path):
        for member in entry.files:
            if member.path == (*place, name):
                try:
                    return member.read(most)
                except Exception:  # each way of packing fails in its own way
                    return b""
    return b""


def read(member: Member) -> bytes:
    """Return what a notebook holds.

    Raises:
        NotUnderstoodError: it cannot be read, or is empty, which an upload that failed leaves behind.
    """
    try:
        content = member.read(NOTEBOOK_BYTES + 1)
    except Exception as error:  # each way of packing fails in its own way (zlib.error, LZMAError); the class goes on
        why = getattr(error, "strerror", None) or error
        raise NotUnderstoodError(f"holds {'/'.join(member.path)[:200]!r}, which cannot be read ({why})") from error
    if not content.strip():
        raise NotUnderstoodError(f"holds {member.name[:80]!r}, which is an empty file")
    return content
