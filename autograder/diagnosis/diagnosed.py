"""What a program tells of itself that is diagnosed."""

from __future__ import annotations

from typing import Any, Protocol


class DiagnosedProgram(Protocol):
    """What a diagnosis needs of a program."""

    name: str
    began: float

    def running(self) -> bool:
        """Whether it is alive."""

    def exit_status(self) -> int | None:
        """None while it runs; negative: the signal that ended it."""

    def stopped_by(self) -> str:
        """The limit that ended it, if one did."""

    def output(self) -> str:
        """What it printed."""

    def events(self) -> list[dict[str, Any]]:
        """What its probe wrote."""

    def stacks(self, timeout: float = 1.0) -> str:
        """Where its threads are."""
