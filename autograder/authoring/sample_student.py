"""Add a student's answers to a lab's sample class, so that the tests hold a verdict from now on."""

from __future__ import annotations

import json
import re
from pathlib import Path

from autograder.authoring.mutation.mutants import using
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.course.lab import Lab
from autograder.course.paths import CoursePaths
from autograder.grading.appeal import Appeal, handed_in


def write_sample_student(root: Path, lab: Lab, appeal: Appeal, name: str, about: str) -> list[Path]:
    """Write a sample student who has the solution, except for the answers that the appeal's check looks at.

    The check must pass for this student. The answers are anonymous: nothing else of the notebook is taken.

    Raises:
        KitError: the name is not allowed or taken, or the lab has no such check.
    """
    folder = CoursePaths(root).sample_students(lab.name) / name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise KitError(f"{name!r} cannot be the name of a sample student.", "Use lower-case letters, digits and _.")
    check = next((cell for cell in lab.checks if cell.grade_id == appeal.check), None)
    if check is None:
        raise KitError(f"{lab.name} has no check `{appeal.check}`.", "The lab may have changed since.")
    submission = handed_in(appeal, lab)
    texts = {}
    for grade_id in sorted(using(lab, check)):
        file = lab.answers[grade_id].file
        ending = "yaml" if file is not None and file.file_name.endswith((".yaml", ".yml")) else "py"
        texts[folder / "cells" / f"{grade_id}.{ending}"] = submission.sources[grade_id].rstrip("\n") + "\n"
    told = json.dumps(" ".join(about.split()), ensure_ascii=False)
    texts[folder / "expected.yaml"] = f"about: {told}\nbase: solution\n"
    # The same command may have written them, and then have been refused because the class was being graded.
    there = {path: path.read_text(encoding="utf-8") for path in folder.rglob("*") if path.is_file()}
    if there and there != texts:
        raise KitError(f"There is a sample student {name} already.", "Choose another name.")
    for path, text in texts.items():
        write_beside(path, text)
    return list(texts)
