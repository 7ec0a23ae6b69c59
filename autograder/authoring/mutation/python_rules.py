"""Changes of any Python program: numbers, comparisons, conditions, dropped and swapped statements."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import pairwise

from autograder.authoring.mutation.ros_rules import name_of, ros_changes, string
from autograder.authoring.mutation.source import Change, Source

_COMPARISONS = {
    ast.Lt: ("<=", ">"),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<"),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
_ARITHMETIC = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*"}
_DROPPED = (ast.Expr, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Raise, ast.Return, ast.If, ast.FunctionDef, ast.For)
_SIMPLE = (ast.Expr, ast.Assign, ast.AugAssign)


def changes(text: str, lines: set[int]) -> Iterator[Change]:
    """Every change of a program that begins in one of the lines, each once.

    Args:
        text: Python.
        lines: numbers of the lines that are the student's, from 1.
    """
    source, tree = Source(text), ast.parse(text)
    seen = {ast.dump(tree)}
    for node in ast.walk(tree):
        if getattr(node, "lineno", 0) not in lines:
            continue
        for change in (*ros_changes(source, tree, node), *_general(source, node), *_blocks(source, node, lines)):
            try:
                meaning = ast.dump(ast.parse(source.with_change(change)))
            except (SyntaxError, ValueError):
                continue
            if meaning not in seen:
                seen.add(meaning)
                yield change


def _general(source: Source, node: ast.AST) -> Iterator[Change]:
    if isinstance(node, ast.Constant):
        for other, rule in _constants(node):
            yield Change(source.start(node), source.end(node), other, rule)
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        left, right = source.of(node.left), source.of(node.comparators[0])
        for sign in _COMPARISONS[type(node.ops[0])]:
            yield Change(source.start(node), source.end(node), f"{left} {sign} {right}", "comparison")
    elif isinstance(node, ast.BoolOp):
        word = " or " if isinstance(node.op, ast.And) else " and "
        text = word.join(f"({source.of(value)})" for value in node.values)
        yield Change(source.start(node), source.end(node), f"({text})", "and, or")
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield Change(source.start(node), source.end(node), source.of(node.operand), "without not")
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        text = f"{source.of(node.left)} {_ARITHMETIC[type(node.op)]} {source.of(node.right)}"
        yield Change(source.start(node), source.end(node), f"({text})", "arithmetic")
    elif isinstance(node, ast.AugAssign) and isinstance(node.op, (ast.Add, ast.Sub)):
        sign = "-=" if isinstance(node.op, ast.Add) else "+="
        text = f"{source.of(node.target)} {sign} {source.of(node.value)}"
        yield Change(source.start(node), source.end(node), text, "arithmetic")
    elif isinstance(node, (ast.If, ast.IfExp, ast.While)):
        for value in ("True", "False"):
            yield Change(source.start(node.test), source.end(node.test), value, "condition")


def _constants(node: ast.Constant) -> Iterator[tuple[str, str]]:
    value = node.value
    if isinstance(value, bool):
        yield str(not value), "constant"
    elif isinstance(value, int):
        yield str(value + 1), "number"
        yield str(value - 1 if 0 < value < 10 else value * 10 if value else -1), "number"
    elif isinstance(value, float):
        yield repr(value * 3), "number"
        yield repr(value / 3), "number"
    elif isinstance(value, str) and value and "\n" not in value and len(value) < 40:
        yield repr(value + "x"), "text"


def _blocks(source: Source, node: ast.AST, lines: set[int]) -> Iterator[Change]:
    """Statements left out, and neighbours swapped."""
    if isinstance(node, _DROPPED) and not (isinstance(node, ast.Expr) and string(node.value) is not None):
        yield Change(source.start(node), source.end(node), "pass", f"dropped {_what(node)}")


def swaps(text: str, lines: set[int]) -> Iterator[Change]:
    """Neighbouring simple statements of a block in the other order."""
    source, tree = Source(text), ast.parse(text)
    for node in ast.walk(tree):
        for body in (getattr(node, "body", None), getattr(node, "orelse", None)):
            for one, two in pairwise(body) if isinstance(body, list) else ():
                if {one.lineno, two.lineno} <= lines and isinstance(one, _SIMPLE) and isinstance(two, _SIMPLE):
                    start, end = source.start(one), source.end(two)
                    between = source.data[source.end(one) : source.start(two)].decode()
                    yield Change(start, end, f"{source.of(two)}{between}{source.of(one)}", "order")


def _what(node: ast.stmt) -> str:
    if isinstance(node, ast.FunctionDef):
        return "method"
    called = node.value if isinstance(node, (ast.Expr, ast.Assign)) else None
    return f"{name_of(called.func)}()" if isinstance(called, ast.Call) else type(node).__name__.lower()
