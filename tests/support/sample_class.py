"""Builds the sample class of a lab from `tests/classes/<lab>` and says what grading must make of it.

As a script: `python tests/support/sample_class.py lab2_executors` writes
`build/sample/classes/lab2_executors/<student>/…` for as many students as it takes to show every kind of outcome. The
tests grade them all.
"""

from __future__ import annotations

import copy
import json
import shutil
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from places import ROOT

from autograder.core.errors import KitError
from autograder.course.cells import grade_id_of, source_of
from autograder.course.lab import Cell, Lab, load_lab
from autograder.course.paths import CoursePaths

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The one in C, where PyYAML has it, reads these hundreds of files ten times as fast."""


@dataclass
class Expected:
    """What grading must make of a student."""

    student: str
    about: str
    points: dict[str, float | None]
    """By grade_id of the check; None: could not find out."""
    from_solution: bool = False
    """Whether the answers that are not changed are the solution's; otherwise they are blank."""
    codes: dict[str, str] = field(default_factory=dict)
    """Code of the first failed outcome, by grade_id of the check."""
    because: dict[str, str] = field(default_factory=dict)
    """A part of its reason."""
    lost: dict[str, list[str]] = field(default_factory=dict)
    """Titles of the parts that were lost, sorted, by grade_id of a check that has parts."""
    breaks: dict[str, list[str]] = field(default_factory=dict)
    """Words of the task that the student breaks, by grade_id of the check that holds them."""
    follows: dict[str, str] = field(default_factory=dict)
    """Why a check loses points though the student breaks nothing that it holds, by its grade_id."""
    flagged: list[str] = field(default_factory=list)
    """Checks with flags for the instructor, sorted."""
    problems: list[str] = field(default_factory=list)
    """Codes of the notebook's own problems, sorted."""


def class_folder(lab: str) -> Path:
    """Where a lab's sample class is described."""
    return ROOT / "tests" / "classes" / lab


def students(lab: str) -> list[str]:
    """The sample class's students, sorted."""
    return sorted(path.parent.name for path in class_folder(lab).glob("*/expected.yaml"))


def _yaml(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    return yaml.load(path.read_text(encoding="utf-8"), Loader=_LOADER) or {}


def _only(mapping: dict[str, Any], known: set[str], path: Path) -> None:
    unknown = mapping.keys() - known
    if unknown:
        raise ValueError(f"{path}: unknown {sorted(unknown)}; known: {sorted(known)}")


def expected(lab: Lab, student: str, folder: Path | None = None) -> Expected:
    """Read what is expected of a student."""
    path = (folder or class_folder(lab.name)) / student / "expected.yaml"
    told = _yaml(path)
    _only(told, {"about", "base", "checks", "flagged", "problems", "rest"}, path)
    full = {cell.grade_id: cell.points for cell in lab.checks}
    _only(told.get("checks") or {}, set(full), path)
    points: dict[str, float | None] = {name: told.get("rest", top) for name, top in full.items()}
    result = Expected(student, told["about"], points, problems=sorted(told.get("problems") or []))
    result.from_solution = told.get("base") == "solution"
    result.flagged = sorted(told.get("flagged") or [])
    for name, check in (told.get("checks") or {}).items():
        _only(check, {"points", "code", "because", "lost", "breaks", "follows"}, path)
        result.points[name] = check["points"]
        if "code" in check:
            result.codes[name] = check["code"]
        if "lost" in check:
            result.lost[name] = sorted(check["lost"])
        if "because" in check:
            result.because[name] = check["because"]
        if "breaks" in check:
            result.breaks[name] = check["breaks"]
        if "follows" in check:
            result.follows[name] = check["follows"]
    return result


def build_student(lab: Lab, student: str, into: Path, folder: Path | None = None) -> Path:
    """Write what a student hands in to `into/<student>` and return that folder."""
    home = (folder or class_folder(lab.name)) / student
    made = into / student
    shutil.rmtree(made, ignore_errors=True)
    made.mkdir(parents=True)
    changes = _yaml(home / "notebook.yaml")
    known = {"sources", "metadata", "tags", "delete", "duplicate", "append", "files", "name"}
    _only(changes, known, home / "notebook.yaml")
    for name, text in (changes.get("files") or {}).items():
        (made / name).write_text(text, encoding="utf-8")
    name = changes.get("name", f"{lab.name}.ipynb")
    if name is None:
        return made
    raw = home / "submission.ipynb"
    content = raw.read_bytes() if raw.is_file() else json.dumps(_notebook(lab, home, changes), indent=1).encode()
    (made / name).write_bytes(content)
    return made


def _notebook(lab: Lab, home: Path, changes: dict[str, Any]) -> dict[str, Any]:
    solved = _yaml(home / "expected.yaml").get("base", "blank") == "solution"
    sources = {name: answer.solution if solved else answer.blank for name, answer in lab.answers.items()}
    for path in sorted((home / "cells").glob("*")):
        if path.stem not in sources:
            raise ValueError(f"{path}: the lab has no answer cell `{path.stem}`; it has {sorted(sources)}")
        text = path.read_text(encoding="utf-8")
        first = lab.answers[path.stem].blank.split("\n")[0]
        sources[path.stem] = text if text.startswith("%%") or not first.startswith("%%") else f"{first}\n{text}"
    notebook = lab.clean_notebook(sources)
    by_id = {grade_id_of(cell): cell for cell in notebook["cells"] if grade_id_of(cell)}
    for grade_id, source in (changes.get("sources") or {}).items():
        by_id[grade_id]["source"] = source
    for grade_id, metadata in (changes.get("metadata") or {}).items():
        for key, value in metadata.items():
            target = by_id[grade_id]["metadata"]
            target[key] = target.get(key, {}) | value if isinstance(value, dict) else value
    for cell in notebook["cells"] if changes.get("tags") else []:
        cell["metadata"]["tags"] = changes["tags"]
    notebook["cells"] = [cell for cell in notebook["cells"] if grade_id_of(cell) not in (changes.get("delete") or [])]
    for grade_id in changes.get("duplicate") or []:
        index = notebook["cells"].index(by_id[grade_id])
        notebook["cells"].insert(index + 1, copy.deepcopy(by_id[grade_id]) | {"id": f"copy-{grade_id}"[:64]})
    for number, extra in enumerate(changes.get("append") or []):
        metadata = {"nbgrader": {"schema_version": 3, "task": False} | extra["nbgrader"]} if "nbgrader" in extra else {}
        cell = {
            "cell_type": extra["cell_type"],
            "id": f"extra-{number}",
            "metadata": metadata,
            "source": extra["source"],
        }
        if extra["cell_type"] == "code":
            cell |= {"outputs": [], "execution_count": None}
        notebook["cells"].append(cell)
    return notebook


def outcomes(lab: Lab, student: str) -> set[str]:
    """The kinds of outcome that a student shows: reasons, problems of the notebook, flags, and how much was earned."""
    told = expected(lab, student)
    kinds = {*told.codes.values(), *(f"problem {code}" for code in told.problems)}
    for cell in lab.checks:
        earned = {None: "undecided", 0: "nothing", cell.points: "full"}.get(told.points[cell.grade_id], "part")
        kinds |= {earned, f"{earned}, flagged"} if cell.grade_id in told.flagged else {earned}
    return kinds


def recording_cell(lab: Lab) -> Cell:
    """The cell with which a student records a run for questions about it, as a check that a worker can run."""
    source = next(text for text in map(source_of, lab.released) if "ros.own_run(" in text)
    return Cell(grade_id="record_own_run", points=1, source=source)


def examples(lab: Lab) -> list[str]:
    """The solution, the blank lab, and students until every kind of outcome of the whole class was seen, sorted."""
    seen = {student: outcomes(lab, student) for student in students(lab.name)}
    chosen = [student for student in ("solution", "blank") if student in seen]
    missing = set().union(*seen.values()).difference(*(seen[student] for student in chosen))
    while missing:
        chosen.append(max(seen, key=lambda student: len(seen[student] & missing)))
        missing -= seen[chosen[-1]]
    return sorted(chosen)


def build_class(lab_name: str) -> Path:
    """Build examples of a lab's sample students under `build/sample/classes/<lab>` and return that folder."""
    lab = load_lab(ROOT, lab_name)
    into = CoursePaths(ROOT).sample_class(lab_name)
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    for student in examples(lab):
        build_student(lab, student, into)
    return into


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python tests/support/sample_class.py LAB")
    try:
        print(build_class(sys.argv[1]))
    except KitError as error:  # the name of the lab is misspelt
        sys.exit(f"error: {error.what}\n  {error.do}")
