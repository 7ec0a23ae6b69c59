"""Statements that a cell of the page asserts: marked where they stand, held where the cell stands.

In the text the role {measured}`key` follows such a statement. A cell of the page says `assert ..., "key"`. A key that
stands only on one side is a warning, which ends the build. That each assertion fails when its statement is made false
is held by tests/lectures/test_lecture_claims.py.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxRole

ASSERTED = re.compile(r'^assert .*?, "([a-z0-9-]+)"$', re.MULTILINE)
MARKED = re.compile(r"\{measured\}`([a-z0-9-]+)`")
logger = logging.getLogger(__name__)


class Measured(SphinxRole):
    """A mark that leads to the cell at the end of the page."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        """Make the link."""
        link = nodes.reference("", "measured", internal=True, refid="what-this-page-measured", classes=["measured"])
        return [link], []


def on_read(app: Sphinx, docname: str, source: list[str]) -> None:
    """Compare what is marked with what is asserted."""
    if docname == "instructors/write_a_lecture":
        return  # it explains how a lecture is written, and shows a mark without a cell
    marked, asserted = set(MARKED.findall(source[0])), set(ASSERTED.findall(source[0]))
    for key in sorted(marked ^ asserted):
        where = "marked in the text, and no cell asserts it" if key in marked else "asserted, and no text says it"
        logger.warning("the statement %r is %s", key, where, location=docname)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.add_role("measured", Measured())
    app.connect("source-read", on_read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
