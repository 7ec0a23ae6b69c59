"""Find the check that somebody names on the command line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

from autograder.core.errors import KitError


class _Named(Protocol):
    @property
    def grade_id(self) -> str: ...
    @property
    def title(self) -> str: ...


_Check = TypeVar("_Check", bound=_Named)


def chosen(checks: Sequence[_Check], named: str, lab: str) -> _Check:
    """Return the check that is named by its number, its grade_id, or a part of its title.

    Raises:
        KitError: the name belongs to no check, or to several.
    """
    if named.isdigit() and 0 < int(named) <= len(checks):
        return checks[int(named) - 1]
    by_id = [check for check in checks if check.grade_id == named]
    by_title = [check for check in checks if named.casefold() in check.title.casefold()]
    found = by_id or by_title
    if len(found) != 1:
        listed = "".join(f"\n  {n}  {c.grade_id}  {c.title}" for n, c in enumerate(checks, start=1))
        several = f"{len(found)} checks" if found else "No check"
        raise KitError(f"{several} of {lab} match{'' if found else 'es'} {named!r}.", f"The checks are:{listed}")
    return found[0]
