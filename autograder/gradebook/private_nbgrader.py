"""The private names of nbgrader that the kit uses, except for those in `grading/nbgrader_validate.py`.

`tests/gradebook/test_private_names.py` shows which of them an update of nbgrader has changed. pyproject.toml excludes
versions of nbgrader that have not been tested.
"""

from __future__ import annotations

import datetime
import functools
import json
from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

from alembic.script import ScriptDirectory
from nbgrader import api, utils
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.converters import Autograde
from nbgrader.converters.generate_solution import GenerateSolution
from nbgrader.dbutil import ALEMBIC_DIR
from nbgrader.exchange.default import ExchangeCollect
from nbgrader.nbgraderformat import common
from nbgrader.preprocessors import Execute, SaveAutoGrades, SaveCells

from autograder.gradebook.queries import engine_of
from autograder.grading.nbgrader_validate import Verdicts, replace_validator
from autograder.intake.entries import account_of

jsonschema: Any = common.jsonschema


def in_first_pass(autograde: Autograde) -> bool:
    """Return whether `nbgrader autograde` is in its first pass, which reads the submission.

    Its second pass reads the file that the first pass wrote.
    """
    return bool(autograde._sanitizing)


class CollectOwned(ExchangeCollect):  # type: ignore[misc]
    """Collects from nbgrader's exchange only what belongs to the account whose name it has.

    Every user of the machine can make a folder there, with any name. nbgrader warns of a foreign name and collects the
    folder nevertheless. If students have no accounts on this machine, everything is collected.
    """

    src_records: list[dict[str, Any]]
    _accounts = False
    """Whether students have accounts."""

    def _path_to_record(self, path: str) -> dict[str, Any]:
        name = Path(path).name
        try:
            record = super()._path_to_record(path)
        except (ValueError, OverflowError):  # anybody can write anything where the date belongs
            undated = datetime.datetime.min  # nbgrader compares it with the due date
            return {"username": name.partition("+")[0], "filename": name, "timestamp": undated, "account": None}
        account = account_of(Path(path))
        self._accounts |= account == record["username"]
        return {**record, "account": account}

    def _why_left_out(self, record: dict[str, Any]) -> str:
        if record["account"] is None:
            return "its name has no date that can be read"
        if self._accounts and record["account"] not in ("", record["username"]):
            return f"it belongs to the account {record['account']!r}"
        return ""

    def _sort_by_timestamp(self, records: list[dict[str, Any]]) -> list[dict[str, Any]]:
        kept = []
        for record in records:
            if why := self._why_left_out(record):
                self.log.warning("%r is left out: %s.", record["filename"], why)
            else:
                kept.append(record)
        return list(super()._sort_by_timestamp(kept)) or records

    def copy_files(self) -> None:
        """Copy the newest submission of each student."""
        self.src_records = [record for record in self.src_records if not self._why_left_out(record)]
        super().copy_files()


class SaveScores(SaveAutoGrades):  # type: ignore[misc]
    """nbgrader's stage that records points. Subclasses decide on the points and on whether a person has to grade.

    All cells of a notebook are recorded in one transaction. nbgrader itself needs about three for each cell.
    """

    def preprocess(self, nb: Any, resources: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Record the points of all cells."""
        told = resources["nbgrader"]
        self.notebook_id, self.assignment_id, self.student_id = (
            told[name] for name in ("notebook", "assignment", "student")
        )
        with Gradebook(told["db_url"]) as self.gradebook:
            commit, self.gradebook.db.commit = self.gradebook.db.commit, self.gradebook.db.flush
            self.before_cells(nb, resources)
            for index, cell in enumerate(nb.cells):
                nb.cells[index], resources = self.preprocess_cell(cell, resources, index)
            self.after_cells(resources)
            commit()
        return nb, resources

    @abstractmethod
    def before_cells(self, nb: Any, resources: dict[str, Any]) -> None:
        """Do what comes first in the transaction."""

    @abstractmethod
    def after_cells(self, resources: dict[str, Any]) -> None:
        """Do what comes last in the transaction."""

    @abstractmethod
    def score_check(self, grade: Any, resources: dict[str, Any]) -> None:
        """Set the points of a check cell in its grade."""

    @abstractmethod
    def needs_person(self, grade: Any, cell: Any, asked: bool) -> bool:
        """Return whether a person has to look at a cell.

        Args:
            grade: the cell's grade, which already has its points.
            cell: the cell.
            asked: whether a person already had to look at the cell before.
        """

    def _add_score(self, cell: Any, resources: dict[str, Any]) -> None:
        grade_id = cell.metadata["nbgrader"]["grade_id"]
        grade = self.gradebook.find_grade(grade_id, self.notebook_id, self.assignment_id, self.student_id)
        asked = bool(grade.needs_manual_grade)
        if utils.is_solution(cell) or cell.cell_type != "code":
            super()._add_score(cell, resources)
        else:
            self.score_check(grade, resources)
        grade.needs_manual_grade = self.needs_person(grade, cell, asked)


class SaveLabCells(SaveCells):  # type: ignore[misc]
    """nbgrader's stage that stores a lab's cells in the gradebook.

    nbgrader's own stage refuses to change the cells of a lab that has grades. This one lets a subclass change them.
    """

    @abstractmethod
    def fit(self, notebook: Any, new: dict[str, dict[str, Any]]) -> None:
        """Change the cells of a notebook that already has grades in the gradebook to those that the lab has now.

        Args:
            notebook: the notebook in the gradebook.
            new: what nbgrader stores for each cell, by kind (`grade`, `solution`, `task`, `source`) and name.
        """

    def _create_notebook(self, nb: Any) -> None:
        kinds = ("grade", "solution", "task", "source")
        new = {kind: getattr(self, f"new_{kind}_cells") for kind in kinds}
        try:
            notebook = self.gradebook.find_notebook(self.notebook_id, self.assignment_id)
        except MissingEntry:
            notebook = None
        if notebook is not None and notebook.submissions:
            self.fit(notebook, new)
        super()._create_notebook(nb)


def version_of_tables() -> str:
    """Return the version of the tables that nbgrader creates. nbgrader itself runs alembic, which takes a second.

    Raises:
        RuntimeError: nbgrader does not have exactly one newest version.
    """
    newest = ScriptDirectory(ALEMBIC_DIR).get_heads()
    if len(newest) != 1:
        raise RuntimeError(f"nbgrader's versions of tables end in {newest}")
    return str(newest[0])


def know_version_of_tables() -> None:
    """Make nbgrader find the version of the tables in this process when it creates a gradebook."""
    api.get_alembic_version = version_of_tables


def do_not_repeat() -> None:
    """Make nbgrader do some work once in this process that it otherwise does about ten times for each submission.

    For each connection to the gradebook it makes a new engine, which translates every query into SQL anew, and it looks
    for each table. For each cell that it validates, it validates the schema, too.
    """
    api.create_engine = engine_of
    create_all = api.Base.metadata.create_all

    def create_missing(bind: Any) -> None:
        if not set(api.Base.metadata.tables) <= set(api.inspect(bind).get_table_names()):
            create_all(bind=bind)

    if create_all.__qualname__ != create_missing.__qualname__:  # otherwise it has been replaced already
        api.Base.metadata.create_all = create_missing
    common.jsonschema = _CheckedSchemas


class _CheckedSchemas:
    """Takes the place of the module `jsonschema` for nbgrader's validation of cells."""

    @staticmethod
    def validate(instance: object, schema: object) -> None:
        """Do the same as `jsonschema.validate`, but check each schema only once."""
        error = jsonschema.exceptions.best_match(_validator(json.dumps(schema)).iter_errors(instance))
        if error is not None:
            raise error


@functools.cache
def _validator(schema: str) -> Any:
    read = json.loads(schema)
    kind = jsonschema.validators.validator_for(read)
    kind.check_schema(read)
    return kind(read)


def replace_execution(validate: Callable[[Path, bool], Verdicts], refuse: Callable[[], Exception]) -> None:
    """Replace nbgrader's validator and its stage that executes notebooks, in this process.

    nbgrader has no setting for either of them. Solutions may still be executed, because the instructor wrote them.

    Args:
        validate: a function that gets a notebook, and whether to return the cells that passed.
        refuse: a function that returns the error for every other execution.
    """
    execute = Execute.preprocess

    def preprocess(self: Any, nb: Any, resources: Any = None, km: Any = None) -> Any:
        if isinstance(self.parent, GenerateSolution):
            return execute(self, nb, resources, km)
        raise refuse()

    replace_validator(validate)
    if execute.__qualname__ != preprocess.__qualname__:  # otherwise it has been replaced already
        Execute.preprocess = preprocess
