"""Tables of answers: a `%%file NAME.yaml` cell of plain `question: answer` lines.

Each question is a part of its own: a wrong line costs that line's share of the points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from autograder.checks import current, outcomes
from autograder.checks.command_line import UNANSWERED
from autograder.checks.forms import NAME_OR_NONE, allowed, begins_with_slash, is_seal, misses, one_of, same, seal
from autograder.checks.misuse import Misuse
from autograder.checks.parts import part
from autograder.checks.scoring import Score, score
from autograder.core import student_yaml
from autograder.core.results import Status
from autograder.core.student_yaml import FILE_MISSING, NOT_YAML, YAML_REFUSED
from autograder.graph.names import nearest
from autograder.reasons import Group, Kind, Refused

ANSWER_FORM = Kind("answer-form", "the answer is none of the allowed ones", Group.FILES)
WRONG_ANSWER = Kind("wrong-answer", "the answer has the right form, but something else happens", Group.FILES)

_LINES = "Write one line for each question: `question: answer`, with a space after the colon."


def _no_table(read: Any) -> str:
    """What YAML made of a file that is no table."""
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
        """Name the file; it is read on entering the block."""
        self.file = file
        self._table: dict[str, Any] = {}
        self._forms: dict[str, Sequence[Any]] = {}
        self._questions: dict[str, None] = {}

    def __enter__(self) -> Answers:
        current.check.findings.begin_block()
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        return outcomes.ends_block(error)

    def _read(self) -> None:
        """The file exists and is a table; fails the check if not."""
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
        """The answer to a question, of an allowed form; fails the question's part if there is none."""
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
        """A sentence about a question that stands below another line of the table; empty if it does not."""
        for above, below in self._table.items():
            if isinstance(below, dict) and question in below:
                return f"`{question}` is indented below `{above[:60]}`. Each question has to begin at the left margin."
        return ""

    def _misspelt(self, question: str) -> str:
        """A sentence about a line of the table that is no question but looks like this one; empty if there is none."""
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
        """Whether it has been said already that there is no usable answer."""
        found = current.check.findings.outcomes[current.check.findings.block_began :]
        return any(outcome.part == question and outcome.status is Status.FAILED for outcome in found)

    def expect_sealed(self, answers: Mapping[str, str], hint: str = "") -> None:
        """The answers are the right ones, which the check knows by their seals only (`autograder.checks.forms.seal`).

        So a fact that students have measured is checked in their own notebook, without being given away there.
        """
        for question, sealed in answers.items():
            if not is_seal(sealed):
                raise Misuse(f"expect_sealed: {sealed!r} is no seal; make one with forms.seal({question!r}, ANSWER).")
            if not self._lost(question):
                with part(question):
                    answer = self._answer(question)
                    seals = (seal(question, answer), seal(question, f"/{answer}"))
                    self._judge(question, answer, sealed in seals, hint)

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
    """An answer as a student would type it."""
    if isinstance(answer, bool):
        return "yes" if answer else "no"
    if isinstance(answer, list):
        return f"[{', '.join(map(_spelt, answer))}]"
    return str(answer)


def answers(file: str) -> Answers:
    """A table of answers that a `%%file` cell holds."""
    return Answers(file)
