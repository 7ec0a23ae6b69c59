"""Programs in a lecture: a cell that begins with `%%node NAME` is shown as the file that it writes.

- Such a cell becomes a listing of its own language under the file's name; what the cell prints is left out.
- The directive `change` shows what has to be changed in one program of a page to get another one.
- What programs print is removed with the tag `remove-stdout`, as what a cell prints is.
- The directive `excerpt` shows a part of a program of a page of the book; slides use it.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

_LIB = Path(__file__).resolve().parent.parent / "_lib"
PRINTED = "<details open><summary>Output of <code>"
"""How a block begins in which a notebook shows what a program prints; to a page it is standard output."""
LANGUAGES = {"py": "python3", "yaml": "yaml", "json": "json", "xml": "xml", "cfg": "ini"}


def programs_of(page: Path) -> dict[str, str]:
    """The files that a page's cells write, by their names: `car.py`, `car.yaml`."""
    from lecture import programs  # what the kernels use, too

    found: dict[str, str] = programs(page)
    return found


def named(file_name: str, listing: nodes.literal_block) -> nodes.container:
    """A listing under the name of its file."""
    block = nodes.container(classes=["program"])
    block += nodes.paragraph("", "", nodes.literal(text=file_name), classes=["file-name"])
    block += listing
    return block


def listing_of(text: str, file_name: str) -> nodes.literal_block:
    """A listing in the language that the file's name tells."""
    listing = nodes.literal_block(text, text)
    listing["language"] = LANGUAGES.get(file_name.rpartition(".")[2], "text")
    return listing


class Change(SphinxDirective):
    """`{change} old new`: the lines that differ, with a line around them; `-` goes, `+` comes."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """Compare the two programs."""
        page = Path(self.env.doc2path(self.env.docname))
        texts = programs_of(page)
        old, new = (texts[name].splitlines() for name in self.arguments)
        lines = [
            line for line in difflib.unified_diff(old, new, n=1, lineterm="") if not line.startswith(("---", "+++"))
        ]
        text = "\n".join("…" if line.startswith("@@") else line for line in lines[1:])
        listing = nodes.literal_block(text, text)
        listing["language"] = "diff"
        return [named(f"{self.arguments[0]} → {self.arguments[1]}", listing)]


def opened(text: str) -> bool:
    """Whether a text opens more brackets than it closes."""
    return sum(text.count(sign) for sign in "([{") > sum(text.count(sign) for sign in ")]}")


class Excerpt(SphinxDirective):
    """`{excerpt} 02_executors car.py`: the lines from the first that holds `from` to the next that holds `to`.

    A statement that is longer than a line is shown to its end.
    """

    required_arguments = 2
    option_spec = {"from": directives.unchanged, "to": directives.unchanged}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """Cut the lines out."""
        page, file_name = self.arguments
        lines = programs_of(_LIB.parent / f"{page}.md")[file_name].splitlines()
        first = next(number for number, line in enumerate(lines) if self.options.get("from", "") in line)
        rest = lines[first:]
        if "to" in self.options:
            rest = rest[: next(number for number, line in enumerate(rest) if self.options["to"] in line) + 1]
            while opened("\n".join(rest)) and len(rest) < len(lines) - first:
                rest = lines[first : first + len(rest) + 1]
        indent = min(len(line) - len(line.lstrip()) for line in rest if line.strip())
        self.env.note_dependency(str(_LIB.parent / f"{page}.md"))
        return [named(file_name, listing_of("\n".join(line[indent:] for line in rest).strip("\n"), file_name))]


def on_doctree(app: Sphinx, doctree: nodes.document) -> None:
    """Show each cell that writes a file as that file; leave out the line that said what was waited for, now empty."""
    for listing in list(doctree.findall(nodes.literal_block)):
        if not listing.astext().strip():
            listing.parent.remove(listing)
            continue
        head = re.match(r"%%(node|file) (\S+)\n", listing.astext())
        if head is None:
            continue
        file_name = f"{head[2]}.py" if head[1] == "node" else head[2]
        listing.replace_self(named(file_name, listing_of(listing.astext()[head.end() :].strip("\n"), file_name)))
    for cell in list(doctree.findall(nodes.container)):
        if cell.get("nb_element") == "cell_code" and any(
            "program" in c["classes"] for c in cell.findall(nodes.container)
        ):
            for output in [c for c in cell.findall(nodes.container) if c.get("nb_element") == "cell_code_output"]:
                output.parent.remove(output)
        if "tag_remove-stdout" in cell["classes"]:
            for shown in [raw for raw in cell.findall(nodes.raw) if raw.astext().startswith(PRINTED)]:
                bundle = shown.parent if shown.parent.get("nb_element") == "mime_bundle" else shown
                bundle.parent.remove(bundle)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.add_directive("change", Change)
    app.add_directive("excerpt", Excerpt)
    app.connect("doctree-read", on_doctree)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
