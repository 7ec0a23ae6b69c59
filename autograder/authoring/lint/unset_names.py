"""Names that a check sets in a `with` block and uses after it.

A launch or a part that fails ends its block early, and the check goes on below it. If a name was to be set in the rest
of the block, the check would break there, and a student would be flagged for the author's mistake.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence


def bound(tree: ast.AST) -> Iterator[str]:
    """Yield the names that a piece of code binds: variables, functions, classes, arguments and imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.id
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.alias):
            yield (node.asname or node.name).partition(".")[0]
        elif isinstance(node, ast.ExceptHandler) and node.name:
            yield node.name


def left_unset(body: Sequence[ast.stmt], known: set[str]) -> Iterator[str]:
    """Yield sentences about names that are set only in a `with` block, which a failure ends early, and used after it.

    What is below an `if` that asks for a name which the block sets last is left out: it is not reached then.

    Args:
        body: the statements of a cell or of a block.
        known: names that are set before them. Those that the statements set are added.
    """
    for number, statement in enumerate(body):
        if isinstance(statement, ast.With):
            made = {name for item in statement.items if item.optional_vars for name in bound(item.optional_vars)}
            inside = {name for one in statement.body for name in _set_in(one)}
            yield from _used_after(body[number + 1 :], inside - known - made, inside & known)
            yield from left_unset(statement.body, known | made)
        elif isinstance(statement, (ast.For, ast.If)):
            yield from left_unset(statement.body, known | set(_set_in(statement)))
        known |= set(_set_in(statement))


def _used_after(body: Sequence[ast.stmt], unset: set[str], guards: set[str]) -> Iterator[str]:
    for statement in body:
        if isinstance(statement, ast.If) and guards & {one.id for one in _names_in(statement.test)}:
            continue
        for name in sorted(unset & {one.id for one in _names_in(statement)}):
            first = min(
                (one for one in _names_in(statement) if one.id == name), key=lambda one: (one.lineno, one.col_offset)
            )
            if isinstance(first.ctx, ast.Load):
                yield (
                    f"line {first.lineno}: `{name}` is set only in a block above, which ends early if something in it"
                    " fails. Set it before the block."
                )
            unset = unset - {name}


def _set_in(statement: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement sets, without those that exist only in a comprehension."""
    return (one.id for one in _names_in(statement) if isinstance(one.ctx, ast.Store))


def _names_in(tree: ast.AST) -> Iterator[ast.Name]:
    """Yield the names in a statement, without those of a comprehension's or a lambda's own."""
    if isinstance(tree, ast.Name):
        yield tree
    hidden: set[str] = set()
    if isinstance(tree, (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)):
        hidden = {name for one in tree.generators for name in bound(one.target)}
    elif isinstance(tree, (ast.Lambda, ast.FunctionDef)):
        hidden = {one.arg for one in ast.walk(tree.args) if isinstance(one, ast.arg)}
    for child in ast.iter_child_nodes(tree):
        yield from (one for one in _names_in(child) if one.id not in hidden)
