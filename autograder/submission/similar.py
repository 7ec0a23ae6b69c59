"""Which submissions are more alike than chance makes them: a list for a person to read, never a verdict.

Answers are cut into overlapping rows of tokens, in which every name of a student's own is the same word, so that
renaming and reformatting hide nothing. Of these rows every so many are kept (winnowing, after Schleimer, Wilkerson and
Aiken, 2003). What the lab hands out counts nothing, and what many students have in common counts little: a task has few
solutions, and a class has one teacher.
"""

from __future__ import annotations

import contextlib
import io
import keyword
import math
import re
import tokenize
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

ROW = 12
"""Tokens of a row. Shorter ones are alike by chance."""
WINDOW = 6
"""Of so many rows one is kept, the same in every text."""
COMMON = 0.25
"""What a larger share of the class has is common knowledge."""
FEWEST = 8
"""Of fewer rows of one's own nothing can be said."""

_SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.ENCODING, tokenize.ENDMARKER)
_TELLING = 16
"""Characters of a line that is worth showing."""


@dataclass(frozen=True)
class Pair:
    """Two submissions that are alike."""

    students: tuple[str, str]
    likeness: float
    """Share of the shorter one's own rows that the other has too, from 0 to 1; rare rows count more."""
    answers: tuple[str, ...]
    """Where, the most alike first."""
    lines: tuple[str, ...]
    """Lines and comments that these two have letter for letter, and nobody else."""


def similar(submissions: Mapping[str, Mapping[str, str]], given: Mapping[str, str], at_least: float) -> list[Pair]:
    """Return the pairs that are alike, the most alike first.

    Args:
        submissions: the answers of each student, by grade_id.
        given: what the lab hands out of each answer.
        at_least: likeness of the pairs to return, from 0 to 1.
    """
    handed_out = _all(_rows(text) for text in given.values())
    own = {
        student: {name: _rows(text) - handed_out for name, text in answers.items()}
        for student, answers in submissions.items()
    }
    rows = {student: _all(answers.values()) for student, answers in own.items()}
    weights = _weights(rows)
    total = {student: sum(weights.get(row, 0.0) for row in found) for student, found in rows.items()}
    lines = {student: _lines(answers.values()) for student, answers in submissions.items()}
    having = Counter(line for found in (*lines.values(), _lines(given.values())) for line in found)
    pairs = []
    for (one, other), together in _shared(rows, weights).items():
        likeness = together / min(total[one], total[other])
        if likeness >= at_least:
            alike = {name: len(found & own[other].get(name, set())) for name, found in own[one].items()}
            names = tuple(name for name in sorted(alike, key=lambda name: (-alike[name], name)) if alike[name])
            equal = tuple(line for line in lines[one] if line in lines[other] and having[line] == 2)
            pairs.append(Pair((one, other), likeness, names, equal))
    return sorted(pairs, key=lambda pair: (-pair.likeness, -len(pair.lines), pair.students))


def _weights(rows: Mapping[str, set[int]]) -> dict[int, float]:
    """What a row counts: the more, the fewer students have it; nothing if it is common knowledge."""
    counts = Counter(row for found in rows.values() for row in found)
    most = max(5, math.ceil(COMMON * len(rows)))
    return {row: math.log((len(rows) + 1) / count) for row, count in counts.items() if count <= most}


def _shared(rows: Mapping[str, set[int]], weights: Mapping[int, float]) -> dict[tuple[str, str], float]:
    """The weight of what two students have in common, for each pair that has anything."""
    owners: dict[int, list[str]] = defaultdict(list)
    for student in sorted(rows):
        for row in rows[student] if len(rows[student]) >= FEWEST else ():
            if row in weights:
                owners[row].append(student)
    shared: dict[tuple[str, str], float] = defaultdict(float)
    for row, students in owners.items():
        for one, other in combinations(students, 2):
            shared[one, other] += weights[row]
    return shared


def _all(sets: Iterable[set[int]]) -> set[int]:
    return set().union(*sets)


def _rows(text: str) -> set[int]:
    """The kept rows of a text, as numbers."""
    tokens = _tokens(text)
    rows = [zlib.crc32("\0".join(tokens[at : at + ROW]).encode()) for at in range(len(tokens) - ROW + 1)]
    return {min(rows[at : at + WINDOW]) for at in range(max(1, len(rows) - WINDOW + 1))} if rows else set()


def _tokens(text: str) -> list[str]:
    """The tokens of a program; the words of anything else, and of a program that is none."""
    if text.lstrip().startswith("%%node"):
        code = text.replace("%%node", "#", 1)
        with contextlib.suppress(tokenize.TokenError, SyntaxError, ValueError):
            tokens = list(tokenize.generate_tokens(io.StringIO(code).readline))
            return [_plain(token) for token in tokens if token.type not in _SKIPPED]
    return re.findall(r"\w+", text.lower())


def _plain(token: tokenize.TokenInfo) -> str:
    if token.type == tokenize.NAME:
        return token.string if keyword.iskeyword(token.string) else "name"
    if token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT):
        return tokenize.tok_name[token.type]
    return "text" if token.type == tokenize.STRING else "number" if token.type == tokenize.NUMBER else token.string


def _lines(texts: Iterable[str]) -> dict[str, None]:
    """The telling lines of some texts, in order, each once."""
    stripped = (" ".join(line.split()) for text in texts for line in text.split("\n"))
    return dict.fromkeys(line for line in stripped if len(line) >= _TELLING)
