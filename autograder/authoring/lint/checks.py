"""What can be read in the code of a lab's checks: syntax, names, expectations, parts and the score."""

from __future__ import annotations

import ast
import builtins
import difflib
import inspect
from collections.abc import Iterable, Iterator

from autograder.authoring.lint.finding import Finding
from autograder.checks.answers import Answers
from autograder.checks.building import Package
from autograder.checks.launch import Launch
from autograder.course.cells import parse
from autograder.course.lab import Cell, Lab

_BLOCKS = {"launch": Launch, "launch_file": Launch, "answers": Answers, "build": Package}
"""What `with launch(…) as ros` gives, by the function."""
_FULL_NAMES = {"topic", "node", "publisher", "service"}
"""Arguments of expectations and the like that are full names."""
_NAMES = {"expect_node", "expect_no_node", "expect_service", "call", "call_many", "send_goal", "serve", "requests"}
"""What takes a full name as `name`."""
_NO_FULL_NAMES = {"start", "expect_log"}
"""What takes something else as `node`."""
_WORDS = {
    ("expect_state", "state"): ("unconfigured", "inactive", "active", "finalized"),
    ("transition", "label"): ("configure", "activate", "deactivate", "cleanup", "shutdown"),
}
_OF_THE_NOTEBOOK = {"get_ipython", "display", "__name__", "__file__"}


def check_findings(lab: Lab) -> Iterator[Finding]:
    """Look through the trusted cells of a lab, and the programs that it gives and solves."""
    trees: list[tuple[Cell, ast.Module]] = []
    for cell in lab.cells:
        lines = ["" if line.startswith("%") else line for line in cell.source.split("\n")]
        try:
            trees.append((cell, ast.parse("\n".join(lines))))
        except SyntaxError as error:
            yield Finding(cell.grade_id, f"line {error.lineno}: {error.msg}.")
    known = {name for _, tree in trees for name in _bound(tree)} | set(dir(builtins)) | _OF_THE_NOTEBOOK
    for cell, tree in trees:
        sentences = [*_unknown_names(tree, known), *_unknown_expectations(tree)]
        sentences += _score(tree, cell.points) if cell.points is not None else []
        for sentence in sentences:
            yield Finding(cell.grade_id, sentence)
    yield from _programs(lab)


def _programs(lab: Lab) -> Iterator[Finding]:
    for answer in lab.answers.values():
        if answer.file is not None and answer.file.magic == "node":
            for text, whose in ((answer.solution, "the solution"), (answer.blank, "what students receive")):
                file = parse(text)
                try:
                    ast.parse(file.text if file else "")
                except SyntaxError as error:
                    yield Finding(answer.grade_id, f"{whose} is no Python, line {error.lineno}: {error.msg}.")


def _bound(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.id
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.alias):
            yield (node.asname or node.name).partition(".")[0]
        elif isinstance(node, ast.ExceptHandler) and node.name:
            yield node.name


def _unknown_names(tree: ast.AST, known: set[str]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in known:
            yield f"line {node.lineno}: nothing is called `{node.id}`{_nearest(node.id, known)}."


def _unknown_expectations(tree: ast.AST) -> Iterator[str]:
    """Methods and keywords that `ros`, `table` or `package` does not have."""
    names: dict[str, type] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.withitem) and isinstance(node.optional_vars, ast.Name):
            call = node.context_expr
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in _BLOCKS:
                names[node.optional_vars.id] = _BLOCKS[call.func.id]
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        owner = names.get(node.func.value.id) if isinstance(node.func.value, ast.Name) else None
        if owner is None:
            continue
        name, offered = node.func.attr, {one for one in dir(owner) if not one.startswith("_")}
        if name not in offered:
            yield f"line {node.lineno}: there is no `{name}`{_nearest(name, offered)}."
            continue
        parameters = inspect.signature(getattr(owner, name)).parameters
        yield from _wrong_words(node, name, parameters)
        if any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
            continue
        for keyword in node.keywords:
            if keyword.arg is not None and keyword.arg not in parameters:
                near = _nearest(keyword.arg, set(parameters))
                yield f"line {keyword.value.lineno}: `{name}` has no argument `{keyword.arg}`{near}."


def _wrong_words(call: ast.Call, name: str, parameters: Iterable[str]) -> Iterator[str]:
    """Names without their slash, and states and transitions that there are not, as far as they stand there as texts."""
    given = dict(zip(list(parameters)[1:], call.args, strict=False))
    given |= {keyword.arg: keyword.value for keyword in call.keywords if keyword.arg is not None}
    for argument, value in given.items():
        if not isinstance(value, ast.Constant) or not isinstance(value.value, str) or not value.value:
            continue
        full = (argument in _FULL_NAMES and name not in _NO_FULL_NAMES) or (argument == "name" and name in _NAMES)
        if full and not value.value.startswith("/"):
            yield f"line {value.lineno}: `{name}` takes full names, and `{value.value}` has no slash before it."
        known = _WORDS.get((name, argument), (value.value,))
        if value.value not in known:
            yield f"line {value.lineno}: `{name}` knows no `{value.value}`; it knows {', '.join(known)}."


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
        return  # computed while it runs, which shows whether it is right
    if abs(total - points) > 1e-6:
        yield f"line {call.lineno}: its score gives {total:g} points, and its metadata {points:g}."
    yield from _part_titles(tree, told if isinstance(told, dict) else {}, call.lineno)


def _part_titles(tree: ast.Module, worth: dict[str, float], score_line: int) -> Iterator[str]:
    """Parts that the score does not know, and parts of the score that are nowhere."""
    named: set[str] = set()
    # Each line of a table is a part.
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
        yield f'line {score_line}: the score gives points for "{title}", and no part is called so.'


def _is_call(node: ast.AST, method: str) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == method
