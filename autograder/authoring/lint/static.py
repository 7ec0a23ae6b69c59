"""Find mistakes in a lab that can be found without running it."""

from __future__ import annotations

import ast
import builtins
import difflib
import inspect
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autograder.authoring import requirements
from autograder.authoring.lint.unset_names import bound, left_unset
from autograder.checks.answers import Answers
from autograder.checks.building import Package
from autograder.checks.launch import Launch
from autograder.checks.nouns import noun_given
from autograder.core.errors import KitError
from autograder.core.grades import in_points
from autograder.course.cells import (
    FOR_CHECKS,
    MARK,
    BadNameError,
    CellFile,
    for_checks,
    grade_id_of,
    nbgrader_of,
    parse,
    source_of,
)
from autograder.course.lab import Cell, Lab, lab_names, load_lab
from autograder.course.paths import CoursePaths
from autograder.course.settings import SETTINGS_FILE, read_book, read_settings
from autograder.grading.canaries import known_answers, wrong_answers
from autograder.reasons import all_kinds


@dataclass(frozen=True)
class Finding:
    """A mistake in a lab."""

    cell: str
    """The cell's grade_id, or its number if it has no grade_id; empty if the finding concerns the whole lab."""
    what: str
    """A sentence for the lab's author."""
    warning: bool = False
    """Whether the lab can be released in spite of the finding."""

    def __str__(self) -> str:
        """Return the finding as a line of text."""
        place = f"cell `{self.cell}`: " if self.cell else ""
        return f"{'warning' if self.warning else 'error'}: {place}{self.what}"


def metadata_findings(cells: list[dict[str, Any]]) -> Iterator[Finding]:
    """Find mistakes in the metadata of a lab's cells, and in the markers of solutions and hidden tests."""
    ids = Counter(cell.get("id") for cell in cells)
    grade_ids = Counter(grade_id_of(cell) for cell in cells if nbgrader_of(cell))
    for number, cell in enumerate(cells, start=1):
        name = grade_id_of(cell) or str(number)
        if cell.get("id") and ids[cell["id"]] > 1:
            yield Finding(name, f"another cell also has the id `{cell['id']}`.")
        for sentence in (*_markers(source_of(cell)), *_outside(cell)):
            yield Finding(name, sentence)
        if nbgrader_of(cell):
            if grade_ids[grade_id_of(cell)] > 1 and grade_id_of(cell):
                yield Finding(name, "another cell has the same grade_id.")
            for sentence in (*_marks(nbgrader_of(cell), cell["cell_type"]), *_answer(cell)):
                yield Finding(name, sentence)
            if _is_check(cell) and not _says_something(cells[number - 2] if number > 1 else {}):
                yield Finding(name, "students see it folded, and no sentence above says what it checks.", warning=True)


def _is_check(cell: dict[str, Any]) -> bool:
    marks = nbgrader_of(cell)
    return bool(marks.get("grade")) and not marks.get("solution") and cell["cell_type"] == "code"


def _says_something(cell: dict[str, Any]) -> bool:
    """Return whether a cell is text whose last line is not a heading."""
    lines = source_of(cell).strip().splitlines() if cell.get("cell_type") == "markdown" else []
    return bool(lines) and not lines[-1].startswith("#")


def _marks(marks: dict[str, Any], kind: str) -> Iterator[str]:
    if not re.fullmatch(r"[A-Za-z0-9_-]+", str(marks.get("grade_id", ""))):
        yield "its grade_id must be letters, digits, `_` and `-`."
    if marks.get("schema_version") != 3:
        yield "its nbgrader metadata needs the schema_version 3."
    if marks.get("grade"):
        points = marks.get("points")
        if isinstance(points, bool) or not isinstance(points, (int, float)) or not points > 0:
            yield f"a graded cell needs points above 0, but it has {points!r}."
        if kind == "code" and not marks.get("solution") and not marks.get("locked"):
            yield "a check must be locked, because otherwise students could change it."
        if kind == "code" and marks.get("solution"):
            yield "it must not have points of its own, because students' code gets its points from a check below it."
    elif "points" in marks:
        yield "it has points, but is not graded."
    if marks.get("solution") and marks.get("locked"):
        yield "students have to fill it in, but it is locked."


def _answer(cell: dict[str, Any]) -> Iterator[str]:
    if cell["cell_type"] != "code" or not nbgrader_of(cell).get("solution"):
        return
    try:
        if parse(source_of(cell)) is None:
            yield "students fill it in, so its first line must be `%%node NAME` or `%%file NAME`."
    except BadNameError as error:
        yield str(error)


def _outside(cell: dict[str, Any]) -> Iterator[str]:
    """Yield sentences about markers that nothing removes, and a tag without effect, because of the kind of the cell."""
    marks = nbgrader_of(cell)
    if for_checks(cell) and (not marks.get("locked") or marks.get("grade") or marks.get("solution")):
        yield f"it has the tag `{FOR_CHECKS}`, so it must be locked and neither a check nor an answer."
    found = {match[2] for match in MARK.finditer(source_of(cell))}
    if "SOLUTION" in found and not marks.get("solution"):
        yield "it contains a solution, but students do not fill it in, so they would receive the solution."
    if "HIDDEN TESTS" in found and not _is_check(cell):
        yield "it contains hidden tests, but it is not a check."


def _markers(source: str) -> Iterator[str]:
    is_open: dict[str, int] = {}
    for number, line in enumerate(source.split("\n"), start=1):
        for which, mark in MARK.findall(line):
            if which == "BEGIN" and mark in is_open:
                yield f"line {number}: `BEGIN {mark}` is inside the one that begins in line {is_open[mark]}."
            elif which == "END" and mark not in is_open:
                yield f"line {number}: `END {mark}` has no `BEGIN {mark}` above it."
            if which == "BEGIN":
                is_open[mark] = number
            else:
                is_open.pop(mark, None)
    for mark, number in is_open.items():
        yield f"line {number}: `BEGIN {mark}` has no `END {mark}` below it."


_BLOCKS = {"launch": Launch, "launch_file": Launch, "answers": Answers, "build": Package}
"""The class of the object that a `with` statement such as `with launch(…) as ros` binds, by the function's name."""
_FULL_NAMES = {"topic", "node", "publisher", "nodes"}
"""The arguments of nouns and expectations that are full names."""
_NAMES = {"topic", "publisher", "node", "service", "server", "action"}
"""The methods whose argument `name` is a full name."""
_NO_FULL_NAMES = {"start"}
"""The methods whose argument `node` is not a full name."""
_WORDS = {
    ("expect_state", "state"): ("unconfigured", "inactive", "active", "finalized"),
    ("transition", "label"): ("configure", "activate", "deactivate", "cleanup", "shutdown"),
}
_OF_THE_NOTEBOOK = {"get_ipython", "display", "__name__", "__file__"}


def check_findings(lab: Lab) -> Iterator[Finding]:
    """Find mistakes in the trusted cells of a lab, and in the programs of its solutions and of its blank answers."""
    trees: list[tuple[Cell, ast.Module]] = []
    for cell in lab.cells:
        lines = ["" if line.startswith("%") else line for line in cell.source.split("\n")]
        try:
            trees.append((cell, ast.parse("\n".join(lines))))
        except SyntaxError as error:
            yield Finding(cell.grade_id, f"line {error.lineno}: {error.msg}.")
    known = {name for _, tree in trees for name in bound(tree)} | set(dir(builtins)) | _OF_THE_NOTEBOOK
    programs = {file.name for cell in lab.raw["cells"] if (file := _file(cell)) is not None and file.magic == "node"}
    for cell, tree in trees:
        sentences = [*_unknown_names(tree, known), *_unknown_expectations(tree), *_unknown_programs(tree, programs)]
        sentences += [*_score(tree, cell.points), *left_unset(tree.body, set())] if cell.points is not None else []
        for sentence in sentences:
            yield Finding(cell.grade_id, sentence)
    yield from _programs(lab)


def _file(cell: dict[str, Any]) -> CellFile | None:
    try:
        return parse(source_of(cell)) if cell["cell_type"] == "code" else None
    except BadNameError:
        return None  # it has its own finding


def _unknown_programs(tree: ast.AST, programs: set[str]) -> Iterator[str]:
    """Yield sentences about programs that are launched by a name for which the lab has no cell."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            continue
        if any(keyword.arg in (None, "package") for keyword in node.keywords):
            continue  # a student's package makes the program, or only the run shows the keywords
        names = {"launch": node.args, "Program": node.args[:1]}.get(node.func.id, [])
        for name in names:
            if isinstance(name, ast.Constant) and isinstance(name.value, str) and name.value not in programs:
                near = _nearest(name.value, programs)
                yield f"line {name.lineno}: the lab has no cell `%%node {name.value}`{near}."


def _programs(lab: Lab) -> Iterator[Finding]:
    for answer in lab.answers.values():
        if answer.file is not None and answer.file.magic == "node":
            for text, whose in ((answer.solution, "the solution"), (answer.blank, "what students receive")):
                file = parse(text)
                try:
                    ast.parse(file.text if file else "")
                except SyntaxError as error:
                    yield Finding(answer.grade_id, f"{whose} is not valid Python, line {error.lineno}: {error.msg}.")


def _unknown_names(tree: ast.AST, known: set[str]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in known:
            yield f"line {node.lineno}: the name `{node.id}` is not defined{_nearest(node.id, known)}."


def _unknown_expectations(tree: ast.AST) -> Iterator[str]:
    """Yield sentences about methods and keywords that `ros` and its nouns, `table` or `package` do not have."""
    names = _nouns_of(tree)
    for node in ast.walk(tree):
        if not isinstance(node, ast.Attribute):
            continue
        owner = _noun_of(node.value, names)
        offered = {one for one in dir(owner) if not one.startswith("_")} if owner is not None else set()
        if owner is not None and node.attr not in offered and not _is_field(owner, node.attr):
            yield f"line {node.lineno}: there is no `{node.attr}`{_nearest(node.attr, offered)}."
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        owner, name = _noun_of(node.func.value, names), node.func.attr
        if owner is None or not inspect.isroutine(getattr(owner, name, None)):
            continue
        parameters = inspect.signature(getattr(owner, name)).parameters
        yield from _wrong_words(node, name, parameters)
        if any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
            continue
        for keyword in node.keywords:
            if keyword.arg is not None and keyword.arg not in parameters:
                near = _nearest(keyword.arg, set(parameters))
                yield f"line {keyword.value.lineno}: `{name}` has no argument `{keyword.arg}`{near}."


def _nouns_of(tree: ast.AST) -> dict[str, type]:
    """Return the class of each name in a cell that refers to a noun.

    Such a name is `ros` in a `with` statement or a function, or is assigned from another such name.
    """
    names: dict[str, type] = {
        node.arg: Launch for node in ast.walk(tree) if isinstance(node, ast.arg) and node.arg == "ros"
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.withitem) and isinstance(node.optional_vars, ast.Name):
            call = node.context_expr
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in _BLOCKS:
                names[node.optional_vars.id] = _BLOCKS[call.func.id]
    values: dict[str, list[ast.expr]] = {}
    for name, value in _assigned(tree):
        values.setdefault(name, []).append(value)
    # A name that is also bound in another way, by a loop or as an argument, may be another object there.
    times = Counter(bound(tree))
    for name, of in values.items():
        nouns = {_noun_of(value, names) for value in of}
        noun = nouns.pop() if len(nouns) == 1 and times[name] == len(of) else None
        if noun is not None:
            names[name] = noun
    return names


def _assigned(tree: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Yield each name that is assigned to, with its value: `a = …`, and `a, b = …, …`."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=False))
            else:
                pairs = [(target, node.value)]
            yield from ((one.id, value) for one, value in pairs if isinstance(one, ast.Name))


def _noun_of(value: ast.expr, names: Mapping[str, type]) -> type | None:
    """Return the class of the noun that an expression gives; None if this is not known without running it."""
    if isinstance(value, ast.Name):
        return names.get(value.id)
    if isinstance(value, ast.Call):
        value = value.func
    owner = _noun_of(value.value, names) if isinstance(value, ast.Attribute) else None
    return noun_given(owner, value.attr) if owner is not None and isinstance(value, ast.Attribute) else None


def _is_field(owner: type, name: str) -> bool:
    """Return whether the objects of a class get this attribute when they are created."""
    return any(name in getattr(one, "__annotations__", {}) for one in owner.__mro__) or name == "name"


def _wrong_words(call: ast.Call, name: str, parameters: Iterable[str]) -> Iterator[str]:
    """Yield sentences about string arguments that are full names without a slash, or unknown states and transitions."""
    given = dict(zip(list(parameters)[1:], call.args, strict=False))
    given |= {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg is not None}
    for argument, value in given.items():
        if not isinstance(value, ast.Constant) or not isinstance(value.value, str) or not value.value:
            continue
        full = (argument in _FULL_NAMES and name not in _NO_FULL_NAMES) or (argument == "name" and name in _NAMES)
        if full and not value.value.startswith("/"):
            yield f"line {value.lineno}: `{name}` takes full names, but `{value.value}` does not begin with a slash."
        known = _WORDS.get((name, argument), (value.value,))
        if value.value not in known:
            yield f"line {value.lineno}: `{name}` does not know `{value.value}`; it knows {', '.join(known)}."


def _nearest(name: str, known: set[str]) -> str:
    near = difflib.get_close_matches(name, known, 1)
    return f"; `{near[0]}` may be meant" if near else ""


def _score(tree: ast.Module, points: float) -> Iterator[str]:
    scores = [node for node in ast.walk(tree) if _is_call(node, "score")]
    last = tree.body[-1] if tree.body else None
    if not scores:
        yield f"it has no score; its last line must be `ros.score({points:g})`."
        return
    if len(scores) > 1 or not isinstance(last, ast.Expr) or last.value is not scores[0]:
        yield "its score must be the last line of the cell, and the only one."
        return
    call = scores[0]
    assert isinstance(call, ast.Call)
    try:
        told = ast.literal_eval(call.args[0])
        total = sum(told.values()) if isinstance(told, dict) else float(told)
    except (ValueError, TypeError, IndexError):
        return  # the points are computed when the check runs, which shows whether they are right
    if abs(total - points) > 1e-6:
        yield f"line {call.lineno}: its score gives {in_points(total)}, but its metadata {points:g}."
    yield from _part_titles(tree, told if isinstance(told, dict) else {}, call.lineno)


def _part_titles(tree: ast.Module, worth: dict[str, float], score_line: int) -> Iterator[str]:
    """Yield sentences about parts that the score does not contain, and parts of the score that do not exist."""
    named: set[str] = set()
    # In a table of answers, each line is a part.
    computed = any(isinstance(node, ast.Name) and node.id == "answers" for node in ast.walk(tree))
    for node in ast.walk(tree):
        if not _is_call(node, "part") or not isinstance(node, ast.Call) or not node.args:
            continue
        if not isinstance(node.args[0], ast.Constant):
            computed = True
            continue
        title = str(node.args[0].value)
        named.add(title)
        if title not in worth:
            yield f'line {node.lineno}: the score gives no points for the part "{title}".'
    for title in worth.keys() - named if not computed else ():
        yield f'line {score_line}: the score gives points for "{title}", but there is no such part.'


def _is_call(node: ast.AST, method: str) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == method


def course_findings(root: Path) -> list[Finding]:
    """Return the mistakes in the course's settings: labs and codes of reasons that are listed but do not exist."""
    names = lab_names(root)
    settings = read_settings(root)
    missing = [name for name in settings.labs if name not in names]
    found = [Finding("", f"{SETTINGS_FILE} lists the lab `{name}`, which does not exist.") for name in missing]
    found += [
        Finding("", f"{SETTINGS_FILE} gives a weight to the lab `{name}`, which does not exist.")
        for name in settings.weights
        if name not in names
    ]
    explained = read_book(root).sections
    if explained:
        checks = "".join(cell.source for name in names for cell in load_lab(root, name).cells)
        known = all_kinds().keys() | set(re.findall(r"""code=["']([a-z-]+)""", checks))
        unknown = [f"explains the reason `{code}`, which no check gives" for code in explained if code not in known]
        found += [Finding("", f"{SETTINGS_FILE} {sentence}.") for sentence in unknown]
    return found


def read_findings(root: Path, name: str) -> list[Finding]:
    """Read a lab's source, and return the mistakes in it.

    Raises:
        KitError: there is no such lab under `solutions`.
    """
    notebook = CoursePaths(root).solutions / name / f"{name}.ipynb"
    try:
        cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    except FileNotFoundError as error:
        raise KitError(f"There is no solutions/{name}/{name}.ipynb.", "Name a folder under `solutions`.") from error
    except (ValueError, KeyError, TypeError) as error:
        return [Finding("", f"{notebook.name} is not a notebook: {error}.")]
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
        yield Finding("", f"there is no {path}, so it is not known whether every requirement is checked.", warning=True)
        return
    told = requirements.read(path)
    known = {check.grade_id for check in lab.checks}
    for one in told.required:
        if one.check not in known:
            yield Finding("", f"{path.name} names the check `{one.check}`, which the lab does not have.", warning=True)
    for text in told.strangers(lab):
        yield Finding("", f"{path.name}: these words are not in the lab: {text}", warning=True)
    for text in told.uncovered(lab):
        yield Finding(
            "",
            f"{path.name} lists this sentence neither as required nor as not required: {text}",
            warning=True,
        )
    for check in told.unheld(lab):
        yield Finding(check, "no requirement names this check.", warning=True)


def release_findings(files: dict[Path, bytes]) -> list[Finding]:
    """Search the files of a release for text that students must not receive."""
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
