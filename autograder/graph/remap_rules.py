"""What a remap rule does to a node's names, and why one did nothing: the rules of rcl (Jazzy), told to a student.

Measured on rclpy 7.1.6. A rule is matched against a *full* name, the one the code gives after namespace and node name
are settled. The first rule that matches a name wins, and its result is not looked at again. The prefix of a
node-specific rule is the name that the node has after `__node`; only for `__node` itself it is the name in the code.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from autograder.graph.names import nearest

Reason = tuple[str, str, str]
"""Why (a sentence), a short stable word for it, and what to do."""

_NAMESPACE, _NODE = ("__ns",), ("__node", "__name")


@dataclass(frozen=True)
class Rule:
    """`PREFIX:LEFT:=RIGHT`, as it stands after `-r`."""

    text: str
    prefix: str
    left: str
    right: str

    @property
    def renames_topics(self) -> bool:
        """Whether it is about topics and services, and not about the node itself."""
        return self.left not in _NAMESPACE + _NODE


def parse(text: str) -> Rule | None:
    """Read a rule; None without a `:=`."""
    left, separator, right = text.partition(":=")
    if not separator:
        return None
    match = re.fullmatch(r"([A-Za-z_]\w*):(?!//)(.+)", left)
    return Rule(text, match[1] if match else "", match[2] if match else left, right)


def rules_in(words: Sequence[str]) -> list[str]:
    """The remap rules of a command line, in its order."""
    return [after for word, after in itertools.pairwise(words) if word in ("-r", "--remap")]


def refused(rules: Sequence[str]) -> Reason | None:
    """The first rule that rcl cannot read: it ends the program at `rclpy.init`."""
    for text in rules:
        rule = parse(text)
        if rule is None:
            return f"`{text}` is not a remap rule: it has no `:=`.", "rule-form", "A rule is `old:=new`."
        said = f"The rule `{text}` is refused, and the program ends at `rclpy.init`:"
        if rule.left in _NODE and "/" in rule.right:
            return (
                f"{said} a node name has no slash.",
                "slash-in-node-name",
                "The node's name and its namespace are two things: `__node:=name` and `__ns:=/namespace`.",
            )
        if any(token[:1].isdigit() for token in rule.right.split("/")):
            return (
                f"{said} no part of a name may begin with a digit.",
                "begins-with-digit",
                "Put a word in front: `camera_2` instead of `2_camera`.",
            )
        if rule.left in _NAMESPACE and not rule.right.startswith("/"):
            return (
                f"{said} a namespace on the command line begins with a slash.",
                "namespace-without-slash",
                f"Write `{rule.left}:=/{rule.right}`.",
            )
        if rule.left in _NAMESPACE and rule.right.endswith("/") and rule.right != "/":
            return f"{said} a namespace does not end with a slash.", "namespace-end", "Leave the last slash out."
        if "*" in rule.left:
            return f"{said} `*` is not implemented in remap rules.", "wildcard", "Write one rule for each name."
        if not re.fullmatch(r"(~/|/)?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", rule.right) and rule.right not in ("/", "~"):
            return (
                f"{said} `{rule.right}` is not a name.",
                "name-characters",
                "Names have letters, digits and underscores, with slashes between their parts.",
            )
    return None


def without_effect(rules: Sequence[str], wanted: str, nodes: Sequence[str], topics: Sequence[str]) -> Reason | None:
    """Why no rule made the topic or service `wanted`, although one was meant to.

    Args:
        rules: in the order in which they were given.
        wanted: the full name that should be there.
        nodes: full names of the nodes on the graph.
        topics: full names that these nodes use.
    """
    read = [rule for rule in map(parse, rules) if rule and rule.renames_topics]
    for number, rule in enumerate(read):
        for node in nodes:
            if _expand(rule.right, node) != wanted:
                continue
            left, said = _expand(rule.left, node), f"The rule `{rule.text}` changed nothing:"
            own = node.rsplit("/", 1)[-1]
            if rule.prefix and rule.prefix not in [name.rsplit("/", 1)[-1] for name in nodes]:
                return (
                    f"{said} it is for a node named `{rule.prefix}`, and after `__node` no node has that name "
                    f"(the nodes are {', '.join(nodes)}).",
                    "rule-prefix",
                    "The prefix of a rule is the name that the node has now, not the one in its code.",
                )
            earlier = [other for other in read[:number] if _expand(other.left, node) == left]
            if earlier:
                return (
                    f"{said} `{earlier[0].text}` stands before it and matches the same name, and the first rule wins.",
                    "rule-order",
                    "Only the first rule that matches a name counts.",
                )
            if any(other is not rule and _expand(other.right, node) == left for other in read):
                return (
                    f"{said} no entity has the name `{left}` in its code. Rules do not chain: what one rule makes is "
                    "not looked at by the next.",
                    "rules-do-not-chain",
                    "The left side is the name that the code gives. The first rule that matches it wins.",
                )
            if rule.left.startswith("/") and any(name != left and name.endswith(left) for name in topics):
                return (
                    f"{said} its left side is the absolute name `{left}`, and the name is "
                    f"`{next(name for name in topics if name != left and name.endswith(left))}` here.",
                    "absolute-rule",
                    "Write the left side without the leading slash: then it follows the namespace.",
                )
            tail = left.rsplit("/", 1)[-1]
            if f"{node}/{tail}" in topics and own not in left.split("/"):
                return (
                    f"{said} `{left}` is not the name of the private topic `~/{tail}`; that is `{node}/{tail}` here.",
                    "private-rule",
                    f"Write `~/{tail}` on the left side: it follows the node's name.",
                )
            if rule.prefix and rule.prefix != own:
                continue
            fixed = [name for name in topics if name != left and left.endswith(name)]
            if left not in topics and fixed and not rule.left.startswith("/"):
                return (
                    f"{said} the name in the code is absolute, `{fixed[0]}`, and the rule looks for `{left}`.",
                    "absolute-name",
                    "A name with a leading slash is absolute: no namespace reaches it. Write it without the slash.",
                )
            if left not in topics:
                close = nearest(left, [name for name in topics if name != wanted])
                return (
                    f"{said} nothing is called `{left}`, the name on its left side"
                    + (f"; the nearest name is `{close}`." if close else "."),
                    "rule-without-match",
                    "Compare the left side with the name in the code, letter by letter. ROS 2 does not warn about such "
                    "a rule.",
                )
    return None


def _expand(name: str, node: str) -> str:
    """The full name that `name` stands for in `node`."""
    name = re.sub(r"^(rostopic|rosservice)://", "", name)
    if name.startswith("/"):
        return name
    if name.startswith("~"):
        return node + name[1:]
    return f"{node.rsplit('/', 1)[0]}/{name}"
