"""The contract with nbgrader: names that it may change without notice are still as the kit needs them.

A failure here names what an update has moved, and where the kit uses it.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from places import ROOT

from autograder.gradebook.own_courses import prepare_nbgrader

prepare_nbgrader()

import nbgrader  # noqa: E402
from nbgrader.converters import Autograde  # noqa: E402
from nbgrader.exchange.default import ExchangeCollect  # noqa: E402
from nbgrader.nbgraderformat import MetadataValidator, common  # noqa: E402
from nbgrader.preprocessors import Execute, SaveAutoGrades  # noqa: E402
from nbgrader.validator import Validator  # noqa: E402

from autograder.gradebook import private_nbgrader  # noqa: E402

GRADEBOOK = ROOT / "autograder" / "gradebook"
OTHERS = [path for path in sorted(GRADEBOOK.glob("*.py")) if not path.name.startswith("private_")]

USED = [
    (Autograde, "_sanitizing", None, "tells the first pass of `nbgrader autograde` from the second"),
    (SaveAutoGrades, "_add_score", ["self", "cell", "resources"], "records a cell's points"),
    (Execute, "preprocess", ["self", "nb", "resources", "km"], "executes notebooks, which the kit closes"),
    (Validator, "validate", ["self", "filename"], "is nbgrader's validation, which the kit replaces"),
    (ExchangeCollect, "_path_to_record", ["self", "path"], "reads the name of a submission in the exchange"),
    (ExchangeCollect, "_sort_by_timestamp", ["self", "records"], "finds a student's newest submission"),
    (Validator, "invert", None, "asks for what passed"),
]


@pytest.mark.parametrize(("owner", "name", "arguments", "use"), USED, ids=lambda value: getattr(value, "__name__", ""))
def test_a_name_that_the_kit_relies_on_is_as_it_was(
    owner: type, name: str, arguments: list[str] | None, use: str
) -> None:
    library = owner.__module__.partition(".")[0]
    versions = {"nbgrader": nbgrader.__version__}
    said = (
        f"{library} {versions[library]} has moved {owner.__name__}.{name}, which {use}."
        f" Adapt autograder/gradebook/private_{library}.py, or keep pyproject.toml's bound."
    )
    assert hasattr(owner, name), said
    if arguments is not None:
        found = list(inspect.signature(inspect.unwrap(getattr(owner, name))).parameters)
        assert found == arguments, f"{said} Its arguments are {found}, and were {arguments}."


def test_nbgrader_asks_for_the_version_of_its_tables_where_the_kit_answers() -> None:
    assert "alembic_version = get_alembic_version()" in inspect.getsource(nbgrader.api.Gradebook.__init__)
    newest = Path(private_nbgrader.ALEMBIC_DIR, "versions").glob(f"{private_nbgrader.version_of_tables()}_*.py")
    assert len(list(newest)) == 1


@pytest.mark.parametrize(
    ("code", "call"),
    [
        (nbgrader.api.Gradebook.__init__, "create_engine(db_url, echo=False, future=True)"),
        (nbgrader.api.Gradebook.__init__, "Base.metadata.create_all(bind=self.engine)"),
        (nbgrader.api.Gradebook.close, "self.engine.dispose()"),
        (common.BaseMetadataValidator.validate_cell, "jsonschema.validate(cell.metadata['nbgrader'], self.schema)"),
        (SaveAutoGrades._add_comment, "self.gradebook.db.commit()"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_nbgrader_repeats_its_work_where_the_kit_does_it_once(code: Callable[..., object], call: str) -> None:
    assert call in inspect.getsource(code)


def test_a_cell_that_does_not_fit_its_schema_is_still_refused() -> None:
    private_nbgrader.do_not_repeat()
    cell = {"schema_version": 3, "grade": True, "locked": True, "solution": False, "points": "many", "grade_id": "one"}
    for _ in range(2):
        with pytest.raises(common.ValidationError, match="many"):
            MetadataValidator().validate_cell(nbformat.v4.new_code_cell(metadata={"nbgrader": cell}))


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.stem)
def test_private_names_of_libraries_stand_in_their_modules(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    own = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and ast.unparse(node.value) == "self"
    } | {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    used = {
        f"line {node.lineno}: {ast.unparse(node)}"
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and node.attr.startswith("_") and not node.attr.startswith("__") and node.attr not in own
    }  # fmt: skip
    assert used == set(), f"{path.name} uses what belongs into private_nbgrader.py"
