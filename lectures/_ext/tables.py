"""Tables in a narrow window: each row becomes a block, in which every cell says which column it is of.

The name of the column stands in each cell and is shown on a phone only, in place of the head row; see book.css.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx


def on_resolved(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Write the names of the columns into the cells."""
    if app.builder.name != "html":
        return
    for table in doctree.findall(nodes.table):
        heads = [entry.astext() for head in table.findall(nodes.thead) for entry in head.findall(nodes.entry)]
        if not heads:
            continue
        table["classes"].append("stacks")
        for row in next(table.findall(nodes.tbody)).children:
            for head, entry in zip(heads, row.children, strict=False):
                if head and entry.astext():
                    entry.insert(0, nodes.paragraph("", head, classes=["column"]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("doctree-resolved", on_resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
