"""Of which packages the programs of a package import interfaces."""

from __future__ import annotations

import ast
from pathlib import Path


def imported_interfaces(sources: Path) -> dict[str, str]:
    """Return the packages whose messages, services or actions are imported, each with the first module that does.

    Args:
        sources: the package's folder below `src`. What is no Python in it imports nothing.
    """
    found: dict[str, str] = {}
    for path in sorted(sources.rglob("*.py")):
        try:
            tree = ast.parse(path.read_text("utf-8", "replace"))
        except (SyntaxError, ValueError):
            continue
        for name in (name for node in ast.walk(tree) for name in _imported(node)):
            package, kind = name.split(".")[0], name.split(".")[1:2]
            if kind in (["msg"], ["srv"], ["action"]):
                found.setdefault(package, path.name)
    return found


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and not node.level:
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []
