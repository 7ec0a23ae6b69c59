"""Tables of answers: a `%%file NAME.yaml` cell of plain `question: answer` lines.

Each question is a part of its own: a wrong line costs that line's share of the points. Differences in spelling,
such as case or quotes, do not matter.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any

from autograder.checks import current, outcomes
from autograder.checks.command_line import UNANSWERED
from autograder.checks.misuse import Misuse
from autograder.checks.scoring import Score, part, score
from autograder.core import student_yaml
from autograder.core.results import Status
from autograder.core.student_yaml import FILE_MISSING, NOT_YAML, YAML_REFUSED
from autograder.graph.names import nearest
from autograder.own_run.sheet import OwnRun
from autograder.reasons import Group, Kind, Refused

NAME_OR_NONE = ("a full name, such as `/front/points`", "none")
"""The form of an answer that is the full name of a node, topic or service, or `none`."""

FULL_NAME = ("a full name, which begins with `/` and does not end with it",)
"""The form of an answer that has to be written as the full name of a node, topic or service."""

_AROUND = " \t'\"`."
_FULL_NAME = re.compile(r"(/[A-Za-z_]\w*)+")
_NAME = re.compile(r"/?[A-Za-z_]\w*(/\w+)*/?")
_YES, _NO = ("yes", "true", "on", "y"), ("no", "false", "off", "n")


def plain(answer: Any) -> Any:
    """Return an answer without differences of spelling: case, quotes, spaces, hyphens and underscores."""
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
    if form is FULL_NAME:
        return bool(_FULL_NAME.fullmatch(str(answer).strip(_AROUND)))
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
    """Say why an answer does not have the required form; this ends a sentence that has already named the answer."""
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
    """Return a word that lets a visible check recognise the right answer to a question without showing it."""
    return hashlib.sha256(json.dumps([question, plain(answer)]).encode()).hexdigest()[:12]


def is_seal(word: object) -> bool:
    """Whether a text has the form of a seal, as `seal` returns it."""
    return isinstance(word, str) and re.fullmatch(r"[0-9a-f]{12}", word) is not None


ANSWER_FORM = Kind("answer-form", "the answer is none of the allowed ones", Group.FILES)
WRONG_ANSWER = Kind("wrong-answer", "the answer has the right form, but something else happens", Group.FILES)

OWN_RUN = Kind("own-run", "the line with the recorded run is missing, or is not as the kit wrote it", Group.FILES)
_NO_RUN = "The table has no recorded run yet."
_BROKEN_RUN = "The text after `run:` is not a whole line that the kit wrote."
_COPY_THE_LINE = "Run the cell that records your run, and copy its last line, which begins with `run:`, into the table."

_LINES = "Write one line for each question: `question: answer`, with a space after the colon."


def _no_table(read: Any) -> str:
    """Say what YAML read instead of a table."""
    if read in (None, {}):
        return "It has no answers yet."
    if isinstance(read, list):
        return (
            "YAML reads this file as a list, because its lines begin with dashes. Each line of a table begins with its"
            " question."
        )
    return f"YAML reads this file as a single value, which begins with `{str(read)[:30]}`, and not as a table."


class Answers:
    """One table of answers; `with answers("predictions.yaml") as table:` like a launch."""

    def __init__(self, file: str) -> None:
        """Name the file. It is read when the block is entered."""
        self.file = file
        self._table: dict[str, Any] = {}
        self._forms: dict[str, Sequence[Any]] = {}
        self._questions: dict[str, None] = {}
        self._own_run = OwnRun(asked=())

    def __enter__(self) -> Answers:
        current.check.findings.begin_block()
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        return outcomes.ends_block(error)

    def _read(self) -> None:
        """Read the file. The check fails if the file does not exist or is not a table."""
        if self._table:
            return
        title = f"`{self.file}` is a table of answers"
        here = current.check.front_end
        if here is not None and not here.has(self.file):
            because, hint = here.why_missing("file", self.file)
            outcomes.failed(title, FILE_MISSING(because, hint))
        try:
            table = student_yaml.read(current.check.use(self.file), table=True)
        except Refused as error:
            outcomes.failed(title, replace(error.reason, hint=error.reason.hint or _LINES))
        if not isinstance(table, dict) or not table:
            outcomes.failed(title, NOT_YAML(_no_table(table), _LINES))
        self._table = {str(key).strip(): value for key, value in table.items()}

    def expect_filled(self, questions: Mapping[str, Sequence[Any]] | Sequence[str]) -> None:
        """Every question has an answer, which is one of its allowed values if they are given.

        Args:
            questions: allowed values by question, a list of them or a range of whole numbers; or questions only.
        """
        self._questions |= dict.fromkeys(questions)
        self._read()
        self._forms |= questions if isinstance(questions, Mapping) else {}
        for question in questions:
            with part(question):
                outcomes.passed(f"`{question}` is answered", observed=str(self._answer(question)))

    def _answer(self, question: str) -> Any:
        """Return the answer to a question. The question's part fails if there is no answer of an allowed form."""
        self._questions[question] = None
        self._read()
        title = f"`{question}` is answered"
        answer = self._table.get(question)
        form = self._forms.get(question, ())
        if isinstance(answer, student_yaml.Twice):
            outcomes.failed(title, YAML_REFUSED(f"`{question}` {answer}."))
        if answer is None or answer == "?":
            expected = one_of(form) if form else ""
            because = self._below(question) or f"`{question}` has no answer yet." + self._misspelt(question)
            outcomes.failed(title, UNANSWERED(because), expected=expected)
        if form and not allowed(answer, form):
            because = f"`{question}` is `{_spelt(answer)}`{misses(answer, form)}."
            outcomes.failed(title, ANSWER_FORM(because), expected=one_of(form), observed=_spelt(answer))
        return answer

    def _below(self, question: str) -> str:
        """Return a sentence if the question is indented below another line of the table, otherwise an empty text."""
        for above, below in self._table.items():
            if isinstance(below, dict) and question in below:
                return f"`{question}` is indented below `{above[:60]}`. Each question has to begin at the left margin."
        return ""

    def _misspelt(self, question: str) -> str:
        """Return a sentence if a line of the table looks like this question with a typing error, or an empty text."""
        if question in self._table:
            return ""
        line = nearest(question, self._table.keys() - self._questions.keys())
        if line is None or nearest(line, self._questions.keys() - self._table.keys()) != question:
            return ""
        return f" This table has no question `{line[:60]}`; did you mean `{question}`?"

    def expect_answer(self, question: str, *right: Any, hint: str = "") -> None:
        """The answer to one question says the same as one of the right ones."""
        if not self._lost(question):
            with part(question):
                answer = self._answer(question)
                self._judge(question, answer, any(same(answer, one) for one in right), hint)

    def _lost(self, question: str) -> bool:
        """Whether the question has already failed because it has no usable answer."""
        found = current.check.findings.outcomes[current.check.findings.block_began :]
        return any(outcome.part == question and outcome.status is Status.FAILED for outcome in found)

    def expect_sealed(self, answers: Mapping[str, str], hint: str = "") -> None:
        """The answers are the right ones, which the check knows by their seals only (`autograder.checks.answers.seal`).

        So a fact that students have measured is checked in their own notebook, without being given away there.
        """
        for question, sealed in answers.items():
            if not is_seal(sealed):
                raise Misuse(f"expect_sealed: {sealed!r} is no seal; make one with seal({question!r}, ANSWER).")
            if not self._lost(question):
                with part(question):
                    answer = self._answer(question)
                    seals = (seal(question, answer), seal(question, f"/{answer}"))
                    self._judge(question, answer, sealed in seals, hint)

    def expect_own_run(self, questions: int) -> None:
        """The table carries a recorded run with so many questions, and each of them has an answer of its form."""
        self._read()
        title = "`run` is a recorded run with its questions"
        line = self._table.get("run")
        try:
            self._own_run = OwnRun.read(str(line))
        except ValueError:
            outcomes.failed(title, OWN_RUN(_NO_RUN if line in (None, "?") else _BROKEN_RUN, _COPY_THE_LINE))
        asked = self._own_run.named()
        if len({(one.question.kind, str(one.question.about)) for one in asked.values()}) != questions:
            outcomes.failed(title, OWN_RUN(f"The run has not {questions} different questions.", _COPY_THE_LINE))
        self.expect_filled({name: one.question.choices or range(1000) for name, one in asked.items()})

    def expect_own_answers(self) -> None:
        """The answers are what the recorded run shows. For hidden tests: a student's kit does not know the answers."""
        keys = import_module("autograder.own_run.keys")  # not in a student's kit, whose cells lack this call

        for name, one in self._own_run.named().items():
            if self._lost(name):
                continue
            with part(name):
                answer = self._answer(name)
                if same(answer, keys.key(one.record, one.question)):
                    outcomes.passed(f"`{name}`", observed=_spelt(answer))
                    continue
                because = f"`{_spelt(answer)}` is not what the picture of your run shows. {one.question.text}"
                # Of a hidden test, a student only sees the hint.
                hint = f"Your answer to `{name}` is not what your run shows; look at its picture again"
                picture = one.question.picture(one.record)
                outcomes.failed(f"`{name}`", WRONG_ANSWER(because, hint), observed=_spelt(answer), picture=picture)

    def _judge(self, question: str, answer: Any, right: bool, hint: str) -> None:
        title = f"`{question}`"
        if right:
            outcomes.passed(title, observed=_spelt(answer))
            return
        if self._forms.get(question) is NAME_OR_NONE and not begins_with_slash(answer) and not same(answer, "none"):
            because = f"The answer is `{_spelt(answer)}`, but it must be a full name, which begins with `/`, or `none`."
            outcomes.failed(title, ANSWER_FORM(because), observed=_spelt(answer))
        outcomes.failed(
            title,
            WRONG_ANSWER(
                f"`{_spelt(answer)}` is not the right answer.",
                hint or "Run the experiment again and look at what it prints.",
            ),
            observed=_spelt(answer),
        )

    def score(self, points: float) -> Score:
        """The score of the cell: the points in equal shares over all questions."""
        return score({question: points / len(self._questions) for question in self._questions} or points)


def _spelt(answer: Any) -> str:
    """Return an answer as a student would type it."""
    if isinstance(answer, bool):
        return "yes" if answer else "no"
    if isinstance(answer, list):
        return f"[{', '.join(map(_spelt, answer))}]"
    return str(answer)


def answers(file: str) -> Answers:
    """A table of answers that a `%%file` cell holds."""
    return Answers(file)
