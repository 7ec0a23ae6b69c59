"""Tables of answers: a `%%file NAME.yaml` cell of plain `question: answer` lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from autograder import student_yaml
from autograder.checks import outcomes, session
from autograder.checks.scoring import score
from autograder.checks.session import Score


class Answers:
    """One table of answers; `with answers("predictions.yaml") as table:` like a launch."""

    def __init__(self, file: str) -> None:
        """Name the file; it is read on entering the block."""
        self.file = file
        self._table: dict[str, Any] = {}

    def __enter__(self) -> Answers:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if error is not None and not isinstance(error, outcomes.CheckEnded) and isinstance(error, Exception):
            outcomes.unknown("The check itself broke", f"{type(error).__name__}: {error}")
        return error is None or isinstance(error, Exception)

    def _read(self) -> None:
        """The file exists and is a table; fails the check if not."""
        title = f"`{self.file}` is a table of answers"
        try:
            table = student_yaml.read(session.current.folder / self.file)
        except student_yaml.StudentFileError as error:
            hint = error.hint or "Write `question: answer`."
            outcomes.failed(title, because=error.because, hint=hint, code=error.code)
        if not isinstance(table, dict):
            outcomes.failed(title, because="It has no `question: answer` lines.", code="not-yaml")
        self._table = {str(key): value for key, value in table.items()}

    def expect_filled(self, questions: Mapping[str, Sequence[Any]] | Sequence[str]) -> None:
        """Every question has an answer; where a sequence of allowed answers is given, one of them."""
        self._read()
        title = f"Every question in `{self.file}` is answered"
        for question in questions:
            answer = self._table.get(question)
            if answer is None or answer == "?":
                outcomes.failed(title, because=f"`{question}` has no answer yet.", code="unanswered")
            if isinstance(questions, Mapping) and answer not in questions[question]:
                because = f"`{question}` is {answer!r}; it must be {_one_of(questions[question])}."
                outcomes.failed(title, because=because, code="answer-form")
        outcomes.passed(title)

    def expect_answer(self, question: str, *right: Any, hint: str = "") -> None:
        """The answer to one question is one of the right ones."""
        if not self._table:
            self._read()
        answer = self._table.get(question)
        title = f"`{question}`"
        if answer in right and isinstance(answer, bool) == any(isinstance(r, bool) for r in right if r == answer):
            outcomes.passed(title, observed=str(answer))
            return
        outcomes.failed(
            title,
            observed=str(answer),
            because="There is no answer." if answer is None else f"{answer!r} is not what happens.",
            hint=hint or "Run the experiment again and look at what it prints.",
            code="unanswered" if answer is None else "wrong-answer",
        )

    def score(self, points: float) -> Score:
        """The score of the cell, as `ros.score`."""
        return score(points)


def _one_of(allowed: Sequence[Any]) -> str:
    """Name the allowed answers, of many only what they look like."""
    if isinstance(allowed, range):
        return f"a whole number from {allowed[0]} to {allowed[-1]}"
    if len(allowed) > 10:
        return f"of the form {allowed[0]}, {allowed[1]}, …"
    return "one of " + ", ".join(str(value) for value in allowed)


def answers(file: str) -> Answers:
    """A table of answers that a `%%file` cell holds."""
    return Answers(file)
