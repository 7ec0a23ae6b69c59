"""The questions that a student gets about a run, and the line that carries them and the run into the notebook.

Grading must give a submission the same points every time, and it cannot know a run of the past. Therefore the recorded
run and its questions are handed in together with the answers, as one line of text that the kit writes.
"""

from __future__ import annotations

import base64
import random
import re
import zlib
from collections.abc import Sequence
from html import escape

from pydantic import BaseModel, ConfigDict, Field

from autograder.own_run.question import Question
from autograder.own_run.questions import chosen, possible
from autograder.own_run.record import Record

_MOST_BYTES = 200_000
"""The bytes that a line may have when it is unpacked; real ones have a tenth of this."""


class Asked(BaseModel):
    """A question and what it is about."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    record: Record
    question: Question


class OwnRun(BaseModel):
    """Questions about one launch of the student's, with what they are about."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    asked: tuple[Asked, ...] = Field(max_length=10)

    @classmethod
    def of(cls, records: Sequence[Record], number: int) -> OwnRun:
        """Choose questions about records; other ones each time."""
        pairs = chosen(records, random.SystemRandom().random().hex(), number)
        return cls(asked=tuple(Asked(record=_needed(record, one), question=one) for record, one in pairs))

    @classmethod
    def unpacked(cls, line: str) -> OwnRun:
        """Return what a line carries. Whether the kit asks such questions is not looked at: of a record that somebody
        has made up to be large, that takes minutes.

        Raises:
            ValueError: it has another form than a line that `line` has returned.
        """
        try:
            unpack = zlib.decompressobj()
            text = unpack.decompress(base64.urlsafe_b64decode(line.encode("ascii")), _MOST_BYTES)
        except zlib.error as error:
            raise ValueError(str(error)) from None
        return cls.model_validate_json(text)

    @classmethod
    def read(cls, line: str) -> OwnRun:
        """Return what a line carries.

        Raises:
            ValueError: it is no line that `line` has returned.
        """
        found = cls.unpacked(line)
        if any(not _can_be_asked(one) for one in found.asked):
            raise ValueError("a question is none that the kit asks about this run")
        return found

    def line(self) -> str:
        """Return the questions and what they are about as one word."""
        return base64.urlsafe_b64encode(zlib.compress(self.model_dump_json().encode(), 9)).decode("ascii")

    def named(self) -> dict[str, Asked]:
        """Return the questions by their names in the table of answers."""
        return {f"question_{number}": one for number, one in enumerate(self.asked, 1)}

    def __repr__(self) -> str:
        asked = [f"{name}: {one.question.text}\n{_form(one.question)}" for name, one in self.named().items()]
        return "\n\n".join([*asked, f"Copy this line into the cell of your answers:\nrun: {self.line()}"])

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Show each question above its picture, and the line for the table."""
        shown = [
            f"<p><b>{name}</b>: {_with_code(one.question.text)}<br>{escape(_form(one.question))}</p>"
            f"{one.question.picture(one.record).html()}"
            for name, one in self.named().items()
        ]
        style = "white-space:pre-wrap; overflow-wrap:anywhere"
        line = f'<p>Copy this line into the cell of your answers:</p><pre style="{style}">run: {self.line()}</pre>'
        return "".join([*shown, line])


def _with_code(text: str) -> str:
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", escape(text))


def _form(question: Question) -> str:
    if question.choices:
        return f"Possible answers: {', '.join(question.choices)}"
    return "The answer is a whole number."


def _needed(record: Record, question: Question) -> Record:
    """Return only the part of a record that the picture of a question shows, because the line must be short."""
    kept: dict[str, object] = {"recorded_by": record.recorded_by}
    if question.view == "timeline":
        kept["runs"] = tuple(run for run in record.runs if question.subject in ("", run.node))
    elif question.view == "arrivals":
        rows = record.traffic[question.subject]
        kept["traffic"] = {question.subject: rows}
        nodes = {row.who.partition(" ")[0] for row in rows}
        kept["changes"] = tuple(change for change in record.changes if change.node in nodes)
    elif question.view == "qos":
        kept["ends"] = tuple(end for end in record.ends if end.topic == question.subject)
    else:
        kept["changes"] = tuple(change for change in record.changes if change.node == question.subject)
    return Record.model_validate(kept)


def _can_be_asked(asked: Asked) -> bool:
    """Whether the kit would ask this question about this record. The words may be those of another version."""
    wanted = asked.question.model_copy(update={"text": ""})
    return any(question.model_copy(update={"text": ""}) == wanted for question in possible(asked.record))
