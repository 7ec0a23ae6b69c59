"""The requirements of a lab: every sentence of a task, and the check that holds it.

`requirements.yaml` of a lab's sample class says which words of the task's text are a requirement, which check (and
which part of it) holds them, and which sample student breaks them; and which sentences only explain.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from autograder.core.errors import KitError
from autograder.course.cells import grade_id_of, source_of
from autograder.course.lab import Lab

_TASK = re.compile(
    r"\*\*(Write|Repair|Complete|Change|Describe|Fill|Now)\b|^Write\b|\bWrite (one|two|three|the|a)\b", re.MULTILINE
)
"""What a text that sets a task says."""
_QUANTIFIER = re.compile(
    r"\b(each|every|again|only|once|twice|most|least|latest|first|last|all|both|never|always|until|while|within|any|another"
    r"|nothing|none|above|below|between|before|after|more|less|fewer|higher|lower|than|negative|zero|default|same|other"
    r"|times|longer|in order|ms)\b|\d ?(s|Hz)\b|\bas (long|soon|often|many) as\b|\bseconds?\b",
    re.IGNORECASE,
)
"""Words that a check does not hold if it tries them once, with one value, in one order."""
_SENTENCE = re.compile(r"(?<=[.!?:])[)*`_]*\s+(?=[A-Z`*(_\"])")


@dataclass(frozen=True)
class Requirement:
    """One requirement of a task."""

    text: str
    """Words of the lab's text."""
    check: str
    """grade_id of the check that holds it."""
    part: str
    """Part of that check; empty: the whole of it."""
    student: str
    """Sample student who breaks it; empty where a course has no sample class."""
    tried: str = ""
    """How the check tries what the words say of a number, a time or a repetition, such as `two values and zero`."""
    once: str = ""
    """Sample student who keeps it the first time, or for one value, and breaks it then; empty if there is none."""

    @property
    def quantified(self) -> bool:
        """Whether the words say how often, how many, how long, or for which values something holds."""
        return _QUANTIFIER.search(self.text) is not None


@dataclass(frozen=True)
class Requirements:
    """What is required in a lab."""

    required: list[Requirement]
    remarks: list[str]
    """Words of the tasks that require nothing."""

    def uncovered(self, lab: Lab) -> list[str]:
        """Sentences of tasks that are neither a requirement nor said to be none."""
        words = [one.text for one in self.required] + self.remarks
        return [unit for unit in tasks(lab) if not any(text in unit or unit in text for text in words)]

    def strangers(self, lab: Lab) -> list[str]:
        """Words that are not in the lab's text."""
        whole = plain(" ".join(source_of(cell) for cell in lab.released))
        return [text for text in [one.text for one in self.required] + self.remarks if text not in whole]

    def untried(self) -> list[str]:
        """Words with a quantifier or a bound for which nobody has written down how a check tries it."""
        return [one.text for one in self.required if one.quantified and not one.tried]

    def unheld(self, lab: Lab) -> list[str]:
        """Checks that test no requirement."""
        held = {one.check for one in self.required}
        return [check.grade_id for check in lab.checks if check.grade_id not in held]


def plain(text: str) -> str:
    """Text on one line, without Markdown's emphasis."""
    return " ".join(text.replace("**", "").split())


def read(path: Path) -> Requirements:
    """Read a lab's requirements.

    Raises:
        KitError: the file says something else.
    """
    try:
        told: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
        found = [
            Requirement(plain(one["text"]), **{key: value for key, value in one.items() if key != "text"})
            for one in ({"part": "", "student": ""} | each for each in told["requirements"])
        ]
        return Requirements(found, [plain(text) for text in told.get("not_required") or []])
    except (yaml.YAMLError, TypeError, KeyError, AttributeError) as error:
        raise KitError(f"{path} cannot be read: {error}.", "Each requirement has a `text` and a `check`.") from error


def tasks(lab: Lab) -> list[str]:
    """Every sentence and every list item of the texts that set a task."""
    checks = {check.grade_id for check in lab.checks}
    units: list[str] = []
    texts: list[str] = []
    for cell in lab.released:
        grade_id = grade_id_of(cell)
        answer = lab.answers.get(grade_id)
        if cell["cell_type"] == "markdown" and answer is None:
            texts.append(source_of(cell))
            continue
        if grade_id in checks or (answer is not None and answer.file is not None):
            for text in texts:
                units += [unit for unit in _units(text) if unit not in units]
        texts = []
    return units


def _units(text: str) -> list[str]:
    """The sentences from the first that sets the task on; headings, code and tables set none."""
    match = _TASK.search(text)
    if match is None:
        return []
    text = re.sub(r"^```.*?^```", "", text[match.start() :], flags=re.DOTALL | re.MULTILINE)
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)", text)
    blocks = [block for block in blocks if block.strip() and not block.lstrip().startswith(("#", "|", ">"))]
    sentences = [
        sentence for block in blocks for sentence in _SENTENCE.split(re.sub(r"^\s*(?:[-*]|\d+\.)\s", "", block))
    ]
    return [plain(sentence) for sentence in sentences if re.search(r"\w", sentence)]
