"""Stage B: hands the results to nbgrader, one after another, and writes gradebook, feedback and the table of grades."""

from __future__ import annotations

import csv
import io
import logging
import math
import os
import re
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

from autograder.errors import KitError
from autograder.files import write_beside
from autograder.grading.stage_a import result_path
from autograder.submission.lab import Lab


def prepare_nbgrader() -> None:
    """Make nbgrader importable at a bearable price, and able to find its database tool."""
    # Without this module jsonschema does not check one format of strings; with it, building its grammar takes 3 s.
    sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]
    os.environ["TRAITLETS_APPLICATION_RAISE_CONFIG_FILE_ERROR"] = "1"
    # nbgrader runs `alembic` by name.
    tools = str(Path(sys.executable).parent)
    if tools not in os.environ.get("PATH", "").split(os.pathsep):
        os.environ["PATH"] = tools + os.pathsep + os.environ.get("PATH", "")


def _api(root: Path, gradebook: bool = True, **directories: Any) -> Any:
    """Return nbgrader's API with the course's stages.

    Args:
        root: of the course.
        gradebook: False generates labs without noting them in it.
        directories: settings of nbgrader's CourseDirectory to replace.
    """
    prepare_nbgrader()
    from nbgrader.apps import NbGraderAPI
    from nbgrader.coursedir import CourseDirectory
    from traitlets.config import Config

    from autograder.grading.stages import configure, leave_gradebook_alone

    config = Config()
    configure(config, root)
    if not gradebook:
        leave_gradebook_alone(config)
    config.NbGraderAPI.log_level = logging.ERROR
    # What nbgrader logs is read from its answers; it shall not also go to the terminal.
    logging.getLogger("traitlets").addHandler(logging.NullHandler())
    warnings.filterwarnings("ignore", module=r"nbgrader\.api")
    config.CourseDirectory.merge(directories)
    (root / "build").mkdir(exist_ok=True)
    return NbGraderAPI(CourseDirectory(config=config), config=config)


def generate(root: Path, lab: str, into: Path, gradebook: bool) -> Path:
    """Generate what students receive of a lab, and note its cells in the course's gradebook if asked to.

    Returns:
        The folder of the generated lab.

    Raises:
        KitError: nbgrader refuses.
    """
    api = _api(root, gradebook, release_directory=str(into), ignore=_NOT_RELEASED)
    answer = _answered(api.generate_assignment(lab, force=True, create=True))
    if not answer["success"]:
        if "there are submissions associated" in answer.get("log", "") + answer["error"]:
            raise KitError(
                f"The graded cells of {lab} are not those that build/gradebook.db has grades for.",
                f"Move {root / 'build' / 'gradebook.db'} away, then grade again.",
            )
        raise KitError(f"nbgrader could not generate {lab}.", _last_error(answer))
    return into / lab


_NOT_RELEASED = [".ipynb_checkpoints", "*.pyc", "__pycache__", ".*", "nodes"]
"""Files beside a lab's source that are not part of it."""


def _last_error(answer: dict[str, Any]) -> str:
    """The last telling line of what nbgrader logged."""
    text = str(answer.get("log", "")) + "\n" + str(answer.get("error", ""))
    lines: list[str] = [
        line.strip() for line in text.splitlines() if re.match(r"\s*[\w.]*(Error|Exception|Entry)\b: ", line)
    ]
    telling = [line for line in lines if "NbGraderException" not in line]
    return (telling or lines or ["no reason given"])[-1]


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


def release(root: Path, lab: str) -> Path:
    """Write `labs/<lab>` and return that folder.

    Raises:
        KitError: there is no such lab under `solutions`, or nbgrader refuses.
    """
    for path, content in released_files(root, lab).items():
        write_beside(root / "labs" / lab / path, content)
    return root / "labs" / lab


def register(root: Path, lab: str) -> None:
    """Note a lab's cells in the course's gradebook; nbgrader needs them there before it grades.

    Raises:
        KitError: the gradebook has grades for other cells.
    """
    with tempfile.TemporaryDirectory() as folder:
        generate(root, lab, Path(folder), gradebook=True)


def before_autograde(root: Path, assignment: str, student: str, notebooks: list[str]) -> None:
    """nbgrader's hook: note the lab's cells when `nbgrader autograde` meets a gradebook without them."""
    from nbgrader.api import Gradebook, MissingEntry

    with Gradebook(f"sqlite:///{root / 'build' / 'gradebook.db'}") as gradebook:
        try:
            gradebook.find_notebook(assignment, assignment)
        except MissingEntry:
            known = False
        else:
            known = True
    if not known:
        register(root, assignment)


class Recorder:
    """Records results in the gradebook and writes feedback, one student at a time, for those that changed."""

    def __init__(self, root: Path, lab: Lab, force: bool) -> None:
        """Look at what is recorded already; nothing is loaded or written before something is to be.

        Args:
            root: of the course.
            lab: whose results are recorded.
            force: record also what did not change.
        """
        self._root, self._lab, self._force = root, lab, force
        self._api: Any = None
        self._written: list[Path] = []
        self.failures: dict[str, str] = {}
        """Why it failed, by student; the others are recorded."""
        if not (root / "build" / "gradebook.db").exists():
            # What was recorded went with the gradebook.
            shutil.rmtree(root / "build" / "autograded", ignore_errors=True)
        self._last_grade = _modified(root / "build" / "gradebook.db")

    def __enter__(self) -> Recorder:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Note that the feedback knows the gradebook as it is now, also when the rest of the class was given up."""
        for path in self._written:
            os.utime(path)

    def record(self, student: str) -> None:
        """Record one student's result.

        Raises:
            KitError: the gradebook has grades for other cells.
            KeyboardInterrupt: the student counts as not recorded.
        """
        feedback = _feedback(self._root, self._lab, student)
        steps = self._due(student)
        if steps and self._api is None:
            register(self._root, self._lab.name)
            self._api = _api(self._root)
        if steps:
            feedback.unlink(missing_ok=True)
        for step in steps:
            answer = _answered(getattr(self._api, step)(self._lab.name, student, force=True))
            if not answer["success"]:
                self.failures[student] = _last_error(answer)
                return
        self._written.append(feedback)

    def _due(self, student: str) -> list[str]:
        """The steps of nbgrader's that a student needs; none if neither the result nor a grade changed."""
        recorded = self._root / "build" / "autograded" / student / self._lab.name / f"{self._lab.name}.ipynb"
        result = result_path(self._root, self._lab.name, student)
        if self._force or _modified(recorded) < max(_modified(result), _modified(self._lab.notebook)):
            return ["autograde", "generate_feedback"]
        # The gradebook was younger than the feedback where somebody graded by hand since.
        stale = _modified(_feedback(self._root, self._lab, student)) < self._last_grade
        return ["generate_feedback"] if stale else []


def _answered(answer: dict[str, Any]) -> dict[str, Any]:
    """Return nbgrader's answer. It catches even what Ctrl-C raises; that goes on here."""
    if "KeyboardInterrupt" in str(answer.get("error", "")):
        raise KeyboardInterrupt
    return answer


def _feedback(root: Path, lab: Lab, student: str) -> Path:
    return root / "build" / "feedback" / student / lab.name / f"{lab.name}.html"


def _modified(path: Path) -> float:
    """When a file was last written; before all time if it is not there."""
    try:
        return path.stat().st_mtime
    except OSError:
        return -math.inf


def write_grades(root: Path) -> Path:
    """Write `build/grades.csv` from the gradebook and return its path.

    A row for each student and lab. The score stays empty as long as a check waits for an instructor's verdict.
    `waiting` counts the cells that a person has yet to grade: those checks, and explanations, which count 0 until then.
    """
    path = root / "build" / "grades.csv"
    if _modified(path) > _modified(root / "build" / "gradebook.db"):
        return path
    prepare_nbgrader()
    from nbgrader.api import Gradebook

    rows: list[tuple[str, str, str, str, int]] = []
    with Gradebook(f"sqlite:///{root / 'build' / 'gradebook.db'}") as gradebook:
        for assignment in gradebook.assignments:
            answers = {cell.name for notebook in assignment.notebooks for cell in notebook.solution_cells}
            for submission in assignment.submissions:
                grades = [grade for notebook in submission.notebooks for grade in notebook.grades]
                waiting = [grade.name for grade in grades if grade.auto_score is None and grade.manual_score is None]
                score = "" if set(waiting) - answers else f"{sum(grade.score for grade in grades):g}"
                top = f"{sum(grade.max_score for grade in grades):g}"
                rows.append((submission.student_id, assignment.name, score, top, len(waiting)))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("student", "lab", "score", "max_score", "waiting"))
    writer.writerows(sorted(rows))
    write_beside(path, text.getvalue())
    return path
