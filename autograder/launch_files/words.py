"""`args` and `ros_args`: one text that becomes the words of a command line.

`launch` splits what stands between the substitutions, before it does them: what a substitution stands for is never
split, so it may hold spaces or be empty.
"""

from __future__ import annotations

import itertools
import shlex

from autograder.launch_files.errors import refused
from autograder.launch_files.texts import Text


def split(text: Text) -> list[Text]:
    """Split a text into words.

    Raises:
        Refused: a quotation mark between two substitutions is not closed there.
    """
    if sum(isinstance(part, str) for part in text) and _both_quotes(text):
        raise refused(
            "both kinds of quotation marks in one command line are not covered here.",
            "Use one kind of them.",
        )
    words, word = list[Text](), list[object]()

    def end_word() -> None:
        words.append(tuple(word))  # type: ignore[arg-type]
        word.clear()

    for part in text:
        if not isinstance(part, str):
            word.append(part)
            continue
        pieces = _pieces(part)
        if not pieces:  # only spaces: they part what stands before from what follows
            end_word()
            continue
        if part[0].isspace() and word:
            end_word()
        word.append(pieces[0])
        if len(pieces) > 1:
            end_word()
            words += [(piece,) for piece in pieces[1:-1]]
            word.append(pieces[-1])
        if part[-1].isspace():
            end_word()
    if word:
        end_word()
    return words


def _both_quotes(text: Text) -> bool:
    return any(isinstance(one, str) and isinstance(other, str) for one, other in itertools.pairwise(text))


def _pieces(part: str) -> list[str]:
    try:
        return shlex.split(part)
    except ValueError:
        raise refused(
            f"a quotation mark is not closed in `{part.strip()[:60]}`: a command line is split into words before its "
            "substitutions are done.",
            "What `$(var …)` stands for is one word in any case: leave the quotation marks around it out.",
        ) from None
