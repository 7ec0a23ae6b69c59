"""The place where a person looks on while checks run: a notebook. Where a submission is graded there is none.

The checks ask it what the student's cells wrote, and let it show what happens; they do not know what it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol


class Watcher(Protocol):
    """Shows what goes on in one launch."""

    def begin(self, sentence: str) -> bool:
        """Something is waited for from now on; whether nothing else was."""

    def end(self) -> None:
        """It is there, or will not come."""

    def close(self) -> None:
        """The programs have ended."""


class FrontEnd(Protocol):
    """What the checks need of it."""

    @property
    def programs(self) -> Path:
        """The folder in which the programs and files of the cells lie."""

    @property
    def number(self) -> int:
        """The number in the brackets beside the cell that runs."""

    @property
    def scored(self) -> bool:
        """Whether the cell that runs asks for a score."""

    def ready(self) -> None:
        """Wait until what a first launch needs is loaded."""

    def has(self, file_name: str) -> bool:
        """Whether a cell wrote this file."""

    def why_missing(self, magic: str, name: str) -> tuple[str, str]:
        """Why there is no such file, and what to do."""

    def blank(self, file_names: set[str]) -> dict[str, bool]:
        """Of each of these files that is an answer, whether its cell is still as students receive it."""

    def remarks(self, file_names: set[str]) -> list[str]:
        """What the student should know about the cells that these files came from."""

    def origin(self, file_names: set[str]) -> str:
        """Those cells, in words."""

    def watch(self, observer: Any, programs: Callable[[], Sequence[Any]]) -> Watcher:
        """Begin to show what goes on in a launch: what is waited for, and what its programs print."""


active: FrontEnd | None = None
"""The notebook in which `%load_ext autograder` was run."""
