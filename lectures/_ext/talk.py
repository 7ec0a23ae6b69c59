"""The links between a deck and its page of the book, and figures that can be enlarged.

The role `slides` links to a lecture's talk, as in `` {slides}`lecture 2 <02_executors>` ``. The talks are built beside
the book.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import ReferenceRole

LECTURES = Path(__file__).resolve().parent.parent
_FIGURE = re.compile(r'<img ([^>]*?)src="data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)"([^>]*)>')

_FILE = re.compile(r'(<a [^>]*>)?(<img [^>]*?src="([^":]+\.svg)"[^>]*>)')


class Slides(ReferenceRole):
    """The role `slides`: a link from a page of the book to a talk."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        """Make the link; what is no talk ends the build."""
        if not (LECTURES / "slides" / f"{self.target}.md").exists():
            raise ExtensionError(f"{self.env.docname}: there are no slides {self.target}")
        above = "../" * (self.env.docname.count("/") + 1)
        return [nodes.reference("", self.title, refuri=f"{above}slides/{self.target}.html", internal=True)], []


def on_page(app: Sphinx, pagename: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Tell the theme where the other form of a lecture is, and make each figure of the book a link to its file.

    A phone shows a figure as wide as its page; opened by itself it can be enlarged.
    """
    talks = (LECTURES / "slides" / f"{pagename}.md").exists() and pagename != "index"
    context["talk"] = app.builder.name == "revealjs" and app.env.metadata.get(pagename, {}).get("talk")
    context["slides"] = f"../slides/{pagename}.html" if talks else ""
    context["book"] = f"../book/{pagename}.html"
    if app.builder.name != "html" or "body" not in context:
        return
    folder = Path(app.outdir) / "_images"
    above = "../" * pagename.count("/")

    def linked(found: re.Match[str]) -> str:
        svg = base64.b64decode(found[2])
        name = f"{hashlib.sha256(svg).hexdigest()[:16]}.svg"
        folder.mkdir(exist_ok=True)
        (folder / name).write_bytes(svg)
        where = f"{above}_images/{name}"
        return f'<a class="figure" href="{where}"><img {found[1]}src="{where}"{found[3]}></a>'

    body = _FILE.sub(lambda found: found[0] if found[1] else f'<a class="figure" href="{found[3]}">{found[2]}</a>',
                     context["body"])  # fmt: skip
    context["body"] = _FIGURE.sub(linked, body)


def on_doctree(app: Sphinx, doctree: nodes.document) -> None:
    """Let the book's links to the source of a talk, as the repository has them, lead to the talk that was built."""
    above = "../" * (app.env.docname.count("/") + 1)
    for link in list(doctree.findall(addnodes.pending_xref)):
        folder, _, talk = link["reftarget"].partition("/")
        if link.get("refdomain") == "doc" and folder == "slides":
            link.replace_self(nodes.reference("", "", *link.children, refuri=f"{above}slides/{talk}.html"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.add_role("slides", Slides())
    app.connect("html-page-context", on_page)
    app.connect("doctree-read", on_doctree)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
