"""The requirements of a lab: the sentences of its tasks, and the check for each of them.

The file `requirements.yaml` of a lab's sample class lists the parts of the lab's text that are requirements. For each
requirement it names the check (and the part of the check) that tests it, and the sample student who violates it. It
also lists the sentences that require nothing.
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
"""The words by which a text that sets a task is recognised."""
_QUANTIFIER = re.compile(
    r"\b(each|every|again|only|once|twice|most|least|latest|first|last|all|both|never|always|until|while|within|any|another"
    r"|nothing|none|above|below|between|before|after|more|less|fewer|higher|lower|than|negative|zero|default|same|other"
    r"|times|longer|in order|ms)\b|\d ?(s|Hz)\b|\bas (long|soon|often|many) as\b|\bseconds?\b",
    re.IGNORECASE,
)
"""Words that take more than one try, one value or one order to check."""
_SENTENCE = re.compile(r"(?<=[.!?:])[)*`_]*\s+(?=[A-Z`*(_\"])")


@dataclass(frozen=True)
class Requirement:
    """One requirement of a task."""

    text: str
    """The part of the lab's text that states the requirement."""
    check: str
    """The grade_id of the check that tests it."""
    part: str
    """The part of the check; empty for the whole check."""
    student: str
    """The sample student who violates it; empty if the course has no sample class."""
    tried: str = ""
    """How the check tries a number, a time or a repetition that the words ask for, such as `two values and zero`."""
    once: str = ""
    """The sample student who obeys it only the first time, or only for one value; empty if there is none."""

    @property
    def quantified(self) -> bool:
        """Return whether the words say how often, how many, how long, or for which values something holds."""
        return _QUANTIFIER.search(self.text) is not None


@dataclass(frozen=True)
class Requirements:
    """The requirements of a lab."""

    required: list[Requirement]
    remarks: list[str]
    """Sentences of the tasks that require nothing."""

    def uncovered(self, lab: Lab) -> list[str]:
        """Return the sentences of tasks that are neither listed as a requirement nor as requiring nothing."""
        words = [one.text for one in self.required] + self.remarks
        return [unit for unit in tasks(lab) if not any(text in unit or unit in text for text in words)]

    def strangers(self, lab: Lab) -> list[str]:
        """Return the listed texts that do not occur in the lab."""
        whole = plain(" ".join(source_of(cell) for cell in lab.released))
        return [text for text in [one.text for one in self.required] + self.remarks if text not in whole]

    def untried(self) -> list[str]:
        """Words with a quantifier or a bound for which nobody has written down how a check tries it."""
        return [one.text for one in self.required if one.quantified and not one.tried]

    def unheld(self, lab: Lab) -> list[str]:
        """Return the checks that test no requirement."""
        held = {one.check for one in self.required}
        return [check.grade_id for check in lab.checks if check.grade_id not in held]


def plain(text: str) -> str:
    """Return a text in one line and without bold type of Markdown."""
    return " ".join(text.replace("**", "").split())


def read(path: Path) -> Requirements:
    """Read a lab's requirements.

    Raises:
        KitError: the file does not have the form of a list of requirements.
    """
    try:
        told: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
        found = [
            Requirement(plain(one["text"]), **{key: value for key, value in one.items() if key != "text"})
            for one in ({"part": "", "student": ""} | each for each in told["requirements"])
        ]
        return Requirements(found, [plain(text) for text in told.get("not_required") or []])
    except (yaml.YAMLError, UnicodeDecodeError, TypeError, KeyError, AttributeError) as error:
        raise KitError(f"{path} cannot be read: {error}.", "Each requirement has a `text` and a `check`.") from error


def tasks(lab: Lab) -> list[str]:
    """Return every sentence and every list item of the texts that set a task."""
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
    """Return the sentences of a text, from the first one that sets a task, without headings, code and tables."""
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
