"""Changes by what students get wrong in ROS: groups, threads, executors, names, types, QoS, parameters, timers."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from autograder.authoring.mutation.source import Change, Source

ENTITIES = {
    "create_publisher": 1,
    "create_lifecycle_publisher": 1,
    "create_subscription": 1,
    "create_service": 1,
    "create_client": 1,
}
"""Where the name stands among the arguments."""
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
    """The last word of a name or of a dotted name."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def string(node: ast.AST) -> str | None:
    """A string literal's value."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def ros_changes(source: Source, tree: ast.Module, node: ast.AST) -> Iterator[Change]:
    """Every change of one node."""
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
    """Near misses of a topic's or service's name."""
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
        yield _new(source, period, f"3 * ({source.of(period)})", "timer period")
        yield _new(source, period, f"({source.of(period)}) / 3", "timer period")


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
    """What callback groups are called in the program."""
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
