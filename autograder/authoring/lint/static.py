"""Everything about a lab that can be found out without running it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

from autograder.authoring import requirements
from autograder.authoring.lint.checks import check_findings
from autograder.authoring.lint.finding import Finding
from autograder.authoring.lint.metadata import metadata_findings
from autograder.core.errors import KitError
from autograder.course.book import read_book
from autograder.course.cells import MARK
from autograder.course.lab import Lab, lab_names, load_lab
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE, read_settings
from autograder.grading.canaries import known_answers, wrong_answers
from autograder.reasons import all_kinds


def course_findings(root: Path) -> list[Finding]:
    """Say what is wrong with the course's own settings: labs and codes that they list and that are not there."""
    names = lab_names(root)
    missing = [name for name in read_settings(root).labs if name not in names]
    found = [Finding("", f"{SETTINGS_FILE} lists a lab that there is not, `{name}`.") for name in missing]
    explained = read_book(root).sections
    if explained:
        checks = "".join(cell.source for name in names for cell in load_lab(root, name).cells)
        known = all_kinds().keys() | set(re.findall(r"""code=["']([a-z-]+)""", checks))
        unknown = [code for code in explained if code not in known]
        found += [Finding("", f"{SETTINGS_FILE} explains a reason that nothing gives, `{code}`.") for code in unknown]
    return found


def read_findings(root: Path, name: str) -> list[Finding]:
    """Read a lab's source, and say what is wrong with it.

    Raises:
        KitError: there is no such lab under `solutions`.
    """
    notebook = CoursePaths(root).solutions / name / f"{name}.ipynb"
    try:
        cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    except FileNotFoundError as error:
        raise KitError(f"There is no solutions/{name}/{name}.ipynb.", "Name a folder under `solutions`.") from error
    except (ValueError, KeyError, TypeError) as error:
        return [Finding("", f"{notebook.name} is no notebook: {error}.")]
    found = list(metadata_findings(cells))
    try:
        lab = load_lab(root, name)
    except KitError as error:
        return found or [Finding("", error.what)]
    found += check_findings(lab)
    if not lab.checks:
        found.append(Finding("", "it has no check, so nobody can get points."))
    found += _canary_findings(root, lab)
    return [*found, *_requirement_findings(lab, CoursePaths(root).requirements(name))]


def _canary_findings(root: Path, lab: Lab) -> Iterator[Finding]:
    path = CoursePaths(root).canaries(lab.name)
    try:
        named = {name for one in wrong_answers(root, lab) for name in one.points}
        known_answers(root, lab)
    except KitError as error:
        yield Finding("", error.what)
        return
    if not path.is_file():
        yield Finding("", f"there is no {path}, so no wrong answers are known that could run in a class.", warning=True)
        return
    for check in lab.checks:
        if check.grade_id not in named:
            yield Finding(check.grade_id, f"{path.name} has no wrong answer for it.", warning=True)


def _requirement_findings(lab: Lab, path: Path) -> Iterator[Finding]:
    if not path.is_file():
        yield Finding("", f"there is no {path}, so nobody can say whether every requirement is checked.", warning=True)
        return
    told = requirements.read(path)
    known = {check.grade_id for check in lab.checks}
    for one in told.required:
        if one.check not in known:
            yield Finding("", f"{path.name} names the check `{one.check}`, which the lab does not have.", warning=True)
    for text in told.strangers(lab):
        yield Finding("", f"{path.name}: these words are not in the lab: {text}", warning=True)
    for text in told.uncovered(lab):
        yield Finding("", f"nothing says which check holds this sentence: {text}", warning=True)
    for check in told.unheld(lab):
        yield Finding(check, "it holds no requirement.", warning=True)


def release_findings(files: dict[Path, bytes]) -> list[Finding]:
    """Look for what students must not receive in the files of a release."""
    found = []
    for path, content in files.items():
        if path.suffix != ".ipynb":
            continue
        for number, cell in enumerate(json.loads(content)["cells"], start=1):
            name = cell["metadata"].get("nbgrader", {}).get("grade_id", str(number))
            source = cell["source"] if isinstance(cell["source"], str) else "".join(cell["source"])
            marks = {match[2].lower() for match in MARK.finditer(source)}
            found += [Finding(name, f"students would receive its {mark}.") for mark in sorted(marks)]
    return found
