"""Parts of a page that are folded until a reader wants them.

The comment `<!-- fold: what is inside -->` folds what comes after it, up to the next heading. It is a comment, because
a notebook and a code host show the page unfolded. A link to the heading above a fold opens it, and paper shows what is
inside (see `_static/folds.js`).
"""

from __future__ import annotations

import html
import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

FOLD = re.compile(r"<!-- fold: (.+?) -->\s*")


def on_read(app: Sphinx, doctree: nodes.document) -> None:
    """Put an HTML element around each part that is folded."""
    for comment in list(doctree.findall(nodes.raw)):
        fold = FOLD.fullmatch(comment.rawsource or comment.astext())
        if fold is None:
            continue
        section, begin = comment.parent, comment.parent.index(comment)
        headings = (at for at, child in enumerate(section.children) if at > begin and isinstance(child, nodes.section))
        end = next(headings, len(section.children))
        section.insert(end, nodes.raw("", "</details>", format="html"))
        title = html.escape(fold[1])
        section[begin] = nodes.raw("", f'<details class="part"><summary>{title}</summary>', format="html")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("doctree-read", on_read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
