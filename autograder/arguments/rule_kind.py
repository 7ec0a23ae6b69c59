"""Why no rule gave a node, a topic or a service its name: the rule is for something else.

Measured on rclpy 7.1.6. The prefix of a `__node` rule is the name in the code; that of any other rule is the name that
the node has after `__node`.
"""

from __future__ import annotations

from collections.abc import Sequence

from autograder.arguments.rule_effect import RULE_PREFIX, RULE_TAKES_NAME
from autograder.arguments.rule_grammar import RULE_KIND, parse
from autograder.reasons import Reason


def node_without_effect(rules: Sequence[str], wanted: str, nodes: Sequence[str]) -> Reason | None:
    """Why a rule for one node of a process, which was meant to make the node `wanted`, made nothing.

    Args:
        rules: of one program, in the order in which they were given.
        wanted: the full name that should be there, and is not.
        nodes: full names of the nodes on the graph.
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
    """Why `-p`, given the name that should be there for a value, did not make it.

    Args:
        parameter_rules: of one program, `name:=value` each.
        wanted: the full name of a node, a topic or a service that should be there, and is not.
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
