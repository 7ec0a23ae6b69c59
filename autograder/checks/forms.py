"""Reads what students type into a table of answers as they mean it: how it is spelt does not matter.

`Best effort`, `best-effort` and `"BEST_EFFORT"` are one answer, and so are `yes` and `"yes"`, `5` and `"5"`.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Sequence
from typing import Any

NAME_OR_NONE = ("a full name, such as `/front/points`", "none")
"""The form of an answer that is the full name of a node, topic or service, or `none`."""

_AROUND = " \t'\"`."
_NAME = re.compile(r"/?[A-Za-z_]\w*(/\w+)*/?")
_YES, _NO = ("yes", "true", "on", "y"), ("no", "false", "off", "n")


def plain(answer: Any) -> Any:
    """Return an answer without what is a matter of spelling: case, quotes, spaces, hyphens and underscores."""
    if isinstance(answer, (list, tuple)):
        return tuple(plain(one) for one in answer)
    if isinstance(answer, (bool, float)) or not isinstance(answer, str):
        return _plain_number(answer)
    text = answer.strip().strip("'\"`").strip().rstrip(".").casefold()
    if text.startswith("/"):
        return text.rstrip("/") or "/"  # a name: its underscores count
    if text in _YES + _NO:
        return text in _YES
    if re.fullmatch(r"[+-]?\d{1,18}(\.\d{1,18})?", text):
        return _plain_number(float(text))
    return " ".join(re.split(r"[\s_-]+", text))


def _plain_number(value: Any) -> Any:
    if isinstance(value, bool):
        return value
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def same(answer: Any, right: Any) -> bool:
    """Whether two answers say the same thing."""
    one, other = plain(answer), plain(right)
    if isinstance(other, str) and other.startswith("/") and isinstance(one, str) and not one.startswith("/"):
        # Where a full name is asked for, a name without its slash cannot mean another one.
        return "/" + str(answer).strip().strip("'\"`").casefold().strip("/") == other
    return isinstance(one, bool) == isinstance(other, bool) and bool(one == other)


def allowed(answer: Any, form: Sequence[Any]) -> bool:
    """Whether an answer has one of the allowed values."""
    if form is NAME_OR_NONE:
        return bool(_NAME.fullmatch(str(answer).strip(_AROUND)))
    if isinstance(form, range):
        number = plain(answer)
        return isinstance(number, int) and not isinstance(number, bool) and number in form
    return any(same(answer, value) for value in form)


def begins_with_slash(answer: Any) -> bool:
    """Whether an answer is written as a full name."""
    return str(answer).strip(_AROUND).startswith("/")


def one_of(form: Sequence[Any]) -> str:
    """Name the allowed values; of a long range only its ends, of many lists what each holds."""
    if isinstance(form, range):
        return f"a whole number from {form[0]} to {form[-1]}"
    if form and isinstance(form[0], (list, tuple)):
        words = sorted({str(word) for value in form for word in value})
        return f"a list of {len(form[0])} words, each {_or(words)}: `[{', '.join(words[:1] * len(form[0]))}]`"
    return _or(["yes" if value is True else "no" if value is False else str(value) for value in form])


def misses(answer: Any, form: Sequence[Any]) -> str:
    """What keeps an answer from being of the form, as the end of a sentence that has named the answer."""
    if not form or not isinstance(form[0], (list, tuple)):
        return f", which is none of the allowed answers: {one_of(form)}"
    wanted = len(form[0])
    if isinstance(answer, str):
        return f", a text. Write a list of {wanted} words in brackets: `[…, …]`"
    if isinstance(answer, list) and len(answer) != wanted:
        return f", a list of {len(answer)} word{'s' * (len(answer) != 1)}, but the question asks for {wanted}"
    if isinstance(answer, list):
        words = {str(word): word for value in form for word in value}
        other = next((one for one in answer if not any(same(one, word) for word in words.values())), answer)
        told = "no" if other is False else "yes" if other is True else other
        return f"; `{told}` is none of the words {_or(sorted(words))}"
    return f", which is none of the allowed answers: {one_of(form)}"


def _or(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def seal(question: str, answer: Any) -> str:
    """Return a word by which a visible check knows the right answer to a question without showing it."""
    return hashlib.sha256(json.dumps([question, plain(answer)]).encode()).hexdigest()[:12]


def is_seal(word: object) -> bool:
    """Whether it looks like what `seal` returns."""
    return isinstance(word, str) and re.fullmatch(r"[0-9a-f]{12}", word) is not None
