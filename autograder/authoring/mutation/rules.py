"""The rules by which a solution is changed. They imitate students' mistakes in ROS, in Python and in other answers.

Many mistakes show only the second time: something is done once and not again, for the first and not for each, or a
bound is twice or half of what it should be.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import yaml


@dataclass(frozen=True)
class Change:
    """A piece of the source and the text that replaces it."""

    start: int
    """The offset of the piece in bytes of UTF-8."""
    end: int
    text: str
    rule: str


@dataclass(frozen=True)
class Mutant:
    """A solution with one change."""

    answer: str
    """The grade_id of the answer cell."""
    rule: str
    before: str
    """The changed line, without its indentation."""
    after: str
    source: str
    """The whole answer as a student would hand it in."""

    @property
    def key(self) -> str:
        """A description of the change that stays the same as long as the line does."""
        return f"{self.answer}: {self.rule}: {self.before} => {self.after}"


class Source:
    """A Python source and the positions of its AST nodes."""

    def __init__(self, text: str) -> None:
        """Compute where each line begins."""
        self.text = text
        self.data = text.encode()
        self._lines = [0]
        for line in self.data.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))

    def start(self, node: ast.expr | ast.stmt | ast.keyword) -> int:
        """Return the offset of a node's first byte; for a decorated function, that of its first decorator."""
        decorators = getattr(node, "decorator_list", [])
        if decorators:
            return self.start(decorators[0]) - 1
        return self._lines[node.lineno - 1] + node.col_offset

    def end(self, node: ast.expr | ast.stmt | ast.keyword) -> int:
        """Return the offset after a node's last byte."""
        return self._lines[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)

    def of(self, node: ast.expr | ast.stmt | ast.keyword) -> str:
        """Return the text of a node."""
        return self.data[self.start(node) : self.end(node)].decode()

    def with_change(self, change: Change) -> str:
        """Return the source with one piece replaced."""
        return (self.data[: change.start] + change.text.encode() + self.data[change.end :]).decode()

    def argument(self, call: ast.Call, node: ast.expr | ast.keyword) -> tuple[int, int]:
        """Return the start and end of an argument, including the comma that separates it from the others."""
        start, end = self.start(node), self.end(node)
        after = self.data[end : self.end(call)]
        rest = after.lstrip()
        if rest.startswith(b","):
            end += len(after) - len(rest) + 1
            end += len(self.data[end:]) - len(self.data[end:].lstrip(b" \n"))
            return start, end
        before = self.data[:start].rstrip()
        return (len(before) - 1 if before.endswith(b",") else start), end


ENTITIES = {
    "create_publisher": 1,
    "create_lifecycle_publisher": 1,
    "create_subscription": 1,
    "create_service": 1,
    "create_client": 1,
}
"""The index of the name among the arguments of each method."""
_POLICIES = {
    "RELIABLE": "BEST_EFFORT",
    "BEST_EFFORT": "RELIABLE",
    "VOLATILE": "TRANSIENT_LOCAL",
    "TRANSIENT_LOCAL": "VOLATILE",
    "KEEP_LAST": "KEEP_ALL",
    "KEEP_ALL": "KEEP_LAST",
    "AUTOMATIC": "MANUAL_BY_TOPIC",
    "MANUAL_BY_TOPIC": "AUTOMATIC",
}
_RETURNS = ("SUCCESS", "FAILURE", "ERROR")
_GROUPS = {
    "MutuallyExclusiveCallbackGroup": "ReentrantCallbackGroup",
    "ReentrantCallbackGroup": "MutuallyExclusiveCallbackGroup",
}
_DROPPED_KEYWORDS = {
    "QoSProfile", "SubscriptionEventCallbacks", "PublisherEventCallbacks", "create_publisher", "create_subscription",
    "create_timer", "create_service", "create_client", "create_lifecycle_publisher", "MultiThreadedExecutor",
}  # fmt: skip


def name_of(node: ast.AST) -> str:
    """Return the last part of a name or of a dotted name; empty if the node is neither."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def string(node: ast.AST) -> str | None:
    """Return the value of a string literal; None if the node is no string literal."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def ros_changes(source: Source, tree: ast.Module, node: ast.AST) -> Iterator[Change]:
    """Yield every change that the rules for ROS make to one node."""
    if isinstance(node, ast.Call):
        yield from _entity(source, tree, node)
        yield from _timer(source, node)
        yield from _parameter(source, node)
        yield from _keywords(source, tree, node)
        yield from _executor(source, node)
        yield from _node_name(source, node)
    if isinstance(node, ast.Attribute) and node.attr in _POLICIES and "Policy" in name_of(node.value):
        yield _new(source, node, f"{source.of(node.value)}.{_POLICIES[node.attr]}", "qos policy")
    if isinstance(node, ast.Attribute) and node.attr in _RETURNS and "TransitionCallbackReturn" in name_of(node.value):
        for other in _RETURNS:
            if other != node.attr:
                yield _new(source, node, f"{source.of(node.value)}.{other}", "returned state")
    if isinstance(node, ast.Return) and node.value is not None and "super()." in source.of(node.value):
        yield _new(source, node.value, "TransitionCallbackReturn.SUCCESS", "no super")
    if isinstance(node, ast.With):
        first, last = source.start(node), source.end(node.items[-1].context_expr)
        yield Change(first, last, "if True", "no lock")
    if isinstance(node, ast.Name) and node.id in _GROUPS and isinstance(node.ctx, ast.Load):
        yield _new(source, node, _GROUPS[node.id], "callback group")


def _new(source: Source, node: ast.expr, text: str, rule: str) -> Change:
    return Change(source.start(node), source.end(node), text, rule)


def other_names(name: str) -> Iterator[str]:
    """Yield similar but wrong names for a topic or service."""
    yield name[1:] if name.startswith("/") else "/" + name.removeprefix("~/")
    yield name[2:] if name.startswith("~/") else "~/" + name.lstrip("/")
    yield name + "x"


def _entity(source: Source, tree: ast.Module, call: ast.Call) -> Iterator[Change]:
    place = ENTITIES.get(name_of(call.func))
    if place is None or len(call.args) <= place:
        return
    name = string(call.args[place])
    for other in other_names(name) if name else ():
        yield _new(source, call.args[place], f'"{other}"', "name")
    own = name_of(call.args[0])
    for other in _message_types(tree) - {own}:
        yield _new(source, call.args[0], other, "type")
    if len(call.args) > 2 and "create_service" not in name_of(call.func) and "client" not in name_of(call.func):
        qos = call.args[-1]
        if not isinstance(qos, ast.Constant):
            yield _new(source, qos, "10", "qos profile")


def _message_types(tree: ast.Module) -> set[str]:
    found = [n for n in tree.body if isinstance(n, ast.ImportFrom) and (n.module or "").endswith((".msg", ".srv"))]
    return {alias.asname or alias.name for node in found for alias in node.names}


def _timer(source: Source, call: ast.Call) -> Iterator[Change]:
    if name_of(call.func) in ("create_timer", "create_rate") and call.args:
        period = call.args[0]
        yield _new(source, period, f"2 * ({source.of(period)})", "timer period")
        yield _new(source, period, f"({source.of(period)}) / 2", "timer period")


def _parameter(source: Source, call: ast.Call) -> Iterator[Change]:
    kind = name_of(call.func)
    if kind not in ("declare_parameter", "get_parameter") or not call.args:
        return
    name = string(call.args[0])
    if name:
        yield _new(source, call.args[0], f'"{name}x"', "parameter name")
    if kind == "declare_parameter" and len(call.args) > 1:
        default = call.args[1]
        value = default.value if isinstance(default, ast.Constant) else None
        if isinstance(value, float):
            yield _new(source, default, str(int(value)), "parameter type")
        elif isinstance(value, int) and not isinstance(value, bool):
            yield _new(source, default, f"{value}.0", "parameter type")
        elif isinstance(value, str):
            yield _new(source, default, "5", "parameter type")


def _keywords(source: Source, tree: ast.Module, call: ast.Call) -> Iterator[Change]:
    for keyword in call.keywords:
        if name_of(call.func) in _DROPPED_KEYWORDS:
            yield Change(*source.argument(call, keyword), "", f"without {keyword.arg}")
        if keyword.arg == "callback_group":
            for other in _group_names(source, tree) - {source.of(keyword.value)}:
                yield _new(source, keyword.value, other, "another group")


def _group_names(source: Source, tree: ast.Module) -> set[str]:
    """Return the expressions to which the program assigns callback groups."""
    return {
        source.of(target)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and name_of(node.value.func) in _GROUPS
        for target in node.targets
    }


def _executor(source: Source, call: ast.Call) -> Iterator[Change]:
    if name_of(call.func) == "MultiThreadedExecutor":
        yield _new(source, call, "rclpy.executors.SingleThreadedExecutor()", "executor")
    if name_of(call.func) == "spin" and not call.args and isinstance(call.func, ast.Attribute):
        yield _new(source, call, f"{source.of(call.func.value)}.spin_once()", "spins once")


def _node_name(source: Source, call: ast.Call) -> Iterator[Change]:
    is_super = isinstance(call.func, ast.Attribute) and call.func.attr == "__init__"
    name = string(call.args[0]) if is_super and call.args else None
    if name:
        yield _new(source, call.args[0], f'"{name}x"', "node name")


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
    """Yield every change of a program that begins in one of the given lines, each of them once.

    Args:
        text: the Python program.
        lines: the numbers of the lines that students write, counted from 1.
    """
    source, tree = Source(text), ast.parse(text)
    seen = {ast.dump(tree)}
    repeated = set(_repeated(tree))
    for node in ast.walk(tree):
        if getattr(node, "lineno", 0) not in lines:
            continue
        made = (*ros_changes(source, tree, node), *_general(source, node), *_blocks(source, node, lines))
        for change in (*made, *_times(source, node, node in repeated)):
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
        yield repr(value * 2), "number"
        yield repr(value / 2), "number"
    elif isinstance(value, str) and value and "\n" not in value and len(value) < 40:
        yield repr(value + "x"), "text"


def _blocks(source: Source, node: ast.AST, lines: set[int]) -> Iterator[Change]:
    """Yield the change that leaves out a statement."""
    if isinstance(node, _DROPPED) and not (isinstance(node, ast.Expr) and string(node.value) is not None):
        yield Change(source.start(node), source.end(node), "pass", f"dropped {_what(node)}")


def _repeated(tree: ast.Module) -> Iterator[ast.stmt]:
    """Simple statements of the methods that run again and again: all but those that set a node up."""
    for method in (node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))):
        own = method.args.args[:1]
        if method.name != "__init__" and own and own[0].arg == "self":
            for node in ast.walk(method):
                local = isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
                docstring = isinstance(node, ast.Expr) and string(node.value) is not None
                if isinstance(node, _SIMPLE) and not local and not docstring:
                    yield node


def _times(source: Source, node: ast.AST, repeated: bool) -> Iterator[Change]:
    """What is done once in place of each time, for one in place of each, for the first in place of the last."""
    if isinstance(node, ast.stmt) and repeated:
        start, end, text = source.start(node), source.end(node), source.of(node)
        once = "vars(self).setdefault('_once', [])"
        yield Change(start, end, f"if not {once}: self._once.append(1); {text}", "only the first time")
        yield Change(start, end, f"if {once} or self._once.append(1): {text}", "all but the first time")
    elif isinstance(node, ast.For):
        each = source.of(node.iter)
        yield _new(source, node.iter, f"list({each})[:1]", "only the first")
        yield _new(source, node.iter, f"list({each})[1:]", "all but the first")
    elif isinstance(node, ast.comprehension):
        each = source.of(node.iter)
        yield _new(source, node.iter, f"list({each})[1:]", "all but the first")
    elif isinstance(node, ast.Subscript):
        place = source.of(node.slice)
        if place in ("0", "-1"):
            yield _new(source, node.slice, "-1" if place == "0" else "0", "first, last")
    elif isinstance(node, ast.Call) and name_of(node.func) in ("min", "max"):
        other = "max" if name_of(node.func) == "min" else "min"
        yield _new(source, node.func, other, "lowest, highest")


def swaps(text: str, lines: set[int]) -> Iterator[Change]:
    """Yield changes that swap two neighbouring simple statements of a block."""
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


_LEAF = re.compile(r"^(\s*(?:- )?)([\w/*~.$()'\"-]+):[ ]+(?![>|])(.+?)\s*$")
_RULE = re.compile(r"-([rp])\s+(\S+?):=(\S*)")


def text_changes(text: str) -> Iterator[tuple[str, str]]:
    """Yield every change of a YAML answer, as the rule and the new text. Texts that are no longer YAML are left out."""
    seen = {repr(_load(text))}
    for rule, changed in _all(text):
        value = _load(changed)
        if value is not None and repr(value) not in seen:
            seen.add(repr(value))
            yield rule, changed


def without_a_line(text: str) -> Iterator[str]:
    """Yield the text without one of its lines, for each line that has words and is no comment or closing tag."""
    rows = text.split("\n")
    for number, row in enumerate(rows):
        if re.search(r"\w", row) and not row.strip().startswith(("#", "</")):
            yield "\n".join(rows[:number] + rows[number + 1 :])


def _load(text: str) -> object:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return None


def _all(text: str) -> Iterator[tuple[str, str]]:
    rows = text.split("\n")
    for number, row in enumerate(rows):
        match = _LEAF.match(row)
        if match is None:
            continue
        yield "dropped line", "\n".join(rows[:number] + rows[number + 1 :])
        if ":=" not in match[3]:
            for rule, value in _values(match[3]):
                yield rule, "\n".join([*rows[:number], f"{match[1]}{match[2]}: {value}", *rows[number + 1 :]])
    yield from _words(text)


def _values(value: str) -> Iterator[tuple[str, str]]:
    meant = _load(value)
    if isinstance(meant, bool):
        yield "value", "no" if meant else "yes"
    elif isinstance(meant, int):
        yield "value", str(meant + 1)
        yield "type", f'"{meant}"'
    elif isinstance(meant, float):
        yield "value", str(meant * 2)
    elif isinstance(meant, list) and meant:
        yield "value", f"[{', '.join(map(str, meant[1:] + meant[:1]))}]"
    elif isinstance(meant, str):
        yield "value", f"{meant}x" if "$(" not in meant else f'"x{meant}"'
        if re.fullmatch(r"[~/\w]+", meant) and "/" in meant:
            for other in other_names(meant):
                yield "name", other


def _words(text: str) -> Iterator[tuple[str, str]]:
    """Yield changes of the remap and parameter rules in a command line.

    A rule is left out, gets another left or right side, or is swapped with the rule after it.
    """
    for match in _RULE.finditer(text):
        start, end = match.span()
        yield "dropped rule", re.sub(r" +\n", "\n", f"{text[:start]}{text[end:].lstrip(' ')}")
        if match[1] == "p":
            yield "parameter rule", f"{text[:start]}-p {match[2]}x:={match[3]}{text[end:]}"
            continue
        for left in (*other_names(match[2]),) if "__" not in match[2] else (match[2].replace("__", "__x"),):
            yield "left side", f"{text[:start]}-r {left}:={match[3]}{text[end:]}"
        for right in other_names(match[3]):
            yield "right side", f"{text[:start]}-r {match[2]}:={right}{text[end:]}"
    rules = list(_RULE.finditer(text))
    for one, two in pairwise(rules):
        if text[one.end() : two.start()].strip() == "":
            between = text[one.end() : two.start()]
            yield "order", text[: one.start()] + two.group() + between + one.group() + text[two.end() :]
