"""Says why no remap rule produced a name that a rule was meant to produce. There is one function for each reason.

This was measured with rclpy 7.1.6. A rule is matched against a *full* name: the name in the code, expanded with the
node's final namespace and name. The first rule that matches a name wins, and no other rule is applied to the result.
The prefix of a node-specific rule is the name that the node has after `__node` was applied; only for `__node` itself
it is the name in the code.

A reason is given only if the graph proves it: the rule is for the node in question, or would be without the mistake
that the reason names, and the wanted name appears if the student follows the advice. The graph does not show which
names the code gives. A caller that knows these names passes them; otherwise it is assumed that the code itself does
not use a name that a rule produces as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from autograder.arguments.remap_rules import RULE_KIND, Rule, parse
from autograder.graph.names import nearest
from autograder.reasons import Group, Kind, Reason

RULE_WITHOUT_MATCH = Kind("rule-without-match", "no name in the code is the left side", Group.EFFECT)
RULE_PREFIX = Kind("rule-prefix", "the rule is for a node whose name no node has", Group.EFFECT)
RULES_DO_NOT_CHAIN = Kind("rules-do-not-chain", "the left side is a name that another rule made", Group.EFFECT)
ABSOLUTE_RULE = Kind("absolute-rule", "one side of a rule is absolute, and the name lies in a namespace", Group.EFFECT)
PRIVATE_RULE = Kind(
    "private-rule", "one side of a rule is private to the node, and the other name is not", Group.EFFECT
)
ABSOLUTE_NAME = Kind(
    "absolute-name",
    "the code uses a name with a leading slash, and the publisher or subscription has this name",
    Group.NAMES,
)
TOPIC_NAME = Kind("topic-name", "the end is on a topic with a similar name", Group.NAMES)
RULE_TAKES_NAME = Kind(
    "rule-takes-name", "a rule renames the topic or node that already has the expected name", Group.EFFECT
)
RULE_ORDER = Kind("rule-order", "an earlier rule matches the same name", Group.EFFECT)


@dataclass(frozen=True)
class _Case:
    """One rule, one node to which the rule may apply, and what is known about both."""

    rule: Rule
    number: int
    node: str
    rules: Sequence[Rule]
    used: Collection[str]
    """The names of the topics that the node uses."""
    nodes: Sequence[str]
    wanted: str
    given: Collection[str] | None
    """The full names that the node's code gives to its topics, before any rule is applied; None if not known."""

    @property
    def said(self) -> str:
        return f"The rule `{self.rule.text}` changed nothing:"

    @property
    def left(self) -> str:
        return full_name(self.rule.left, self.node)

    @property
    def right(self) -> str:
        return full_name(self.rule.right, self.node)

    def is_for(self, rule: Rule) -> bool:
        """Whether a rule is for the node."""
        return rule.prefix in ("", self.node.rsplit("/", 1)[-1])

    def makes(self, name: str) -> list[Rule]:
        """Return the rules for the node that can have produced a name."""
        return [rule for rule in self.rules if self.is_for(rule) and full_name(rule.right, self.node) == name]

    def in_code(self, name: str) -> bool:
        """Whether the node's code gives a name.

        If the names in the code are not known, the code is assumed to give those that no rule can have produced.
        """
        if self.given is not None:
            return name in self.given
        return name in self.used and not self.makes(name)


def full_name(name: str, node: str) -> str:
    """Return the full name to which `name` expands in `node`."""
    if name.startswith("/"):
        return name
    if name.startswith("~"):
        return node + name[1:]
    return f"{node.rsplit('/', 1)[0]}/{name}"


def without_effect(
    rules: Sequence[str],
    wanted: str,
    nodes: Sequence[str],
    topics: Sequence[str] | Mapping[str, Collection[str]],
    in_code: Mapping[str, Collection[str]] | None = None,
) -> Reason | None:
    """Return why no rule produced the topic or service name `wanted`, although a rule was meant to.

    Args:
        rules: the rules of one program, in the order in which they were given.
        wanted: the full name that should be on the graph.
        nodes: the full names of the nodes on the graph.
        topics: the full names of topics, with the nodes that use each; a sequence means that all nodes use them.
        in_code: the full names that topics have in the code, before any rule is applied, with the nodes that use
            them; None if they are not known. The graph does not show whether a name comes from a rule or from the
            code.
    """
    users = topics if isinstance(topics, Mapping) else dict.fromkeys(topics, nodes)
    read = [rule for rule in map(parse, rules) if rule and rule.renames_topics]

    def of(node: str, known: Mapping[str, Collection[str]]) -> list[str]:
        return [name for name, by in known.items() if node in by]

    cases = [
        _Case(rule, number, node, read, of(node, users), nodes, wanted, None if in_code is None else of(node, in_code))
        for number, rule in enumerate(read)
        for node in _own_nodes(rules, nodes)
    ]
    meant = [case for case in cases if case.right == wanted and case.node not in users.get(wanted, ())]
    reasons = itertools.chain((why(case) for why in _REASONS for case in meant), map(_away, cases), map(_beside, cases))
    return next(filter(None, reasons), None)


def _beside(case: _Case) -> Reason | None:
    """Return the reason if a rule produced a name that is not the wanted one only because of how its right side begins.

    The wanted name would appear if the right side began differently: with or without `~/` or a slash.
    """
    right, made, space = case.rule.right, case.right, case.node.rsplit("/", 1)[0]
    if case.given is not None and case.left not in case.given:
        return None
    if not case.is_for(case.rule) or case.left in case.used or made not in case.used:
        return None
    if case.rule.kind == "service" or case.makes(made) != [case.rule]:
        return None
    said = f"The rule `{case.rule.text}` makes `{made}`:"
    if right.startswith("~/") and full_name(right[2:], case.node) == case.wanted:
        return PRIVATE_RULE(
            f"{said} its right side begins with `~`, so it is below the node's own name.",
            "Write the right side (in a launch file, `to`) without `~/`: then it is below the namespace.",
        )
    if space and right.startswith("/") and full_name(right[1:], case.node) == case.wanted:
        return ABSOLUTE_RULE(
            f"{said} its right side begins with a slash, so it does not follow the namespace `{space}`.",
            "Write the right side (in a launch file, `to`) without the leading slash: then it follows the namespace.",
        )
    if space and f"/{right}" == case.wanted:
        return TOPIC_NAME(
            f"{said} its right side does not begin with a slash, so it is below the namespace `{space}`.",
            f"Begin it with a slash, `{case.wanted}`, or leave out what the namespace gives already.",
        )
    return None


def _away(case: _Case) -> Reason | None:
    """Return the reason if the wanted name is on the rule's left side.

    Then either the rule took the name away, or the old and the new name are swapped.
    """
    left, right, rule = case.left, case.right, case.rule
    if not case.is_for(rule) or left != case.wanted or left in case.used or right not in case.used:
        return None
    if any(other is not rule for other in case.makes(right)):
        return None
    if case.given is None:
        return RULE_TAKES_NAME(
            f"The rule `{rule.text}` makes `{right}` of the name `{left}`: `{right}` is there, and `{left}` is not.",
            f"If the code gives the name `{left}`, leave the rule out. If it gives `{right}`, old and new are swapped: "
            f"`{rule.right}:={rule.left}`.",
        )
    if case.in_code(left):
        return RULE_TAKES_NAME(
            f"The rule `{rule.text}` took the name away: the code gives `{left}`, and the rule made `{right}` of it.",
            f"Leave the rule out, or give the right side (in a launch file, `to`) the name that is expected: `{left}`.",
        )
    if not case.in_code(right):
        return None
    return RULE_WITHOUT_MATCH(
        f"{case.said} nothing is called `{left}`, the name on its left side, and `{right}`, the one on its right, "
        "is there: old and new are swapped.",
        f"The name in the code stands on the left (in a launch file, in `from`): `{rule.right}:={rule.left}`.",
    )


def _own_nodes(rules: Sequence[str], nodes: Sequence[str]) -> list[str]:
    """Return the nodes that can belong to the program with these rules."""
    found = list(nodes)
    for rule in map(parse, rules):
        if rule and rule.left in ("__node", "__name") and not rule.prefix:
            found = [node for node in found if node.rsplit("/", 1)[-1] == rule.right]
        elif rule and rule.left == "__ns" and not rule.prefix:
            found = [node for node in found if (node.rsplit("/", 1)[0] or "/") == rule.right]
    return found or list(nodes)


def _other_kind(case: _Case) -> Reason | None:
    if not case.is_for(case.rule) or case.rule.kind != "service" or not case.in_code(case.left):
        return None
    return RULE_KIND(
        f"{case.said} `rosservice://` makes it a rule for services, and `{case.left}` is a topic.",
        "Leave `rosservice://` out: then the rule is for topics and services.",
    )


def _prefix(case: _Case) -> Reason | None:
    names = [node.rsplit("/", 1)[-1] for node in case.nodes]
    if case.is_for(case.rule) or case.rule.prefix in names or case.rule.kind == "service":
        return None
    if not case.in_code(case.left):
        return None
    return RULE_PREFIX(
        f"{case.said} it is for a node named `{case.rule.prefix}`, and no node on the graph has that name "
        f"(the nodes are {', '.join(case.nodes)}).",
        "The prefix of a rule is the name that the node has now, after `__node`, not the one in its code.",
    )


def _order(case: _Case) -> Reason | None:
    if not case.is_for(case.rule) or case.rule.kind == "service":
        return None
    for earlier in case.rules[: case.number]:
        same = case.is_for(earlier) and full_name(earlier.left, case.node) == case.left
        if same and earlier.kind != "service":
            made = full_name(earlier.right, case.node)
            matched = case.makes(made) == [earlier] if case.given is None else case.in_code(case.left)
            if made not in case.used or not matched:
                return None
            return RULE_ORDER(
                f"{case.said} `{earlier.text}` comes before it and matches the same name, and the first rule wins.",
                "Only the first rule that matches a name counts.",
            )
    return None


def _chain(case: _Case) -> Reason | None:
    if not case.is_for(case.rule) or case.left not in case.used or case.rule.kind == "service":
        return None
    others = [rule for rule in case.makes(case.left) if rule is not case.rule and rule.kind != "service"]
    if not others or (case.given is not None and case.in_code(case.left)):
        return None
    return RULES_DO_NOT_CHAIN(
        f"{case.said} no entity has the name `{case.left}` in its code; `{others[0].text}` made it. Rules do not "
        "chain: what one rule makes is not looked at by the next.",
        "The left side is the name that the code gives. The first rule that matches it wins.",
    )


def _absolute_rule(case: _Case) -> Reason | None:
    if not _idle(case) or not case.rule.left.startswith("/"):
        return None
    here = full_name(case.rule.left.lstrip("/"), case.node)
    if not case.in_code(here):
        return None
    return ABSOLUTE_RULE(
        f"{case.said} its left side is the absolute name `{case.left}`, and the name is `{here}` here.",
        "Write the left side without the leading slash: then it follows the namespace.",
    )


def _private_rule(case: _Case) -> Reason | None:
    tail = case.left.rsplit("/", 1)[-1]
    private = f"{case.node}/{tail}"
    if not _idle(case) or case.rule.left.startswith("~") or not case.in_code(private):
        return None
    return PRIVATE_RULE(
        f"{case.said} `{case.left}` is not the name of the private topic `~/{tail}`; that is `{private}` here.",
        f"Write `~/{tail}` on the left side: it follows the node's name.",
    )


def _absolute_name(case: _Case) -> Reason | None:
    fixed = f"/{case.rule.left}"
    if not _idle(case) or case.rule.left[:1] in ("/", "~") or fixed == case.left or not case.in_code(fixed):
        return None
    return ABSOLUTE_NAME(
        f"{case.said} the name in the code is absolute, `{fixed}`, and the rule looks for `{case.left}`.",
        "A name with a leading slash is absolute: no namespace reaches it. Write it without the slash.",
    )


def _no_match(case: _Case) -> Reason | None:
    if not _idle(case) or not case.used:
        return None
    close = nearest(case.left, [name for name in case.used if case.in_code(name)])
    return RULE_WITHOUT_MATCH(
        f"{case.said} nothing is called `{case.left}`, the name on its left side"
        + (f"; the nearest name is `{close}`." if close else "."),
        "Compare the left side with the name in the code, letter by letter. ROS 2 does not warn about such a rule.",
    )


def _idle(case: _Case) -> bool:
    """Whether the rule applies to topics of the node, matches none, and no earlier rule matches the same name."""
    if (
        case.rule.kind == "service"
        or not case.is_for(case.rule)
        or case.left in case.used
        or case.left in (case.given or ())
    ):
        return False
    before = [rule for rule in case.rules[: case.number] if case.is_for(rule) and rule.kind != "service"]
    return all(full_name(rule.left, case.node) != case.left for rule in before)


_REASONS: tuple[Callable[[_Case], Reason | None], ...] = (
    _order, _chain, _prefix, _other_kind, _absolute_rule, _private_rule, _absolute_name, _no_match,
)  # fmt: skip


def node_without_effect(rules: Sequence[str], wanted: str, nodes: Sequence[str]) -> Reason | None:
    """Return why a rule for one node of a process, which was meant to produce the node name `wanted`, had no effect.

    Args:
        rules: the rules of one program, in the order in which they were given.
        wanted: the full name that should be on the graph and is not.
        nodes: the full names of the nodes on the graph.
    """
    space, _, base = wanted.rpartition("/")
    for rule in map(parse, rules):
        if rule and rule.renames_topics and rule.right == base:
            return RULE_KIND(
                f"The rule `{rule.text}` renames topics and services, and no node.",
                f"A node's name is given with `__node`: `-r __node:={base}`.",
            )
    names, spaces = {node.rpartition("/")[2] for node in nodes}, {node.rpartition("/")[0] for node in nodes}
    for rule in map(parse, rules):
        if rule is None or not rule.prefix:
            continue
        said = f"The rule `{rule.text}` changed nothing:"
        if rule.left in ("__node", "__name") and rule.prefix == base and rule.right in names:
            return RULE_TAKES_NAME(
                f"The rule `{rule.text}` gives the node `{base}` the name `{rule.right}`: `{rule.right}` is there, and "
                f"`{base}` is not.",
                f"If the code calls the node `{base}`, leave the rule out. If it calls it `{rule.right}`, old and new "
                f"are swapped: `{rule.right}:__node:={base}`.",
            )
        if rule.left in ("__node", "__name") and rule.right == base and base not in names:
            return RULE_PREFIX(
                f"{said} no node is called `{rule.prefix}` in its code (the nodes are {', '.join(nodes)}).",
                "The prefix of a `__node` rule is the name that the code gives to the node's constructor.",
            )
        if rule.left == "__ns" and rule.right.rstrip("/") == space and space not in spaces:
            return RULE_PREFIX(
                f"{said} it is for a node named `{rule.prefix}`, and no node on the graph has that name (the nodes are "
                f"{', '.join(nodes)}).",
                "The prefix of a `__ns` rule is the name that the node has now, after `__node`.",
            )
    return None


def renames_nothing(parameter_rules: Sequence[str], wanted: str) -> Reason | None:
    """Return why a rule after `-p` whose value is the wanted name did not produce that name.

    Args:
        parameter_rules: the parameter rules of one program, each as `name:=value`.
        wanted: the full name of a node, a topic or a service that should be on the graph and is not.
    """
    for text in parameter_rules:
        value = text.partition(":=")[2].strip("'\"")
        if value and value in (wanted, wanted.removeprefix("/"), wanted.rpartition("/")[2]):
            return RULE_KIND(
                f"`-p {text}` gives a parameter its first value; it renames nothing.",
                "Names are changed with `-r`: `__node:=NEW` for a node, `__ns:=/NEW` for a namespace, `OLD:=NEW` for a "
                "topic or service.",
            )
    return None
