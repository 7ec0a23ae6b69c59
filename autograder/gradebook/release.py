"""Generate the version of a lab that students receive, and register a lab's cells in the gradebook."""

from __future__ import annotations

import tempfile
from pathlib import Path

from autograder.core.errors import GRADEBOOK_REFUSED, KitError
from autograder.course.lab import load_lab
from autograder.course.versions import remember
from autograder.gradebook.api import answered, last_error, open_api
from autograder.gradebook.database import make_usable
from autograder.gradebook.settings import gradebook_address


def generate(root: Path, lab: str, into: Path, gradebook: bool) -> Path:
    """Generate the version of a lab that students receive.

    Args:
        root: the course's folder.
        lab: the lab.
        into: the folder in which the lab's folder is created.
        gradebook: whether to register the lab's cells in the course's gradebook.

    Returns:
        The folder of the generated lab.

    Raises:
        KitError: nbgrader could not generate the lab.
    """
    api = open_api(root, gradebook, release_directory=str(into))
    answer = answered(api.generate_assignment(lab, force=True, create=True))
    if not answer["success"]:
        why = last_error(answer)
        raise KitError(f"nbgrader could not generate {lab}: {why}.", GRADEBOOK_REFUSED * ("OperationalError" in why))
    return into / lab


def released_files(root: Path, lab: str) -> dict[Path, bytes]:
    """Return the files of a lab that students receive, by path below `labs/<lab>`. Equal sources give equal files.

    Raises:
        KitError: there is no such lab under `solutions`, or nbgrader could not generate it.
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
    """Return whether the gradebook has the current cells of a lab."""
    from sqlalchemy import create_engine

    from autograder.gradebook.own_tables import THE_LAB, recorded

    engine = create_engine(gradebook_address(root))
    try:
        with engine.connect() as connection:
            return recorded(connection, lab).get(THE_LAB) == load_lab(root, lab).source_digest
    finally:
        engine.dispose()


def register(root: Path, lab: str) -> list[str]:
    """Register a lab's cells in the course's gradebook, where nbgrader needs them before it grades.

    Returns:
        Sentences about changes, if the gradebook has grades for other cells.

    Raises:
        KitError: the gradebook cannot be used, or nbgrader could not generate the lab.
    """
    make_usable(root)
    remember(root, lab, load_lab(root, lab).released)
    if knows(root, lab):
        return []
    with tempfile.TemporaryDirectory() as folder:
        generate(root, lab, Path(folder), gradebook=True)
    from autograder.gradebook.released_notebook import FitCells

    told, FitCells.told[:] = list(FitCells.told), []
    return told
