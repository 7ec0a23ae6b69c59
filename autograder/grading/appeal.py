"""An appeal: one file that holds what is needed to run a check of a submission again, and what the student says of it.

The file comes from a student. It is data of limited size, and nothing in it is believed: the check that runs again is
the course's own, in the sandbox, and the verdict in the file is only shown as what the student saw.
"""

from __future__ import annotations

import datetime
import json
import random
import tempfile
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from autograder.core.errors import KitError
from autograder.core.files import read_plain
from autograder.core.results import CheckResult, Text
from autograder.core.version import VERSION
from autograder.course.lab import Cell, Lab, kit_digest
from autograder.grading.messages import received
from autograder.grading.runner import Settings
from autograder.graph.recording import BagMessage
from autograder.submission.answers import Submission
from autograder.submission.notebook_file import NOTEBOOK_BYTES
from autograder.submission.reader import read_submission

ENDING = ".appeal.json"
_SENTENCE = 1000
"""The number of characters that a student's sentence may have."""
_NAME = 200
"""The number of characters that a student's name may have."""
_MESSAGES, _MESSAGE_BYTES = 500, 1_000_000
"""The number of messages in a file, and of bytes of them all."""
MOST_BYTES = 2 * NOTEBOOK_BYTES
"""The size of the largest file that is read."""

_Word = Annotated[Text, StringConstraints(max_length=_NAME)]


class Appeal(BaseModel):
    """The contents of the file."""

    model_config = ConfigDict(extra="forbid")

    form: Literal[1] = 1
    """The version of this form."""
    lab: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,100}$")]
    check: _Word
    """The grade_id of the check."""
    student: _Word
    """Who the student claims to be."""
    sentence: Annotated[Text, StringConstraints(min_length=1, max_length=_SENTENCE)]
    made: datetime.datetime
    kit: _Word
    kit_digest: _Word
    lab_digest: _Word
    """The digest of the lab that the student's kit has. It differs from the course's, which has hidden tests."""
    seed: Annotated[int, Field(ge=0, lt=2**64)]
    seen: CheckResult
    """The verdict that the student saw, without pictures."""
    messages: Annotated[list[BagMessage], Field(max_length=_MESSAGES)]
    """The first messages that the check received."""
    notebook: str
    """The notebook without outputs, as JSON."""


def make_appeal(notebook: Path, student: str, lab: Lab, check: Cell, sentence: str, settings: Settings) -> Appeal:
    """Run a check of a notebook, and return the appeal against its verdict.

    Args:
        notebook: the student's notebook.
        student: the student's name.
        lab: the lab of the notebook.
        check: the check.
        sentence: what the student says about the verdict.
        settings: how the check is run. Without a seed, one is chosen.

    Raises:
        KitError: the notebook cannot be read, the sentence is too long, or the check had no result.
    """
    if not sentence.strip() or len(sentence) > _SENTENCE:
        raise KitError(f"The sentence has {len(sentence)} characters.", f"Say it in 1 to {_SENTENCE} characters.")
    if not student or len(student) > _NAME:
        raise KitError(f"The name has {len(student)} characters.", f"Name yourself in 1 to {_NAME}: --name NAME")
    submission = read_submission(notebook, lab)
    if not submission.readable:
        raise KitError(f"{notebook}: {submission.problems[-1].because}", "Name a notebook of this lab.")
    seed = random.SystemRandom().getrandbits(32) if settings.seed is None else settings.seed
    fixed = Settings(isolation=settings.isolation, seed=seed)
    results, messages = received(notebook, student, lab, fixed, [check.grade_id])
    if not results:
        raise KitError(f"The check {check.grade_id} gave no result.", "Run the command again.")
    return Appeal(
        lab=lab.name,
        check=check.grade_id,
        student=student,
        sentence=sentence.strip(),
        made=datetime.datetime.now(datetime.UTC).replace(microsecond=0),
        kit=VERSION,
        kit_digest=kit_digest(),
        lab_digest=lab.digest,
        seed=seed,
        seen=_without_pictures(results[0]),
        messages=_first(messages),
        notebook=_without_outputs(notebook),
    )


def read_appeal(path: Path) -> Appeal:
    """Read an appeal that a student has sent.

    Raises:
        KitError: the file cannot be read, is too large, or does not have the form of an appeal.
    """
    try:
        content = read_plain(path.parent, [path.name], MOST_BYTES + 1)
    except OSError as error:
        raise KitError(f"{path} cannot be read: {error.strerror or error}.", "Name the file of an appeal.") from error
    if len(content) > MOST_BYTES:
        raise KitError(f"{path} is larger than {MOST_BYTES // 1024**2} MiB, so it is no appeal.", "Ask for another.")
    try:
        appeal = Appeal.model_validate_json(content)
        json.loads(appeal.notebook)
    except (ValidationError, ValueError, RecursionError) as error:
        where = ".".join(map(str, error.errors()[0]["loc"])) if isinstance(error, ValidationError) else "notebook"
        raise KitError(
            f"{path} is not an appeal that this version of the kit made: `{where[:100]}` is not as it should be.",
            "Ask the student to make it again: autograder appeal NOTEBOOK CHECK SENTENCE",
        ) from error
    return appeal.model_copy(update={"seen": _without_pictures(appeal.seen)})


def handed_in(appeal: Appeal, lab: Lab) -> Submission:
    """Return what the appeal's notebook hands in, read as any other submission is read."""
    with tempfile.TemporaryDirectory(prefix="appeal-") as folder:
        return read_submission(_unpacked(appeal, folder), lab)


def run_again(appeal: Appeal, lab: Lab, settings: Settings) -> tuple[CheckResult, list[BagMessage]]:
    """Run the course's own check on the answers of an appeal, and return its result and the messages that it received.

    Raises:
        KitError: the notebook cannot be read, the lab has no such check, or the check gave no result.
    """
    if appeal.check not in {cell.grade_id for cell in lab.checks}:
        raise KitError(f"{lab.name} has no check `{appeal.check}`.", "The lab may have changed since.")
    with tempfile.TemporaryDirectory(prefix="appeal-") as folder:
        notebook = _unpacked(appeal, folder)
        submission = read_submission(notebook, lab)
        if not submission.readable:
            raise KitError(f"The appeal's notebook: {submission.problems[-1].because}", "Ask the student for another.")
        results, messages = received(notebook, "appeal", lab, settings, [appeal.check])
    if not results:
        raise KitError(f"The check {appeal.check} gave no result.", "Run the command again.")
    return results[0], messages


def _unpacked(appeal: Appeal, folder: str) -> Path:
    path = Path(folder) / f"{appeal.lab}.ipynb"
    path.write_text(appeal.notebook, encoding="utf-8")
    return path


def _without_outputs(notebook: Path) -> str:
    content = json.loads(notebook.read_text(encoding="utf-8-sig"))
    for cell in content["cells"]:
        if isinstance(cell, dict) and cell.get("cell_type") == "code":
            cell.update(outputs=[], execution_count=None)
        if isinstance(cell, dict):
            cell.pop("attachments", None)
    return json.dumps(content)


def _without_pictures(check: CheckResult) -> CheckResult:
    outcomes = [outcome.model_copy(update={"picture": None}) for outcome in check.outcomes]
    return check.model_copy(update={"outcomes": outcomes})


def _first(messages: list[BagMessage]) -> list[BagMessage]:
    kept, room = [], _MESSAGE_BYTES
    for message in sorted(messages, key=lambda one: one.stamp)[:_MESSAGES]:
        room -= len(message.data)
        if room < 0:
            break
        kept.append(message)
    return kept
