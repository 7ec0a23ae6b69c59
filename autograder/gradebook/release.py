"""Generates what students receive, and notes a lab's cells in the gradebook."""

from __future__ import annotations

import tempfile
from pathlib import Path

from autograder.core.errors import GRADEBOOK_REFUSED, KitError
from autograder.course.lab import load_lab
from autograder.gradebook.api import answered, last_error, open_api
from autograder.gradebook.database import make_usable
from autograder.gradebook.settings import gradebook_address


def generate(root: Path, lab: str, into: Path, gradebook: bool) -> Path:
    """Generate what students receive of a lab, and note its cells in the course's gradebook if asked to.

    Returns:
        The folder of the generated lab.

    Raises:
        KitError: nbgrader refuses.
    """
    api = open_api(root, gradebook, release_directory=str(into))
    answer = answered(api.generate_assignment(lab, force=True, create=True))
    if not answer["success"]:
        why = last_error(answer)
        raise KitError(f"nbgrader could not generate {lab}: {why}.", GRADEBOOK_REFUSED * ("OperationalError" in why))
    return into / lab


def released_files(root: Path, lab: str) -> dict[Path, bytes]:
    """Return what students receive of a lab, by path below `labs/<lab>`; equal sources give equal files.

    Raises:
        KitError: there is no such lab under `solutions`, or nbgrader refuses.
    """
    if not (root / "solutions" / lab / f"{lab}.ipynb").is_file():
        raise KitError(f"There is no solutions/{lab}/{lab}.ipynb.", "Name a folder under `solutions`.")
    with tempfile.TemporaryDirectory() as folder:
        made = generate(root, lab, Path(folder), gradebook=False)
        files = {path.relative_to(made): path.read_bytes() for path in sorted(made.rglob("*")) if path.is_file()}
    return {
        path: content if path.suffix != ".ipynb" else content.rstrip(b"\n") + b"\n" for path, content in files.items()
    }


def knows(root: Path, lab: str) -> bool:
    """Whether the gradebook has the cells of a lab as they are now."""
    from sqlalchemy import create_engine

    from autograder.gradebook.own_tables import THE_LAB, recorded

    engine = create_engine(gradebook_address(root))
    try:
        with engine.connect() as connection:
            return recorded(connection, lab).get(THE_LAB) == load_lab(root, lab).source_digest
    finally:
        engine.dispose()


def register(root: Path, lab: str) -> list[str]:
    """Note a lab's cells in the course's gradebook; nbgrader needs them there before it grades.

    Returns:
        What was changed about a gradebook that has grades for other cells, as sentences.

    Raises:
        KitError: nbgrader refuses.
    """
    make_usable(root)
    if knows(root, lab):
        return []
    with tempfile.TemporaryDirectory() as folder:
        generate(root, lab, Path(folder), gradebook=True)
    from autograder.gradebook.released_notebook import FitCells

    told, FitCells.told[:] = list(FitCells.told), []
    return told
