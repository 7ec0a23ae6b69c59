"""Remap rules as rcl (Jazzy) has them: read, refused with a reason, and asked why one did nothing."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from autograder.arguments.rule_effect import full_name, without_effect
from autograder.arguments.rule_grammar import Rule, parse, why_parameter_refused, why_remap_refused
from autograder.arguments.rule_kind import node_without_effect, renames_nothing
from autograder.reasons import Reason

__all__ = [
    "Rule",
    "full_name",
    "node_without_effect",
    "parameter_rules_in",
    "parse",
    "refused",
    "refused_parameter",
    "renames_nothing",
    "rules_in",
    "without_effect",
]


def rules_in(words: Sequence[str]) -> list[str]:
    """The remap rules of a command line, in its order."""
    return [after for word, after in itertools.pairwise(words) if word in ("-r", "--remap")]


def parameter_rules_in(words: Sequence[str]) -> list[str]:
    """The parameter rules of a command line, in its order."""
    return [after for word, after in itertools.pairwise(words) if word in ("-p", "--param")]


def refused(rules: Sequence[str]) -> Reason | None:
    """Why the first rule that rcl does not take is refused; it ends the program at its start."""
    return next((reason for reason in map(why_remap_refused, rules) if reason), None)


def refused_parameter(words: Sequence[str]) -> Reason | None:
    """Why the first parameter rule of a command line that rcl does not take is refused; it ends the program, too."""
    ros = words[words.index("--ros-args") :] if "--ros-args" in words else []
    return next((reason for reason in map(why_parameter_refused, parameter_rules_in(ros)) if reason), None)
