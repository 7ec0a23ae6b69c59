"""What a program is started with: its file, and words that it would refuse."""

from __future__ import annotations

from collections.abc import Sequence

from autograder.arguments import params_file, remap_rules
from autograder.arguments.params_file import PARAMS_FILE
from autograder.checks import current
from autograder.checks.program import Program
from autograder.checks.waiting import NotLaunchedError
from autograder.diagnosis.programs import PROGRAM_MISSING
from autograder.packages.workspace import INSTALLED
from autograder.reasons import Reason, Refused


def file_of(node: Program) -> str:
    """Where a program's file is, below the folder of the programs."""
    if node.package:
        return f"{INSTALLED}/{node.package}/lib/{node.package}/{node.program}"
    return f"{node.program}.py"


def words_of(node: Program) -> list[str] | Reason:
    """The words that a program is started with, or why it would not start with them."""
    try:
        words = node.arguments()
    except Refused as error:
        return error.reason
    return refused_words(words) or words


def refused_words(words: Sequence[str]) -> Reason | None:
    """Why a program would not start with these words; None if it would."""
    refused = remap_rules.refused_parameter(words)
    if refused:
        return refused
    unreadable = params_file.unreadable(words, current.check.folder)
    if unreadable is not None:
        hint = "Look at the indentation there, and at brackets and quotation marks."
        return PARAMS_FILE(unreadable.reason.because, hint)
    return None


def why_missing(program: str) -> Reason:
    """Why no cell has written a program."""
    here = current.check.front_end
    because, hint = here.why_missing("node", program) if here is not None else (f"There is no `{program}`.", "")
    return PROGRAM_MISSING(because, hint)


def refuse_to_start(programs: Sequence[Program]) -> None:
    """Look for what would keep a launch from beginning, before what runs now is ended for it.

    Raises:
        NotLaunchedError: there is something.
    """
    for node in programs:
        if not node.package and not current.check.has(file_of(node)):
            raise NotLaunchedError(why_missing(node.program))
        words = words_of(node)
        if isinstance(words, Reason):
            raise NotLaunchedError(words)
