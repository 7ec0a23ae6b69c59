"""Evaluates the substitutions of a launch file.

`$(eval …)` is evaluated without running the student's text as Python. Only comparisons, arithmetic and a few functions
are supported.
"""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.graph.names import nearest
from autograder.launch_files.errors import TEXT_LENGTH, refused
from autograder.launch_files.files import Packages
from autograder.launch_files.texts import Call, Text, calls
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
# `launch` allows an expression to use the names of the module `math`, so `pow` is that of `math`.
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
    """Evaluate an expression and return its result as a text, as Python's `str` writes it.

    Raises:
        Refused: it is not an expression, it is not covered here, or it fails as it would fail in Python.
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
    """Return the number of characters and items in a value. A list that occurs several times in it counts each time."""
    if isinstance(value, (tuple, list)):
        return sum(1 + _size(item) for item in value)
    return len(value) if isinstance(value, str) else 1


def _name(node: ast.Name) -> Any:
    if node.id in _NAMES:
        return _NAMES[node.id]
    if hasattr(builtins, node.id) or hasattr(math, node.id):
        raise refused(f"`{node.id}` is not covered here.")
    quoted = f"Python has `True` and `False`; write a text in quotes: `'{node.id}'`."
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


_VALUES = {
    "var": (1, 2), "env": (1, 2), "dirname": (0, 0), "find-pkg-share": (1, 1), "eval": (1, 2), "equals": (2, 2),
    "not-equals": (2, 2), "not": (1, 1), "and": (2, 2), "or": (2, 2), "if": (2, 3),
}  # fmt: skip
"""The least and the largest number of values that each substitution takes."""
_NOT_COVERED = {
    "all", "anon", "any", "command", "exec-in-pkg", "file-content", "filename", "find-exec", "find-pkg-prefix",
    "launch_log_dir", "log_dir", "param",
}  # fmt: skip
_IN_ROS_2 = {
    "arg": "In ROS 2 it is `$(var NAME)`.",
    "optenv": "In ROS 2 it is `$(env NAME DEFAULT)`.",
    "find": "In ROS 2 it is `$(find-pkg-share PACKAGE)`.",
}
"""The substitutions of ROS 1, and what replaces them in ROS 2."""
_OF_THE_MACHINE = {
    "COLUMNS", "DISPLAY", "EDITOR", "HOME", "HOST", "HOSTNAME", "LANG", "LANGUAGE", "LINES", "LOGNAME", "MAIL",
    "OLDPWD", "PATH", "PWD", "SHELL", "SHLVL", "SUDO_USER", "TERM", "TMPDIR", "TZ", "USER", "USERNAME", "VIRTUAL_ENV",
}  # fmt: skip
_OF_THE_MACHINE_PREFIXES = (
    "AMENT_", "CMAKE_", "COLCON_", "CONDA_", "CYCLONEDDS_", "DBUS_", "FASTDDS_", "FASTRTPS_", "GZ_", "LC_", "LD_",
    "PYTHON", "RCL", "RMW_", "ROS_", "SSH_", "TURTLEBOT3_", "XDG_",
)  # fmt: skip
JAZZY = {"ROS_DISTRO": "jazzy", "ROS_VERSION": "2", "ROS_PYTHON_VERSION": "3"}
"""The environment variables that every installation of Jazzy sets."""


@dataclass
class Context:
    """The state of a running launch file. A group works on a copy of it."""

    packages: Packages
    configurations: dict[str, Any] = field(default_factory=dict)
    """The values of launch arguments and of `let`, and the settings of a group under the names that `launch_ros`
    uses."""
    environment: dict[str, str | None] = field(default_factory=lambda: dict[str, str | None](JAZZY))
    """The known variables; None for a variable that the launch file has unset."""

    def scoped(self) -> Context:
        """Return a copy for a group. It shares the lists with the original, as in `launch`."""
        return Context(self.packages, dict(self.configurations), dict(self.environment))


def check(text: Text) -> None:
    """Refuse substitutions that `launch` refuses when it reads a file, and those that are not covered here.

    Raises:
        Refused: for the first such substitution.
    """
    covered = ", ".join(f"`{name}`" for name in sorted(_VALUES))
    for call in calls(text):
        if call.name in _NOT_COVERED:
            raise refused(f"the substitution `{call.written}` is not covered here.", f"Covered are {covered}.")
        if call.name not in _VALUES:
            hint = _IN_ROS_2.get(call.name, f"Covered here are {covered}.")
            raise refused(f"there is no substitution `{call.name}`.", hint)
        least, most = _VALUES[call.name]
        if not least <= len(call.values) <= most:
            wanted = f"{least}" if least == most else f"{least} or {most}"
            raise refused(
                f"`{call.written}`: `{call.name}` takes {wanted} value{'s' if most != 1 else ''}, "
                f"and {len(call.values)} {'is' if len(call.values) == 1 else 'are'} given.",
                "Write a value with spaces in quotes.",
            )


def perform(text: Text, context: Context, folder: Path) -> str:
    """Perform the substitutions of a text.

    Args:
        text: a text that `texts.parse` and `check` have accepted.
        context: the current state.
        folder: the folder of the launch file that contains the text.

    Raises:
        Refused: a substitution cannot be performed, or the text becomes too long.
    """
    done, length = [], 0
    for part in text:
        done.append(part if isinstance(part, str) else _substituted(part, context, folder))
        length += len(done[-1])
        if length > TEXT_LENGTH:
            raise refused(f"the text grows longer than {TEXT_LENGTH} characters.", "Does it repeat itself?")
    return "".join(done)


def _substituted(call: Call, context: Context, folder: Path) -> str:
    def said(number: int) -> str:
        return perform(call.values[number], context, folder)

    match call.name:
        case "var":
            name = said(0)
            if name not in context.configurations and len(call.values) == 2:
                return said(1)
            return _configuration(name, context)
        case "env":
            default = said(1) if len(call.values) == 2 else None
            return _variable(said(0), default, context)
        case "dirname":
            return str(folder)
        case "find-pkg-share":
            try:
                return context.packages.share(said(0))
            except KeyError:
                raise refused(f"there is no package `{said(0)}`.") from None
        case "eval":
            if len(call.values) == 2 and said(1).strip() != "math":
                raise refused(f"`{call.written}`: of Python's modules only `math` is covered here.")
            return evaluate(said(0))
        case "equals" | "not-equals":
            if () in call.values:
                raise refused(
                    f"`{call.written}`: an empty text `''` means something else there and is not covered here.",
                    "Write `$(eval \"'$(var NAME)' == ''\")`.",
                )
            return _word(_equal(said(0), said(1)) is (call.name == "equals"))
        case "not":
            return _word(not _truth(said(0), call))
        case "and" | "or":
            left, right = _truth(said(0), call), _truth(said(1), call)
            return _word(left and right if call.name == "and" else left or right)
    return said(1) if _truth(said(0), call) else (said(2) if len(call.values) == 3 else "")


def _configuration(name: str, context: Context) -> str:
    value = context.configurations.get(name)
    if value is None:
        near = nearest(name, [known for known, text in context.configurations.items() if isinstance(text, str)])
        raise refused(
            f"there is no launch argument `{name}` here." + (f" `{near}` is there; is that meant?" if near else ""),
            f"An argument is declared above with `- arg:` and `name: {name}`.",
        )
    if not isinstance(value, str):
        raise refused(f"`{name}` is a name that `launch_ros` uses itself; it is not covered here.")
    return value


def _variable(name: str, default: str | None, context: Context) -> str:
    if name not in context.environment and of_the_machine(name):
        raise refused(
            f"the environment variable `{name}` differs from machine to machine; it is not covered here.",
            "Use a variable that the launch file sets with `set_env`, or a launch argument.",
        )
    value = context.environment.get(name)
    if value is None and default is None:
        raise refused(
            f"the environment variable `{name}` is not set.",
            f"Give it a default: `$(env {name} VALUE)`.",
        )
    return value if value is not None else str(default)


def of_the_machine(name: str) -> bool:
    """Whether an environment variable is usually set to a value that depends on the machine."""
    return name in _OF_THE_MACHINE or name.startswith(_OF_THE_MACHINE_PREFIXES)


def _truth(text: str, call: Call) -> bool:
    try:
        value = student_yaml.load(text, "the value")
    except Refused:
        value = None
    if not isinstance(value, bool):
        raise refused(f"`{call.written}` wants `true` or `false`, not `{text[:60]}`.")
    return value


def _word(value: bool) -> str:
    return str(value).lower()


def _equal(left: str, right: str) -> bool:
    truths = ("true", "1", "false", "0")
    if left.lower() in truths and right.lower() in truths:
        return (left.lower() in truths[:2]) == (right.lower() in truths[:2])
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right
