"""Writes the reference pages from the kit itself, so that they cannot say something else than the code does.

In a page, a line `<!-- generated: NAME -->` is replaced by what the code says of itself:

- `check api`: what a check cell can say, from its signatures and docstrings;
- `reason codes`: every reason code with what it must have seen, from the registry of reasons;
- `layers`: the folders of the package in the order in which they may import each other.
"""

from __future__ import annotations

import importlib
import inspect
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from check_api import check_api
from docutils import nodes
from reason_codes import ROOT, reason_codes
from sphinx.application import Sphinx


def layers() -> str:
    """The folders and modules of the package from the top down, as import-linter holds them, each with its purpose."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(one for one in settings["tool"]["importlinter"]["contracts"] if one["type"] == "layers")
    lines = ["| folder or module | what it is for |", "|---|---|"]
    for layer in contract["layers"]:
        for name in re.findall(r"\w+", layer):  # `one | other` stand beside each other and do not use each other
            about = (inspect.getdoc(importlib.import_module(f"autograder.{name}")) or "").split("\n\n")[0]
            lines.append(f"| `{name}` | {' '.join(about.split())} |")
    return "\n".join(lines)


PARTS: dict[str, Callable[[], str]] = {"check api": check_api, "reason codes": reason_codes, "layers": layers}


def on_read(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put what is generated in the place of the line that asks for it."""
    for name, make in PARTS.items():
        line = f"<!-- generated: {name} -->"
        if line in source[0]:
            source[0] = source[0].replace(line, make())
            kit = (ROOT / "autograder").rglob("*.py")
            made_from = [*Path(__file__).parent.glob("*.py"), *kit, *ROOT.glob("labs/*/*.ipynb")]
            for path in (ROOT / "pyproject.toml", ROOT / "course.toml", *made_from):
                app.env.note_dependency(str(path))


def on_doctree(app: Sphinx, doctree: nodes.document) -> None:
    """Leave out what a cell showed only while it ran: how long it has been waiting for what."""
    for block in list(doctree.findall(nodes.literal_block)):
        if not block.astext().strip():
            block.parent.remove(block)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("source-read", on_read)
    app.connect("doctree-read", on_doctree)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
