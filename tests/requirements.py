"""The requirements of a lab: every sentence of a task, the check that holds it, and the student who breaks just that.

`tests/classes/<lab>/requirements.yaml` says which words of the task's text are a requirement, which check (and which
part of it) holds them, and which sample student breaks them; and which sentences only explain. The test of this module
fails for a sentence that is in neither list. As a script it writes `tests/classes/REQUIREMENTS.md`.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from typing import Any

import kill_matrix
import sample_class
import yaml
from sample_class import ROOT

from autograder.course.lab import Lab, grade_id_of, load_lab, source_of

PAGE = ROOT / "tests" / "classes" / "REQUIREMENTS.md"

_TASK = re.compile(
    r"\*\*(Write|Repair|Complete|Change|Describe|Fill|Now)\b|^Write\b|\bWrite (one|two|three|the|a)\b", re.MULTILINE
)
"""What a text that sets a task says."""
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
    """Sample student who breaks it."""


def plain(text: str) -> str:
    """Text on one line, without Markdown's emphasis."""
    return " ".join(text.replace("**", "").split())


def read(lab: str) -> tuple[list[Requirement], list[str]]:
    """A lab's requirements, and the words of what is none."""
    path = sample_class.class_folder(lab) / "requirements.yaml"
    told: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    found = [
        Requirement(plain(one["text"]), one["check"], one.get("part", ""), one["student"])
        for one in told["requirements"]
    ]
    return found, [plain(text) for text in told.get("not_required") or []]


def tasks(lab: Lab) -> list[str]:
    """Every sentence and every list item of the texts that set a task."""
    units: list[str] = []
    texts: list[str] = []
    for cell in lab.released:
        if cell["cell_type"] == "markdown" and grade_id_of(cell) not in lab.answers:
            texts.append(source_of(cell))
            continue
        answer = lab.answers.get(grade_id_of(cell))
        if answer is not None and answer.file is not None:
            for text in texts:
                units += [unit for unit in _units(text) if unit not in units]
        if answer is None or answer.file is not None:
            texts = [] if answer is None else texts
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


def uncovered(lab: Lab) -> list[str]:
    """Sentences of tasks that are neither a requirement nor said to be none."""
    requirements, remarks = read(lab.name)
    words = [requirement.text for requirement in requirements] + remarks
    return [unit for unit in tasks(lab) if not any(text in unit or unit in text for text in words)]


def defects(lab: Lab) -> list[str]:
    """What is wrong with a lab's table, as lines to read."""
    requirements, remarks = read(lab.name)
    whole = plain(" ".join(source_of(cell) for cell in lab.released))
    checks = {check.grade_id: check for check in lab.checks}
    found = [
        f"not in the lab's text: {text!r}" for text in [r.text for r in requirements] + remarks if text not in whole
    ]
    for one in requirements:
        if one.check not in checks:
            found.append(f"{one.text!r}: the lab has no check `{one.check}`")
        elif one.student not in sample_class.students(lab.name):
            found.append(f"{one.text!r}: the class has no student `{one.student}`")
        else:
            student = sample_class.expected(lab, one.student)
            lost = student.lost.get(one.check, [])
            if one.check not in kill_matrix.lost(lab, student):
                found.append(f"{one.text!r}: `{one.student}` does not fail `{one.check}`")
            elif one.part and student.points[one.check] and one.part not in lost:
                found.append(f"{one.text!r}: `{one.student}` does not lose the part {one.part!r}, but {lost}")
    return found


def unheld(lab: Lab) -> list[str]:
    """Checks that hold no requirement."""
    held = {requirement.check for requirement in read(lab.name)[0]}
    return [check.grade_id for check in lab.checks if check.grade_id not in held]


def labs() -> list[str]:
    """Labs that have a sample class."""
    return kill_matrix.labs()


def page() -> str:
    """The whole page."""
    lines = [
        "# Requirement, check, mistake",
        "",
        "Made by `python tests/requirements.py`. Each line: words of the lab, the check (and its part) that",
        "holds them, and the sample student who breaks just that.",
        "",
    ]
    for name in labs():
        lines += [f"## {name}", "", "| requirement | check | part | broken by |", "|---|---|---|---|"]
        for one in read(name)[0]:
            text = one.text.replace("|", "\\|")
            lines.append(f"| {text} | `{one.check}` | {one.part} | {one.student} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        lab = load_lab(ROOT, sys.argv[1])
        for title, lines in (
            ("uncovered", uncovered(lab)),
            ("wrong", defects(lab)),
            ("without requirement", unheld(lab)),
        ):
            print(f"{title}: {len(lines)}", *[f"  {line}" for line in lines], sep="\n")
    else:
        PAGE.write_text(page(), encoding="utf-8")
        print(PAGE.relative_to(ROOT))
