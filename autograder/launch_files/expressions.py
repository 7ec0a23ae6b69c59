"""`$(eval …)`: comparisons and arithmetic of Python, worked out without running Python on what a student wrote."""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Callable
from typing import Any

from autograder.launch_files.errors import TEXT_LENGTH, refused
from autograder.reasons import Refused

_LONGEST = 1000
_LARGEST = 10**100

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda one, other: one in other,
    ast.NotIn: lambda one, other: one not in other,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
}
# `launch` lets an expression use what the module `math` has, which hides Python's own `pow`.
_MATH = {
    name: getattr(math, name)
    for name in (
        "acos", "asin", "atan", "atan2", "ceil", "copysign", "cos", "degrees", "dist", "e", "exp", "fabs", "floor",
        "fmod", "hypot", "inf", "isclose", "isfinite", "isinf", "isnan", "log", "log10", "log2", "nan", "pi", "pow",
        "radians", "remainder", "sin", "sqrt", "tan", "tau", "trunc",
    )
}  # fmt: skip
_NAMES: dict[str, Any] = {
    **{name: getattr(builtins, name) for name in ("abs", "bool", "float", "int", "len", "max", "min", "round", "str")},
    **_MATH,
}
_METHODS = {
    "capitalize",
    "count",
    "endswith",
    "find",
    "lower",
    "lstrip",
    "rstrip",
    "startswith",
    "strip",
    "title",
    "upper",
}


def evaluate(expression: str) -> str:
    """Work out an expression and return what Python's `str` makes of the result.

    Raises:
        Refused: it is no expression, is not covered here, or fails as it would fail in Python.
    """
    shown = f"`$(eval …)` of `{expression[:80]}`"
    if len(expression) > _LONGEST:
        raise refused(f"{shown}: it is longer than {_LONGEST} characters.")
    try:
        tree = ast.parse(expression.lstrip(" \t"), mode="eval")
        return str(_value(tree.body))
    except Refused as error:
        raise refused(f"{shown}: {error.reason.because}", error.reason.hint) from None
    except SyntaxError:
        raise refused(f"{shown} is not an expression of Python.", "Put texts inside it in quotes.") from None
    except (RecursionError, MemoryError):
        raise refused(f"{shown} is nested too deep.") from None
    except Exception as error:
        raise refused(f"{shown}: {type(error).__name__}: {error}.", "Try the expression in Python.") from None


def _value(node: ast.expr) -> Any:
    method = _NODES.get(type(node))
    if method is None:
        raise refused(
            f"`{ast.unparse(node)[:60]}` is not covered here.",
            "Comparisons, arithmetic and functions of `math` are.",
        )
    return _bounded(method(node))


def _bounded(value: Any) -> Any:
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > _LARGEST:
        raise refused("a number in it is too large.")
    if _size(value) > TEXT_LENGTH:
        raise refused("a text or a list in it is too long.")
    return value


def _size(value: Any) -> int:
    """How many characters and items a value has, those of the lists in it counted each time."""
    if isinstance(value, (tuple, list)):
        return sum(1 + _size(item) for item in value)
    return len(value) if isinstance(value, str) else 1


def _name(node: ast.Name) -> Any:
    if node.id in _NAMES:
        return _NAMES[node.id]
    if hasattr(builtins, node.id) or hasattr(math, node.id):
        raise refused(f"`{node.id}` is not covered here.")
    quoted = f"Python has `True` and `False`; a text stands in quotes: `'{node.id}'`."
    raise refused(f"Python knows no name `{node.id}` there.", quoted)


def _binary(node: ast.BinOp) -> Any:
    left, right = _value(node.left), _value(node.right)
    if type(node.op) not in _BINARY:
        raise refused("an operator in it is not covered here.")
    if isinstance(left, str) and isinstance(node.op, ast.Mod):
        raise refused("`%` with a text is not covered here.")
    if isinstance(node.op, ast.Pow) and isinstance(right, int) and abs(right) > 300:
        raise refused("an exponent in it is too large.")
    if isinstance(node.op, ast.Mult):
        for one, times in ((left, right), (right, left)):
            if isinstance(one, (str, list, tuple)) and isinstance(times, int) and _size(one) * times > TEXT_LENGTH:
                raise refused("a text or a list in it is too long.")
    return _BINARY[type(node.op)](left, right)


def _unary(node: ast.UnaryOp) -> Any:
    if type(node.op) not in _UNARY:
        raise refused("an operator in it is not covered here.")
    return _UNARY[type(node.op)](_value(node.operand))


def _boolean(node: ast.BoolOp) -> Any:
    wanted, value = isinstance(node.op, ast.Or), None
    for part in node.values:
        value = _value(part)
        if bool(value) is wanted:
            break
    return value


def _comparison(node: ast.Compare) -> Any:
    left, result = _value(node.left), True
    for compare, comparator in zip(node.ops, node.comparators, strict=True):
        right = _value(comparator)
        result = _COMPARE[type(compare)](left, right)
        if not result:
            break
        left = right
    return result


def _call(node: ast.Call) -> Any:
    if node.keywords or any(isinstance(value, ast.Starred) for value in node.args):
        raise refused("named arguments are not covered here.")
    values = [_value(value) for value in node.args]
    if isinstance(node.func, ast.Attribute) and not _is_math(node.func):
        owner = _value(node.func.value)
        if isinstance(owner, str) and node.func.attr in _METHODS:
            return getattr(owner, node.func.attr)(*values)
        raise refused(f"`.{node.func.attr}()` is not covered here.")
    function = _value(node.func)
    if not callable(function):
        raise refused(f"`{ast.unparse(node.func)[:60]}` is not a function.")
    if function is round and any(isinstance(digits, int) and abs(digits) > 300 for digits in values[1:]):
        raise refused("a number of digits in it is too large.")
    return function(*values)


def _is_math(node: ast.Attribute) -> bool:
    return isinstance(node.value, ast.Name) and node.value.id == "math"


def _attribute(node: ast.Attribute) -> Any:
    if _is_math(node) and node.attr in _MATH:
        return _MATH[node.attr]
    raise refused(f"`{ast.unparse(node)[:60]}` is not covered here.")


def _item(node: ast.Subscript) -> Any:
    if isinstance(node.slice, ast.Slice):
        raise refused("slices are not covered here.")
    return _value(node.value)[_value(node.slice)]


def _constant(node: ast.Constant) -> Any:
    if not isinstance(node.value, (bool, int, float, str, type(None))):
        raise refused(f"`{ast.unparse(node)[:60]}` is not covered here.")
    return node.value


_NODES: dict[type[ast.expr], Callable[[Any], Any]] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _boolean,
    ast.Compare: _comparison,
    ast.IfExp: lambda node: _value(node.body if _value(node.test) else node.orelse),
    ast.Call: _call,
    ast.Attribute: _attribute,
    ast.Subscript: _item,
    ast.List: lambda node: [_value(part) for part in node.elts],
    ast.Tuple: lambda node: tuple(_value(part) for part in node.elts),
}
