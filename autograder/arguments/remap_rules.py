"""Reads remap rules and parameter rules on a command line as rcl (Jazzy) does, and says why it refuses one.

A text is cut into lexemes from left to right, and the lexemes must follow one another in a fixed order:

    remap rule:     [token ":"]  ("__node" | "__name") ":=" token
                    [token ":"]  "__ns" ":=" "/" [token {"/" token} ["/"]]
                    [token ":"]  ["rostopic://" | "rosservice://"] name ":=" name
    name:           ["~/" | "/"] token {"/" token}
    parameter rule: [token ":"]  part {"." part} ":=" value, where a part has tokens and slashes in any order
    token:          letters, digits and single underscores; it begins with neither a digit nor two underscores

rcl reads the value of a parameter rule as YAML: one plain value, or a list of values of one type.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import yaml

from autograder.reasons import Group, Kind, Reason

RULE_FORM = Kind("rule-form", "a rule has no `:=`, or two of them", Group.RULES)
PARAMETER_VALUE = Kind(
    "parameter-value",
    "the parameter has another value or type, or a value on the command line cannot be read",
    Group.STATES,
)
NAME_FORM = Kind("name-form", "`~` is in a place where it has no meaning, or the text is not a name", Group.RULES)
NAMESPACE_WITHOUT_SLASH = Kind("namespace-without-slash", "the new namespace does not begin with a slash", Group.RULES)
NAMESPACE_END = Kind("namespace-end", "the new namespace ends with a slash", Group.RULES)
RULE_SPECIAL = Kind("rule-special", "`__node` or `__ns` is misspelt, or something else is in their place", Group.RULES)
RULE_SCHEME = Kind("rule-scheme", "`rostopic://` or `rosservice://` is on the right side", Group.RULES)
RULE_COLON = Kind("rule-colon", "the text before a single `:` is not the name of a node", Group.RULES)
BEGINS_WITH_DIGIT = Kind("begins-with-digit", "a part of a name begins with a digit", Group.RULES)
NAME_EMPTY = Kind("name-empty", "a side of the rule is empty", Group.RULES)
NAME_SPACE = Kind("name-space", "a name contains a space", Group.RULES)
WILDCARD = Kind("wildcard", "a rule has a `*`, which ROS 2 does not implement", Group.RULES)
NAME_SLASH = Kind("name-slash", "a slash or a dot is not followed by a part of a name", Group.RULES)
NAME_CHARACTERS = Kind("name-characters", "a name contains a character that is not allowed", Group.RULES)
DOUBLE_UNDERSCORE = Kind("double-underscore", "two underscores follow one another in a name", Group.RULES)
RULE_KIND = Kind("rule-kind", "the rule is for names of another kind, or gives a parameter its value", Group.EFFECT)
SLASH_IN_NODE_NAME = Kind("slash-in-node-name", "the new name of a node has a slash", Group.RULES)

_BOOLS = {
    word for small in ("y", "yes", "true", "on", "n", "no", "false", "off")
    for word in (small, small.capitalize(), small.upper())
}  # fmt: skip
_INTEGER = re.compile(r"\s*[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_DOUBLE = re.compile(
    r"\s*[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|0[xX][0-9a-fA-F]+(\.[0-9a-fA-F]*)?([pP][+-]?[0-9]+)?"
    r"|\.?inf|infinity|nan)|\.nan",
    re.IGNORECASE,
)

_LONGEST_INTEGER = 1000
"""The number of characters from which a number is not read as an integer."""

# rcl reads a comma behind a tag as a part of the tag.
_TAG = re.compile(r"(![\w-]*),")
LIBYAML = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The library with which rcl reads YAML. It treats tabs and colons differently from PyYAML's own reader."""


def why_value_refused(value: str) -> str | None:
    """Return why rcl does not accept a text as a value, as a sentence; None if it does."""
    shown = f"`{value[:60]}`"
    if not value:
        return "it has no value."
    kinds: list[str] = []
    depth = 0
    try:
        for event in yaml.parse(_TAG.sub(r"\1", value), Loader=LIBYAML):
            match event:
                case yaml.AliasEvent() | yaml.MappingStartEvent():
                    what = "an alias" if isinstance(event, yaml.AliasEvent) else "`key: value`"
                    return f"{shown} is {what} in YAML, which cannot be the value of a parameter."
                case yaml.SequenceStartEvent():
                    depth += 1
                case yaml.SequenceEndEvent():
                    depth -= 1
                case yaml.ScalarEvent():
                    bare = event.style not in ("'", '"')
                    if depth and bare and ":" in event.value:
                        return f"in the list {shown}, a text with a colon has to be in quotes."
                    if not event.value and bare:
                        return f"{shown} is empty in YAML."
                    if depth:
                        plain = event.style in (None, "") and event.tag != "tag:yaml.org,2002:str"
                        kinds.append(_kind(event.value, plain=plain))
    except (yaml.YAMLError, RecursionError):
        return f"{shown} is not YAML."
    if len(set(kinds)) > 1:
        return f"in {shown}, the values are of several types: {', '.join(dict.fromkeys(kinds))}."
    return None


def _kind(value: str, *, plain: bool) -> str:
    if not plain:
        return "text"
    if value in _BOOLS:
        return "bool"
    # Python does not read a number with thousands of digits, and rcl does not read one that long as an integer.
    if len(value) < _LONGEST_INTEGER and _INTEGER.fullmatch(value) and -(2**63) <= _integer(value) < 2**63:
        return "integer"
    return "double" if _DOUBLE.fullmatch(value) else "text"


def _integer(value: str) -> int:
    return int(value, 16 if "x" in value.lower() else 10)


_LEXEMES = re.compile(
    r"(?P<scheme>rostopic://|rosservice://)|(?P<node>__node|__name)|(?P<ns>__ns)|(?P<private>~/)"
    r"|(?P<token>(?!__)(?=[A-Za-z_])(?:_?[A-Za-z0-9]+)*_?)|(?P<separator>:=)|(?P<colon>:)|(?P<slash>/)|(?P<dot>\.)"
    r"|(?P<wild>\*\*?)|(?P<back>\\[1-9])|(?P<other>.)",
    re.DOTALL | re.ASCII,
)


@dataclass(frozen=True)
class Rule:
    """A remap rule, `PREFIX:LEFT:=RIGHT`, as it is written after `-r`."""

    text: str
    prefix: str
    left: str
    """The left side without `rostopic://` and `rosservice://`."""
    right: str
    kind: str = ""
    """`topic` or `service` if the rule is for one of them only."""

    @property
    def renames_topics(self) -> bool:
        """Whether the rule renames topics and services, and not the node itself."""
        return self.left not in ("__ns", "__node", "__name")


def parse(text: str) -> Rule | None:
    """Read a remap rule, even one that rcl refuses; return None if the text has no `:=`."""
    left, separator, right = text.partition(":=")
    if not separator:
        return None
    match = re.fullmatch(r"([A-Za-z_]\w*):(?!//)(.+)", left, re.ASCII)
    prefix, name = (match[1], match[2]) if match else ("", left)
    for scheme, kind in (("rostopic://", "topic"), ("rosservice://", "service")):
        if name.startswith(scheme):
            return Rule(text, prefix, name.removeprefix(scheme), right, kind)
    return Rule(text, prefix, name, right)


def namespace_of(rules: Iterable[str]) -> str:
    """Return the namespace in which a program is started, without a slash at the end; empty if no rule gives one."""
    named = [rule.right for rule in map(parse, rules) if rule and rule.left == "__ns" and not rule.prefix]
    return named[0].rstrip("/") if named else ""


def _shape(text: str) -> str:
    """Return the lexemes of a text as a word with one letter for each lexeme."""
    letters = {
        "scheme": "u", "node": "N", "ns": "S", "private": "~", "token": "t", "separator": "=", "colon": ":",
        "slash": "/", "dot": ".", "wild": "*", "back": "\\", "other": "?",
    }  # fmt: skip
    return "".join(letters[str(match.lastgroup)] for match in _LEXEMES.finditer(text))


_REMAP = re.compile(r"(t:)?(N=t|S=/(t/)*t?|u?[~/]?t(/t)*=[~/]?t(/t)*)")
_PARAMETER = re.compile(r"(t:)?[t/]+(\.[t/]+)*")


def why_remap_refused(text: str) -> Reason | None:
    """Return why rcl refuses a remap rule; None if it does not.

    rcl refuses it in `rclpy.init`, or, because of the namespace in it, when the node is created.
    """
    rule = parse(text)
    if rule is None:
        return RULE_FORM(f"`{text}` is not a remap rule: it has no `:=`.", "A rule is `old:=new`.")
    ends_in_slash = rule.left == "__ns" and rule.right.endswith("/") and rule.right != "/"
    if _REMAP.fullmatch(_shape(text)) and not ends_in_slash:
        return None
    found = _of_node(rule) or _of_names(rule) or _of_form(rule)
    return replace(found, because=f"The rule `{text}` is refused, and the program ends at its start: {found.because}")


def _of_node(rule: Rule) -> Reason | None:
    """Return what is wrong with the new name or namespace of a node."""
    right = rule.right
    if rule.left in ("__node", "__name"):
        if "/" in right:
            return SLASH_IN_NODE_NAME(
                "a node name has no slash.",
                "The node's name and its namespace are two things: `__node:=name` and `__ns:=/namespace`.",
            )
        return _of_name(right, "the new name of the node")
    if rule.left != "__ns":
        return None
    if right and not right.startswith("/"):
        return NAMESPACE_WITHOUT_SLASH(
            "a namespace on the command line begins with a slash.",
            f"Write `__ns:=/{right.lstrip('~/')}`." if right.lstrip("~/") else "Write `__ns:=/name`.",
        )
    if right.endswith("/") and right.strip("/"):
        return NAMESPACE_END("a namespace does not end with a slash.", "Leave the last slash out.")
    return _of_name(right, "the namespace")


def _of_names(rule: Rule) -> Reason | None:
    """Return what is wrong with the names in a rule for topics and services."""
    if not rule.renames_topics:
        return None
    if rule.left.lower() in ("__ns", "__node", "__name", "__namespace", "ns", "_ns", "_node") and "__" in rule.left:
        return RULE_SPECIAL(
            f"`{rule.left}` means nothing there: the node's name is given with `__node` and its namespace with `__ns`.",
            "Write these words with two underscores and small letters.",
        )
    if rule.right.startswith(("rostopic://", "rosservice://")):
        return RULE_SCHEME(
            "`rostopic://` and `rosservice://` are allowed on the left side only.",
            "Leave the word out on the right side.",
        )
    if ":" in rule.left:
        before = rule.left.rsplit(":", 1)[0]
        return RULE_COLON(
            f"a single `:` ends the name of the node that the rule is for, and `{before}` is not a node name.",
            "Write one name of a node, without slash, then `:`, then the old name: `NODE:old:=new`.",
        )
    if re.fullmatch(r"[+-]?\d[\d.]*", rule.right):
        return BEGINS_WITH_DIGIT(
            "a number is not a name, but `-r` gives a new name.",
            f"A parameter gets its value with `-p`: `-p {rule.text}`.",
        )
    return _of_name(rule.left, "the left side", left=True) or _of_name(rule.right, "the right side")


def _of_name(name: str, what: str, left: bool = False) -> Reason | None:
    """Return what is wrong with one name; None if it is a valid name."""
    bare = name[2:] if name.startswith("~/") else name.removeprefix("/")
    parts = bare.split("/")
    if not name:
        return NAME_EMPTY(f"{what} is empty.", "A rule is `old:=new`, without spaces around `:=`.")
    if ":=" in name:
        return RULE_FORM(
            f"there is a second `:=` in {what}.",
            "Every rule has its own `-r`: `-r old:=new -r old2:=new2`.",
        )
    if name.strip() != name or any(character.isspace() for character in name):
        return NAME_SPACE(f"{what} contains a space.", "Write the rule as one word, without spaces around `:=`.")
    if left and "*" in name:
        return WILDCARD("`*` is not implemented in remap rules.", "Write one rule for each name.")
    if re.search(r"\\[1-9]", name):
        return WILDCARD(
            "numbers with a backslash, which stand for what a `*` has matched, are not implemented.",
            "Write one rule for each name.",
        )
    if name in ("~", "~/", "/"):
        return NAME_FORM(f"{what} is `{name}`, which is not a name by itself.", "Write a name after it: `~/name`.")
    if "~" in bare or (name.startswith("~") and not name.startswith("~/")):
        return NAME_FORM(
            f"in {what}, `~` is not at the beginning, or no slash follows it.",
            "`~/name` is a name below the node's own; elsewhere `~` means nothing.",
        )
    if any(part == "" for part in parts):
        where = "ends with a slash" if name.endswith("/") and "//" not in name else "has two slashes in a row"
        return NAME_SLASH(f"{what} {where}.", "Write a slash only between two parts of a name.")
    return _of_parts(name, parts, what)


def _of_parts(name: str, parts: list[str], what: str) -> Reason | None:
    if any(part[0].isdigit() for part in parts):
        return BEGINS_WITH_DIGIT(
            "no part of a name may begin with a digit.",
            "Put a word in front: `camera_2` instead of `2_camera`.",
        )
    strange = re.search(r"[^A-Za-z0-9_/~]", name)
    if strange:
        return NAME_CHARACTERS(
            f"`{name}` is not a name, because a name cannot contain `{strange[0]}`.",
            "Names have letters from a to z, digits and underscores, with slashes between their parts.",
        )
    if "__" in name:
        return DOUBLE_UNDERSCORE(
            f"in {what}, `{name}`, two underscores follow one another.",
            "Use single underscores. Two of them belong to `__node` and `__ns`.",
        )
    return None


def _of_form(rule: Rule) -> Reason:
    if not rule.renames_topics or rule.left.startswith("__"):
        why = f"`{rule.left}` cannot be followed by `:={rule.right}`."
    else:
        why = f"`{rule.left}` and `{rule.right}` do not make a rule."
    return RULE_FORM(why, "A rule is `old:=new`, or `NODE:old:=new` for one node.")


def why_parameter_refused(text: str) -> Reason | None:
    """Return why rcl refuses the name or the value in a parameter rule, `NAME:=VALUE` after `-p`."""
    name, separator, value = text.partition(":=")
    said = f"The parameter rule `{text}` is refused, and the program ends at its start:"
    if not separator:
        return RULE_FORM(f"`{text}` is not a parameter rule: it has no `:=`.", "A parameter rule is `name:=value`.")
    if not _PARAMETER.fullmatch(_shape(name)):
        found = _of_parameter(name)
        return replace(found, because=f"{said} {found.because}")
    wrong = why_value_refused(value)
    if wrong is None:
        return None
    return PARAMETER_VALUE(
        f"{said} {wrong}",
        "A value is a bool, a number, a text or a list such as `[1, 2]`, written as in YAML.",
    )


def _of_parameter(name: str) -> Reason:
    if not name:
        return NAME_EMPTY("it has no name.", "A parameter rule is `name:=value`.")
    if ":" in name and (name.startswith("/") or name.count(":") > 1):
        return RULE_COLON(
            "the text before the `:` has to be the name of a node, without slashes.",
            "Remove the node name; the value then applies to every node of the process. A parameter file can name one"
            " node.",
        )
    if "*" in name:
        return WILDCARD("`*` is not implemented there.", "Write one rule for each parameter.")
    bare = name.rsplit(":", 1)[-1]
    if any(part == "" for part in bare.split(".")):
        return NAME_SLASH("a part of the name is empty.", "Write a dot only between two parts of a name.")
    found = _of_parts(name, [part for part in re.split(r"[./]", bare) if part], "the name")
    if found and found.kind is BEGINS_WITH_DIGIT:
        return found
    strange = re.search(r"[^A-Za-z0-9_./:]", name)
    if strange:
        what = "a space" if strange[0].isspace() else f"`{strange[0]}`"
        return NAME_CHARACTERS(
            f"{what} is not allowed in the name of a parameter on a command line.",
            "Such names have letters from a to z, digits, underscores and dots.",
        )
    if name in ("__node", "__name", "__ns"):
        return RULE_KIND(f"`{name}` is not a parameter.", f"Names are changed with `-r`: `-r {name}:=NEW`.")
    return NAME_FORM(f"`{name}` is not a name.", "A parameter rule is `name:=value`.")


def rules_in(words: Sequence[str]) -> list[str]:
    """Return the remap rules of a command line, in its order."""
    return [after for word, after in itertools.pairwise(words) if word in ("-r", "--remap")]


def parameter_rules_in(words: Sequence[str]) -> list[str]:
    """Return the parameter rules of a command line, in its order."""
    return [after for word, after in itertools.pairwise(words) if word in ("-p", "--param")]


def refused(rules: Sequence[str]) -> Reason | None:
    """Return why rcl refuses the first rule that it does not accept. Such a rule ends the program at its start."""
    return next((reason for reason in map(why_remap_refused, rules) if reason), None)


def refused_parameter(words: Sequence[str]) -> Reason | None:
    """Return why rcl refuses the first parameter rule of a command line that it does not accept.

    Such a rule ends the program at start, too.
    """
    ros = words[words.index("--ros-args") :] if "--ros-args" in words else []
    return next((reason for reason in map(why_parameter_refused, parameter_rules_in(ros)) if reason), None)
