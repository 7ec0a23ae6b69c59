"""The kill matrix of a lab: which mistake is caught by which check, for which reason.

As a script: `python tests/support/kill_matrix.py` writes `tests/classes/KILL_MATRIX.md` from what the sample classes
expect. The class tests hold the expectations against real grading, so the table says what really happens.
"""

from __future__ import annotations

import sys
from pathlib import Path

import sample_class
from places import ROOT
from sample_class import Expected

from autograder.course.lab import Lab, load_lab

PAGE = ROOT / "tests" / "classes" / "KILL_MATRIX.md"


def labs() -> list[str]:
    """Labs that have a sample class, in the order of the course."""
    return sorted(path.name for path in (ROOT / "tests" / "classes").iterdir() if path.is_dir())


def members(lab: Lab) -> list[Expected]:
    """What is expected of each student of a lab's class."""
    return [sample_class.expected(lab, student) for student in sample_class.students(lab.name)]


def lost(lab: Lab, student: Expected) -> list[str]:
    """Checks in which a student loses points."""
    full = {check.grade_id: check.points for check in lab.checks}
    return [name for name, points in student.points.items() if points is not None and points < (full[name] or 0)]


def one_mistake(lab: Lab) -> list[Expected]:
    """Students who lose points by mistakes of their own in a notebook that is otherwise complete."""
    return [student for student in members(lab) if lost(lab, student) and any(student.points.values())]


def unbeaten(lab: Lab) -> list[str]:
    """Checks that no student with a mistake fails: each is missing a mistake, or is useless."""
    beaten = {name for student in one_mistake(lab) for name in lost(lab, student)}
    return [check.grade_id for check in lab.checks if check.grade_id not in beaten]


def table(lab: Lab) -> list[str]:
    """The lab's table, one line a student."""
    checks = [check.grade_id for check in lab.checks]
    lines = [f"## {lab.name}", "", *[f"{number}. `{name}`" for number, name in enumerate(checks, 1)], ""]
    lines.append("| student | mistake | " + " | ".join(str(number) for number in range(1, len(checks) + 1)) + " |")
    lines.append("|---|---|" + "---|" * len(checks))
    for student in one_mistake(lab):
        gone = lost(lab, student)
        marks = [student.codes.get(name, "lost") if name in gone else "" for name in checks]
        lines.append(f"| {student.student} | {student.about} | " + " | ".join(marks) + " |")
    return [*lines, ""]


def page() -> str:
    """The whole page."""
    head = [
        "# Which mistake is caught by which check",
        "",
        "Made by `python tests/support/kill_matrix.py` from what the sample classes expect; `make test` grades every",
        "student and holds the result against it. A cell names the reason for which the check took its points.",
        "",
    ]
    return "\n".join(head + [line for name in labs() for line in table(load_lab(ROOT, name))])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(Path(PAGE).relative_to(ROOT))
    sys.exit(0)
