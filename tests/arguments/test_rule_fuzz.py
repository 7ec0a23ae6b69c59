"""Rules made at random, for the real rcl: what it refuses is explained, and a reason's advice does what it says."""

from __future__ import annotations

from collections.abc import Sequence

import rclpy
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from rclpy.node import Node

from autograder.arguments.remap_rules import parse, refused, refused_parameter
from autograder.arguments.rule_effect import full_name, without_effect
from autograder.reasons import Reason

QUICK = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much])
PIECES = (
    "a", "b", "camera", "image_color", "~", "~/", "/", "//", ":", ":=", "__", "_", "__ns", "__node", "__name", "__NS",
    "*", "**", "1", "2b", "rostopic://", "rosservice://", "-", ".", " ", "é", "\\1", "status", "n:", "=", "ros",
)  # fmt: skip
SOUND = (
    "a:=b", "~/status:=/diag", "n:a:=b", "__ns:=/x/y", "__node:=x", "rostopic://a:=b", "a/b:=c/d", "/a:=~/b",
    "n:__node:=x", "rosservice://a:=b", "_a:=b_", "__ns:=/", "__name:=x",
)  # fmt: skip
VALUES = (
    "1", "-2", "1.5", "1e3", "0x10", "true", "y", "a", "b c", '"a"', "'1'", "~", ".inf", "", "@", "&x", "*x", "!y",
    "- ", "a: b", "|", "{", "}", "[", "]", ",", "1:30", "2020-01-01", "# c", "it's", "[1, 2]", "[1, 2.0]", "[a, true]",
    "[]",
)  # fmt: skip


def changed(sound: str, piece: str, at: int) -> str:
    at %= len(sound) + 1
    return sound[:at] + piece + sound[at:]


ALMOST = st.builds(changed, st.sampled_from(SOUND), st.sampled_from(PIECES), st.integers(0, 30))
WILD = st.builds(
    lambda left, right: f"{''.join(left)}:={''.join(right)}",
    st.lists(st.sampled_from(PIECES), max_size=3),
    st.lists(st.sampled_from(PIECES), max_size=3),
)


def rcl_refuses(option: str, rule: str) -> bool:
    context = rclpy.Context()
    try:
        rclpy.init(context=context, args=["x", "--ros-args", option, rule])
        started("n", context).destroy_node()
    except Exception:
        return True
    finally:
        rclpy.try_shutdown(context=context)
    return False


def started(name: str, context: rclpy.Context) -> Node:
    return Node(name, context=context, enable_rosout=False, start_parameter_services=False)


@QUICK
@given(rule=st.sampled_from(SOUND) | ALMOST | WILD)
def test_a_remap_rule_is_explained_if_and_only_if_rcl_refuses_it(rule: str) -> None:
    reason = refused([rule])
    assert (reason is not None) == rcl_refuses("-r", rule)
    assert reason is None or (reason.because and reason.hint)


@QUICK
@given(
    name=st.lists(st.sampled_from(PIECES), min_size=1, max_size=3).map("".join) | st.just("p"),
    value=st.sampled_from(VALUES) | st.lists(st.sampled_from(VALUES), max_size=3).map("".join),
)
@example(name="p", value=f"[{'9' * 5000}]")
def test_a_parameter_rule_is_explained_if_and_only_if_rcl_refuses_it(name: str, value: str) -> None:
    rule = f"{name}:={value}"
    reason = refused_parameter(["--ros-args", "-p", rule])
    assert (reason is not None) == rcl_refuses("-p", rule)
    assert reason is None or (reason.because and reason.hint)


IN_CODE = ("camera/image_color", "camera", "status", "~/status", "/stop", "~/state/raw", "image")
LEFT = (
    *IN_CODE,
    "/camera",
    "/image",
    "image_colour",
    "~/stop",
    "stop",
    "/camera_demo/status",
    "camera_demo/status",
    "a",
)
RIGHT = ("a", "b", "/c", "c", "x/c", "~/d", "d", "e/f")
PREFIXES = ("", "", "", "camera_demo:", "rear:", "front:", "rostopic://", "rosservice://")
RULES = st.lists(
    st.builds("{}{}:={}".format, st.sampled_from(PREFIXES), st.sampled_from(LEFT), st.sampled_from(RIGHT)),
    min_size=1,
    max_size=3,
)
OWN = st.lists(st.sampled_from(("__node:=rear", "__ns:=/x", "camera_demo:__node:=front", "rear:__ns:=/y")), max_size=2)


def resolved(rules: Sequence[str], code: Sequence[str]) -> tuple[str, dict[str, str]]:
    """The node's full name, and what rcl makes of each name in its code."""
    context = rclpy.Context()
    rclpy.init(context=context, args=["x", "--ros-args", *(word for rule in rules for word in ("-r", rule))])
    node = started("camera_demo", context)
    try:
        return node.get_fully_qualified_name(), {name: node.resolve_topic_name(name) for name in code}
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def followed(reason: Reason, rules: list[str], code: list[str], node: str) -> tuple[list[str], list[str]]:
    """The rules and the names in the code after what the reason advises."""
    blamed = next(rule for rule in rules if f"The rule `{rule}` " in reason.because)
    rule, number = parse(blamed), rules.index(blamed)
    assert rule is not None
    scheme = {"topic": "rostopic://", "service": "rosservice://", "": ""}[rule.kind]
    own = node.rsplit("/", 1)[-1]

    def instead(new: str) -> list[str]:
        return [*rules[:number], new, *rules[number + 1 :]]

    match reason.code:
        case "rule-takes-name":
            left = full_name(rule.left, node)  # where several match the name, each is named in its turn
            again = [one.text for one in filter(None, map(parse, rules)) if full_name(one.left, node) == left]
            return [other for other in rules if other not in again], code
        case "rule-order":
            same = [other for other in map(parse, rules[:number]) if other and other.prefix in ("", own)]
            matching = [other.text for other in same if full_name(other.left, node) == full_name(rule.left, node)]
            return [other for other in rules if other not in matching or other == blamed], code
        case "rules-do-not-chain":
            said = reason.because
            maker = next(other for other in map(parse, rules) if other and f"`{other.text}` made it" in said)
            return [f"{maker.left}:={rule.right}", *rules], code
        case "rule-prefix":
            return instead(f"{own}:{scheme}{rule.left}:={rule.right}"), code
        case "rule-kind":
            return instead(f"{rule.left}:={rule.right}"), code
        case "absolute-rule" if "its right side" in reason.because:
            return instead(blamed.replace(":=/", ":=")), code
        case "private-rule" if "its right side" in reason.because:
            return instead(blamed.replace(":=~/", ":=")), code
        case "topic-name":
            return instead(blamed.replace(":=", ":=/")), code
        case "absolute-rule":
            return instead(f"{scheme}{rule.left.lstrip('/')}:={rule.right}"), code
        case "private-rule":
            return instead(f"{scheme}~/{rule.left.rsplit('/', 1)[-1]}:={rule.right}"), code
        case "absolute-name":
            return rules, [name.lstrip("/") if name == f"/{rule.left}" else name for name in code]
    return [], []


@settings(QUICK, max_examples=200)
@given(
    rules=RULES,
    own=OWN,
    code=st.lists(st.sampled_from(IN_CODE), min_size=1, max_size=4, unique=True),
    known=st.booleans(),
)
def test_following_a_reasons_advice_makes_the_name_that_was_wanted(
    rules: list[str], own: list[str], code: list[str], known: bool
) -> None:
    given_rules = [*own, *rules]
    node, names = resolved(given_rules, code)
    in_code = {full_name(name, node): [node] for name in code}
    sides = [side for rule in filter(None, map(parse, rules)) for side in (rule.right, rule.left)]
    for wanted in (full_name(side, node) for side in sides):
        if wanted in names.values():
            continue
        topics = {name: [node] for name in names.values()}
        reason = without_effect(given_rules, wanted, [node], topics, in_code if known else None)
        if reason is None or (not known and reason.code == "rule-takes-name"):  # which leaves two cases open
            continue
        if reason.code == "rule-without-match" and "swapped" in reason.because:
            assert known and wanted not in in_code
            continue
        if reason.code == "rule-without-match":
            said = reason.because
            blamed = next(one for one in map(parse, rules) if one and f"The rule `{one.text}` changed" in said)
            assert blamed.prefix in ("", node.rsplit("/", 1)[-1])
            assert all(full_name(name, node) != full_name(blamed.left, node) for name in code)
            continue
        new_rules, new_code = followed(reason, given_rules, code, node)
        now, names_then = resolved(new_rules, new_code)
        assume(now == node)
        assert wanted in names_then.values(), (reason, new_rules)
