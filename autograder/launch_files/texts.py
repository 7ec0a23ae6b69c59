"""Parses the texts of a launch file, which consist of words and `$(…)` substitutions, like the grammar of `launch`.

A substitution is `$(NAME)` or `$(NAME VALUE VALUE)` with exactly one space before each value. A value is a sequence of
characters without spaces, quotes and brackets, or it is in quotes. Both may contain further substitutions. A backslash
removes the special meaning of the next character.
"""

from __future__ import annotations

import itertools
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass

from autograder.launch_files.errors import SUBSTITUTION_DEPTH, refused
from autograder.reasons import Refused

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@dataclass(frozen=True)
class Call:
    """One substitution, `$(NAME VALUE …)`."""

    name: str
    values: tuple[Text, ...]
    written: str


Text = tuple[str | Call, ...]
"""The parts of a text in their order. A text without substitutions has one part, or two if it contains both kinds of
quotes. It is the same in `launch`, where the number of parts decides whether the text is a literal."""


def plain(text: Text) -> str | None:
    """Return the text itself if `launch` treats it as a literal, or None if it counts as a substitution."""
    return text[0] if len(text) == 1 and isinstance(text[0], str) else None


def calls(text: Text) -> Iterator[Call]:
    """Yield every substitution in a text, including nested ones."""
    for part in text:
        if isinstance(part, Call):
            yield part
            for value in part.values:
                yield from calls(value)


def unescaped(text: str) -> str:
    """Return a text without the backslashes that remove the special meaning of the next character."""
    return re.sub(r"\\(.)", r"\1", text)


def parse(text: str) -> Text:
    """Parse a text.

    Raises:
        Refused: a substitution in it is not well formed.
    """
    if not text:
        return ("",)
    parts, end = _Reader(text).quoted(0, None, 0)
    assert end == len(text)
    return tuple(parts)


class _Reader:
    def __init__(self, text: str) -> None:
        self.text = text

    def error(self, because: str, hint: str = "") -> Refused:
        shown = self.text if len(self.text) <= 80 else f"{self.text[:80]}…"
        return refused(f"in `{shown}`, {because}", hint)

    def quoted(self, at: int, quote: str | None, depth: int) -> tuple[list[str | Call], int]:
        """Return the parts up to the closing quote, and its position; without a quote, up to the end of the text."""
        text, parts, start = self.text, list[str | Call](), at
        while at < len(text) and text[at] != quote:
            if text.startswith("$(", at):
                parts += self.words(text[start:at], quote)
                call, at = self.call(at, quote, depth)
                parts.append(call)
                start = at
            elif text.startswith("\\\\$(", at):
                raise self.error("two backslashes before `$(` are not covered here.", "Leave the backslashes out.")
            else:
                at += 2 if text[at] == "\\" and at + 1 < len(text) else 1
        if quote and at >= len(text):
            raise self.error(f"a {quote} is never closed.", "Add the quotation mark.")
        return parts + self.words(text[start:at], quote), at

    def words(self, text: str, quote: str | None) -> list[str | Call]:
        if not text:
            return []
        bare = re.sub(r"\\.", "", text)
        if quote is None and "'" in bare and '"' in bare:
            cut = max(text.index("'"), text.index('"'))
            return [unescaped(text[:cut]), unescaped(text[cut:])]
        return [unescaped(text)]

    def call(self, at: int, quote: str | None, depth: int) -> tuple[Call, int]:
        """Return the substitution that begins here, and the position after it."""
        if depth >= SUBSTITUTION_DEPTH:
            raise self.error("substitutions are nested too deep.")
        text, start = self.text, at
        name = _NAME.match(text, at + 2)
        if name is None:
            raise self.error("`$(` is not followed by the name of a substitution.", "Write `$(var NAME)`, no space.")
        at, values = name.end(), list[Text]()
        while text[at : at + 1] == " ":
            value, at = self.value(at + 1, quote, depth + 1)
            values.append(value)
        if at >= len(text) or ")" not in text[at:]:
            raise self.error("`$(` is never closed.", "Add the `)`.")
        if text[at] != ")":
            raise self.error(f"`{text[at]}` is not expected in a substitution.", "Put its value in quotes.")
        return Call(name[0], tuple(values), text[start : at + 1]), at + 1

    def value(self, at: int, quote: str | None, depth: int) -> tuple[Text, int]:
        text = self.text
        if quote is None and text[at : at + 1] in ("'", '"'):
            parts, at = self.quoted(at + 1, text[at], depth)
            return tuple(parts), at + 1
        ends, found, start = {" ", "(", ")", *(quote or "'\"")}, list[str | Call](), at
        while at < len(text) and text[at] not in ends:
            if text.startswith("$(", at):
                found += [unescaped(text[start:at])] if at > start else []
                call, at = self.call(at, quote, depth)
                found.append(call)
                start = at
            else:
                at += (
                    2
                    if text[at] == "\\" and text[at + 1 : at + 2] in ("(", ")", "$", quote or "'", quote or '"')
                    else 1
                )
        found += [unescaped(text[start:at])] if at > start else []
        if not found:
            raise self.error("a value is missing after a space.", "Write exactly one space before each value.")
        return tuple(found), at


def split(text: Text) -> list[Text]:
    """Split the text of `args` or `ros_args` into the words of a command line.

    `launch` splits the text between the substitutions before it performs them. The value of a substitution is never
    split, so it may contain spaces or be empty.

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
        if not pieces:  # only spaces, which end the word before them
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
            "The value of `$(var …)` is one word in any case, so leave out the quotation marks around it.",
        ) from None
