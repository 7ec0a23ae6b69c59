"""The interface between the checks and the notebook in which they run. When a submission is graded, there is none.

The checks ask the front end which files the student's cells wrote, and tell it what to show. They know only this
interface, not the notebook.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol


class Watcher(Protocol):
    """Shows what happens during one launch."""

    def begin(self, sentence: str) -> bool:
        """Say what the check waits for from now on. Return False if another wait is already shown."""

    def end(self) -> None:
        """Say that the wait is over, whether or not it was successful."""

    def close(self) -> None:
        """Say that the programs have ended."""


class View(Protocol):
    """Shows something live, below the cell that asked for it."""

    def close(self) -> None:
        """End it, and leave a picture in its place."""


class FrontEnd(Protocol):
    """The methods of a notebook that the checks use."""

    @property
    def programs(self) -> Path:
        """The folder that holds the programs and files of the cells."""

    @property
    def number(self) -> int:
        """The execution number of the running cell, which Jupyter shows in brackets beside it."""

    @property
    def scored(self) -> bool:
        """Whether the running cell asks for a score."""

    def ready(self) -> None:
        """Wait until everything that the first launch needs is loaded."""

    def has(self, file_name: str) -> bool:
        """Return whether a cell wrote this file."""

    def why_missing(self, magic: str, name: str) -> tuple[str, str]:
        """Return why there is no such file, and what to do about it."""

    def blank(self, file_names: set[str]) -> dict[str, bool]:
        """Return for each of these files that is an answer whether its cell is still as students receive it."""

    def remarks(self, file_names: set[str]) -> list[str]:
        """Return what the student should know about the cells that these files came from."""

    def origin(self, file_names: set[str]) -> str:
        """Say in words which cells these files came from."""

    def watch(self, observer: Any, programs: Callable[[], Sequence[Any]]) -> Watcher:
        """Start to show what happens during a launch: what the check waits for, and what the programs print."""

    def show(
        self,
        running: Any,
        listen: Sequence[tuple[str, type]],
        scan: str,
        buttons: Mapping[str, Callable[[], object]],
    ) -> View:
        """Start to show the world of a running launch below the running cell, with these topics and buttons."""


active: FrontEnd | None = None
"""The notebook in which `%load_ext autograder` was run; None if there is none."""
