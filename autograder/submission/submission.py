"""What a student handed in for a lab, as text."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from autograder.core.results import Outcome


@dataclass
class Submission:
    """What a student handed in for a lab."""

    sources: dict[str, str] = field(default_factory=dict)
    """The source of every answer cell by grade_id; what students receive where there was no usable answer."""
    files: dict[str, str] = field(default_factory=dict)
    """File name to text: the programs and files that cells name, the lab's own and the student's own included."""
    problems: list[Outcome] = field(default_factory=list)
    digest: str = ""
    """SHA-256 over the answers, the lab and the kit: it changes when any of them does."""
    readable: bool = True
    """False: there is no notebook of this lab to grade, and `problems` says why."""
    notebook: dict[str, Any] = field(default_factory=dict)
    """The released notebook with the answers' sources in it."""
