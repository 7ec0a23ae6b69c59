"""Find submissions that are more similar than chance explains. The list is for a person to read, and is no verdict.

Answers are cut into overlapping rows of tokens. All names count as the same word, so that renaming and reformatting
hide nothing. A part of these rows is kept (winnowing, after Schleimer, Wilkerson and Aiken, 2003). Text that the lab
hands out does not count, and rows that many students have in common count little, because a task has few solutions and
a class learns from the same teacher.
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
"""The number of tokens in a row. Shorter rows are often equal by chance."""
WINDOW = 6
"""The number of consecutive rows of which at least one is kept; the choice is the same in every text."""
COMMON = 0.25
"""The share of the class above which a row is common knowledge and does not count."""
FEWEST = 8
"""The number of own rows that a submission must have; with fewer rows it is not compared."""

_SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.ENCODING, tokenize.ENDMARKER)
_TELLING = 16
"""The number of characters that a line must have to be shown."""


@dataclass(frozen=True)
class Pair:
    """Two similar submissions."""

    students: tuple[str, str]
    likeness: float
    """The share, from 0 to 1, of the shorter submission's own rows that are also in the other; rare rows count more."""
    answers: tuple[str, ...]
    """The grade_ids of the answers that have rows in common, the most similar first."""
    lines: tuple[str, ...]
    """Lines and comments that are identical in these two submissions and occur in no other."""


def similar(submissions: Mapping[str, Mapping[str, str]], given: Mapping[str, str], at_least: float) -> list[Pair]:
    """Return the pairs of similar submissions, the most similar first.

    Args:
        submissions: the answers of each student, by grade_id.
        given: the text that the lab hands out for each answer.
        at_least: the smallest likeness of a pair that is returned, from 0 to 1.
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
    """Return the weight of each row. It is greater if fewer students have the row; common rows are left out."""
    counts = Counter(row for found in rows.values() for row in found)
    most = max(5, math.ceil(COMMON * len(rows)))
    return {row: math.log((len(rows) + 1) / count) for row, count in counts.items() if count <= most}


def _shared(rows: Mapping[str, set[int]], weights: Mapping[int, float]) -> dict[tuple[str, str], float]:
    """Return the total weight of the rows that two students have in common, for each pair that has any."""
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
    """Return the rows of a text that are kept, as numbers."""
    tokens = _tokens(text)
    rows = [zlib.crc32("\0".join(tokens[at : at + ROW]).encode()) for at in range(len(tokens) - ROW + 1)]
    return {min(rows[at : at + WINDOW]) for at in range(max(1, len(rows) - WINDOW + 1))} if rows else set()


def _tokens(text: str) -> list[str]:
    """Return the tokens of a program, or the words of a text that is no program or not valid Python."""
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
    """Return the lines of some texts that are long enough to be shown, in order and each once."""
    stripped = (" ".join(line.split()) for text in texts for line in text.split("\n"))
    return dict.fromkeys(line for line in stripped if len(line) >= _TELLING)
