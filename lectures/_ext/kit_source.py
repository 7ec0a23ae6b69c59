"""Reads the kit's source for the reference pages: which reason is given where, and which function calls which."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
KIT = ROOT / "autograder"

_CODE = re.compile(r"(CPU-)?[a-z]+(-[a-z]+)*")
_POSITIONS = {
    "Diagnosis": (0, 1, 2), "CommandLineError": (0, 1, 2), "StudentFileError": (0, 1, 2), "problem": (2, 0, 3),
    "_error": (3, 4, 5),
    "undecided": (1, 3, 4),
}  # fmt: skip
"""Where the sentence, the code and the hint stand in calls that give them by position."""
_RULES = ("rule_effect.py", "remap_rules.py", "traces.py")
"""Modules that give a reason as a tuple of three."""


@dataclass
class Use:
    """A place in the source that gives a reason."""

    code: str
    """`*` stands for what is filled in when it is given."""
    because: str
    hint: str
    path: Path
    function: str


def uses() -> list[Use]:
    """Every reason that the package gives, in the order of its files."""
    return [use for path in sorted(KIT.rglob("*.py")) for use in _uses_in(path)]


def codes_used() -> set[str]:
    """Every code that the package gives; `*` stands for a word that is filled in."""
    return {use.code for use in uses()}


@cache
def parsed(path: Path) -> ast.Module:
    """A module's syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"))


def _uses_in(path: Path) -> Iterator[Use]:
    tree = parsed(path)
    names = {
        node.targets[0].id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    }
    for function, node in _with_function(tree):
        because, code, hint = _reason(node, path.name in _RULES)
        for word in _words(code, names):
            yield Use(word, _sentence(because), _sentence(hint), path, function)


def _with_function(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Every node of a module with the name of the function that it stands in."""
    stack: list[tuple[str, ast.AST]] = [("", tree)]
    while stack:
        function, node = stack.pop()
        yield function, node
        inner = node.name if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) else function
        stack += [(inner, child) for child in reversed(list(ast.iter_child_nodes(node)))]


def _reason(node: ast.AST, tuples: bool) -> tuple[ast.expr | None, ast.expr | None, ast.expr | None]:
    """The sentence, the code and the hint that a call carries, or a tuple of three, or a parameter's default."""
    if isinstance(node, ast.arguments):
        pairs = zip(reversed([*node.posonlyargs, *node.args]), reversed(node.defaults), strict=False)
        return None, next((value for argument, value in pairs if argument.arg == "code"), None), None
    if isinstance(node, ast.Call):
        keywords = {keyword.arg: keyword.value for keyword in node.keywords}
        called = getattr(node.func, "id", getattr(node.func, "attr", ""))
        at = dict(enumerate(node.args))
        by_position = [at.get(place) for place in _POSITIONS.get(called, ())] or [None, None, None]
        because, code, hint = by_position
        return keywords.get("because", because), keywords.get("code", code), keywords.get("hint", hint)
    if tuples and isinstance(node, ast.Tuple) and len(node.elts) == 3:
        first, code, hint = node.elts
        words = isinstance(first, ast.Constant) and not str(first.value).endswith(".")  # that a traceback is known by
        return None if words else first, code, hint
    return None, None, None


def _words(code: ast.expr | None, names: dict[str, str]) -> list[str]:
    """The codes that an expression can give, as far as its text tells."""
    if code is None:
        return []
    if isinstance(code, ast.Constant):
        return [code.value] if isinstance(code.value, str) and _CODE.fullmatch(code.value) else []
    if isinstance(code, ast.JoinedStr):
        return ["".join(str(part.value) if isinstance(part, ast.Constant) else "*" for part in code.values)]
    if isinstance(code, ast.IfExp):
        return _words(code.body, names) + _words(code.orelse, names)
    if isinstance(code, ast.BoolOp):
        return [word for value in code.values for word in _words(value, names)]
    if isinstance(code, ast.Name):
        return [names[code.id]] if code.id in names else []
    return []


def _sentence(text: ast.expr | None) -> str:
    """The text of a string with an ellipsis where something is filled in; empty where it comes from elsewhere."""
    if isinstance(text, ast.Constant) and isinstance(text.value, str):
        return text.value
    if isinstance(text, ast.JoinedStr):
        return re.sub(r"…(\s*…)+", "…", "".join(_sentence(part) or "…" for part in text.values)).strip()
    if isinstance(text, ast.BinOp) and isinstance(text.op, ast.Add):
        return _sentence(text.left) + (_sentence(text.right) or "…")
    return ""


def fits(code: str, pattern: str) -> bool:
    """Whether a code is one of those that a code with a `*` stands for."""
    return re.fullmatch(re.escape(pattern).replace(r"\*", r"[a-z-]+"), code) is not None


@cache
def _by_function() -> dict[str, tuple[set[str], set[str]]]:
    """The codes that each function of the checks and of the diagnosis gives itself, and the functions it calls."""
    found: dict[str, tuple[set[str], set[str]]] = {}
    for path in sorted([*(KIT / "checks").rglob("*.py"), *(KIT / "diagnosis").rglob("*.py")]):
        for use in _uses_in(path):
            found.setdefault(use.function, (set(), set()))[0].add(use.code)
        for function, node in _with_function(parsed(path)):
            if isinstance(node, ast.Call) and (called := _own_function(node.func)):
                found.setdefault(function, (set(), set()))[1].add(called)
    return found


def _own_function(called: ast.expr) -> str:
    """The name of a function of the same module, class or package that is called; empty for others' methods."""
    if isinstance(called, ast.Name):
        return called.id
    if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
        return called.attr if called.value.id in ("self", "diagnosis") else ""
    return ""


def failures(name: str) -> list[str]:
    """The codes that a function can fail with, its helpers included; without those that every expectation has."""
    table = _by_function()
    codes: set[str] = set()
    front, done = [name], set()
    while front:
        function = front.pop()
        # What these say is true of every expectation; the page says it once.
        if function in done or function in ("fail", "settle_programs", "inside_reason", "program_trouble", "start"):
            continue
        done.add(function)
        own, called = table.get(function, (set(), set()))
        codes |= own
        front += called & table.keys()
    return sorted(codes)
