"""The requirements of a lab: every sentence of a task, the check that holds it, and the student who breaks just that.

`tests/classes/<lab>/requirements.yaml` says which words of the task's text are a requirement, which check (and which
part of it) holds them, and which sample student breaks them; and which sentences only explain. The test of this module
fails for a sentence that is in neither list. As a script it writes `tests/classes/REQUIREMENTS.md`, and
`tests/classes/BROKEN_AND_LOST.md`, which says for each sample student which words are broken and which points are lost.
"""

from __future__ import annotations

import functools
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import kill_matrix
import sample_class
from places import ROOT

from autograder.authoring.requirements import Requirements, plain
from autograder.authoring.requirements import read as read_file
from autograder.course.lab import Lab, load_lab

PAGE = ROOT / "tests" / "classes" / "REQUIREMENTS.md"
LOST_PAGE = PAGE.with_name("BROKEN_AND_LOST.md")


@functools.cache
def read(lab: str) -> Requirements:
    """A lab's requirements; the file is long, and it is asked for at every point that somebody loses."""
    return read_file(sample_class.class_folder(lab) / "requirements.yaml")


def uncovered(lab: Lab) -> list[str]:
    """Sentences of tasks that are neither a requirement nor said to be none."""
    return read(lab.name).uncovered(lab)


def defects(lab: Lab) -> list[str]:
    """What is wrong with a lab's table, as lines to read."""
    told = read(lab.name)
    checks = {check.grade_id: check for check in lab.checks}
    found = [f"not in the lab's text: {text!r}" for text in told.strangers(lab)]
    for one in told.required:
        if one.check not in checks:
            found.append(f"{one.text!r}: the lab has no check `{one.check}`")
            continue
        for name in filter(None, (one.student, one.once)):
            if name not in sample_class.students(lab.name):
                found.append(f"{one.text!r}: the class has no student `{name}`")
                continue
            student = sample_class.expected(lab, name)
            lost = student.lost.get(one.check, [])
            if one.check not in kill_matrix.lost(lab, student):
                found.append(f"{one.text!r}: `{name}` does not fail `{one.check}`")
            elif one.part and student.points[one.check] and one.part not in lost:
                found.append(f"{one.text!r}: `{name}` does not lose the part {one.part!r}, but {lost}")
    return found


def untried(lab: Lab) -> list[str]:
    """Words with a quantifier or a bound for which it is not said how they are tried."""
    return read(lab.name).untried()


def broken(lab: Lab, student: sample_class.Expected, check: str) -> list[str]:
    """Words held by a check that a student breaks: those for whose sake he is in the class, and what else he breaks."""
    named = [
        one.text for one in read(lab.name).required if one.check == check and student.student in (one.student, one.once)
    ]
    return named + [text for text in map(plain, student.breaks.get(check, [])) if text not in named]


def unexplained(lab: Lab) -> list[str]:
    """Points that a sample student loses although nobody has said which words are broken, and the reverse."""
    found = []
    texts: dict[str, list[str]] = {}
    for one in read(lab.name).required:
        texts.setdefault(one.check, []).append(one.text)
    for student in losers(lab):
        gone = kill_matrix.lost(lab, student)
        for check in gone:
            if bool(broken(lab, student, check)) == bool(student.follows.get(check)):
                found.append(f"{student.student}: {check} needs either `breaks` or `follows`")
        for check, words in student.breaks.items():
            found += [
                f"{student.student}: {check}: not there: {w!r}"
                for w in map(plain, words)
                if w not in texts.get(check, [])
            ]
        found += [
            f"{student.student}: {check} loses nothing" for check in {*student.breaks, *student.follows} - set(gone)
        ]
    return found


def losers(lab: Lab) -> list[sample_class.Expected]:
    """Students whose notebooks are the solution but for their mistakes."""
    return [student for student in kill_matrix.one_mistake(lab) if student.from_solution]


def lost_page() -> str:
    """The page of what is broken and what is lost."""
    lines = [
        "# What is broken, and what is lost",
        "",
        "Made by `python tests/tools/requirements.py`. Each line: a sample student whose notebook is the solution but",
        "for some mistakes, a check, the points that it takes, the parts of it that are lost, and the words of the",
        "task that the student breaks. Where a check takes points although nothing is broken that it holds, the last",
        "column says why: one mistake then costs more than its own part.",
        "",
    ]
    for name in labs():
        lab = load_lab(ROOT, name)
        full = {check.grade_id: check.points or 0 for check in lab.checks}
        rows, more = [], 0
        for student in losers(lab):
            for check in kill_matrix.lost(lab, student):
                words = "<br>".join(text.replace("|", "\\|") for text in broken(lab, student, check))
                more += not words
                points = f"{full[check] - (student.points[check] or 0):g} of {full[check]:g}"
                parts = "; ".join(student.lost.get(check, []))
                why = words or student.follows.get(check, "")
                rows.append(f"| {student.student} | `{check}` | {points} | {parts} | {why} |")
        lines += [
            f"## {name}",
            "",
            f"In {more} of {len(rows)} lines a check takes points for a mistake that another one holds.",
            "",
        ]
        lines += ["| student | check | lost | parts | broken |", "|---|---|---|---|---|", *rows, ""]
    return "\n".join(lines)


def unheld(lab: Lab) -> list[str]:
    """Checks that hold no requirement."""
    return read(lab.name).unheld(lab)


def labs() -> list[str]:
    """Labs that have a sample class."""
    return kill_matrix.labs()


def page() -> str:
    """The whole page."""
    lines = [
        "# Requirement, check, mistake",
        "",
        "Made by `python tests/tools/requirements.py`. Each line: words of the lab, the check (and its part) that",
        "holds them, the sample student who breaks just that, and, where the words say how often, how long, how many",
        "or for which values something holds, how the check tries that. In brackets: the sample student who keeps the",
        "words the first time, or for one value, and breaks them after that.",
        "",
    ]
    for name in labs():
        lines += [
            f"## {name}",
            "",
            "| requirement | check | part | broken by | how it is tried |",
            "|---|---|---|---|---|",
        ]
        for one in read(name).required:
            text = one.text.replace("|", "\\|")
            tried = " ".join(filter(None, (one.tried, one.once and f"({one.once})")))
            lines.append(f"| {text} | `{one.check}` | {one.part} | {one.student} | {tried} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        lab = load_lab(ROOT, sys.argv[1])
        for title, lines in (
            ("uncovered", uncovered(lab)),
            ("wrong", defects(lab)),
            ("without requirement", unheld(lab)),
            ("not said how it is tried", untried(lab)),
            ("points lost without a reason", unexplained(lab)),
        ):
            print(f"{title}: {len(lines)}", *[f"  {line}" for line in lines], sep="\n")
    else:
        PAGE.write_text(page(), encoding="utf-8")
        LOST_PAGE.write_text(lost_page(), encoding="utf-8")
        print(PAGE.relative_to(ROOT), LOST_PAGE.relative_to(ROOT))
