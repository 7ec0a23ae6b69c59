"""Cut a lecture into slides that fit a projector of 1280 x 720 pixels.

The book shows all of a notebook. A slide has no scroll bar, so this extension (for the builder `revealjs` only)

- leaves out what is in a container of class `book`, folded cells, and folded inputs (their outputs stay);
- puts the blocks of a section on as many slides as they need, by an estimate of their heights in pixels;
- divides listings, outputs, lists and tables that are higher than a slide.

A container of class `slide` is left out of the book instead.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from myst_nb.sphinx_ import HideCodeCellNode
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator
from sphinx_revealjs.nodes import revealjs_break
from sphinx_revealjs.writers import RevealjsSlideTranslator

# The measures below belong to deck.css; they assume a wide font, so that a narrow one fits too.
ROOM = 600  # pixels below a slide's heading
WIDTH = 1168  # pixels between the margins
LEAST_FIGURE = 360  # a figure is not shrunk below this height to share a slide
LEAST_LISTING = 220  # nor does a listing begin in less room than this
TEXT_LINE, TEXT_COLUMNS, TEXT_GAP = 38, 74, 16
CODE_LINE, CODE_COLUMNS, CODE_GAP = 26, 93, 34
ROW_LINE, ROW_COLUMNS, ROW_GAP = 29, 102, 15
ADMONITION = 70  # title, padding and margin

logger = logging.getLogger(__name__)


class SlideTranslator(RevealjsSlideTranslator):
    """Write listings as the book does, so that both share one style and no script is needed."""

    visit_literal_block = HTML5Translator.visit_literal_block
    depart_literal_block = HTML5Translator.depart_literal_block


def lines(text: str, columns: int) -> int:
    """Return how many lines a text takes when it wraps after so many characters."""
    return sum(max(1, math.ceil(len(line) / columns)) for line in text.splitlines() or [""])


def height(node: nodes.Node, columns: int = TEXT_COLUMNS) -> int:
    """Return about how many pixels a block needs on a slide."""
    if isinstance(node, (nodes.comment, nodes.target, nodes.Invisible)):
        return 0
    if isinstance(node, nodes.literal_block):
        return lines(node.astext(), CODE_COLUMNS) * CODE_LINE + CODE_GAP
    if isinstance(node, nodes.table):
        return sum(row_height(row) for row in node.findall(nodes.row)) + TEXT_GAP
    if isinstance(node, nodes.image):
        return min(LEAST_FIGURE, full_height(node)) + TEXT_GAP
    if isinstance(node, nodes.raw):
        return LEAST_FIGURE if "<img" in node.astext() or "<svg" in node.astext() else 0
    if isinstance(node, (nodes.bullet_list, nodes.enumerated_list, nodes.definition_list)):
        return sum(height(item, columns - 6) for item in node.children) + TEXT_GAP
    if isinstance(node, (nodes.paragraph, nodes.term, nodes.title, nodes.rubric)):
        gap = TEXT_GAP // 2 if isinstance(node.parent, nodes.list_item) else TEXT_GAP
        return lines(node.astext().replace("\n", " "), columns) * TEXT_LINE + gap
    extra = ADMONITION if isinstance(node, nodes.Admonition) else 0
    return extra + sum(height(child, columns) for child in node.children)


def row_height(row: nodes.row) -> int:
    """Return about how many pixels a table row needs; columns share the width as their content asks."""
    table = next(parent for parent in ancestors(row) if isinstance(parent, nodes.table))
    rows = [[entry.astext() for entry in other.children] for other in table.findall(nodes.row)]
    needs = [max(min(len(cell), 60) for cell in column) + 3 for column in zip(*rows, strict=False)]
    share = min(1.0, ROW_COLUMNS / sum(needs))
    cells = [entry.astext() for entry in row.children]
    most = max(lines(cell, max(8, int(need * share) - 3)) for cell, need in zip(cells, needs, strict=False))
    return most * ROW_LINE + ROW_GAP


def ancestors(node: nodes.Node) -> Iterator[nodes.Element]:
    """Return the elements around a node, the nearest first."""
    parent = node.parent
    while parent is not None:
        yield parent
        parent = parent.parent


def full_height(image: nodes.image) -> int:
    """Return how high a picture is when it is as wide as a slide, or as high as one."""
    return min(ROOM - TEXT_GAP, int(WIDTH * image.get("aspect", 1.0)))


def note_aspects(doctree: nodes.document, folder: Path) -> None:
    """Write height / width into each picture, read from its file (SVG or PNG)."""
    for image in doctree.findall(nodes.image):
        start = (folder / image["uri"]).read_bytes()[:4096]
        if start.startswith(b"\x89PNG"):
            width, height_ = struct.unpack(">II", start[16:24])
        else:
            box = re.search(rb'viewBox="([^"]+)"', start)
            width, height_ = map(float, box[1].split()[2:]) if box else (1, 1)
        image["aspect"] = height_ / width


def blocks(parent: nodes.Element) -> Iterator[nodes.Element]:
    """Return what a slide shows of a section, a notebook cell taken apart into listing and outputs."""
    for node in parent.children:
        if isinstance(node, HideCodeCellNode) or "book" in node.get("classes", ()):
            continue
        kind = node.get("nb_element")
        if kind in ("cell_code", "cell_code_source", "cell_code_output") or "slide" in node.get("classes", ()):
            for inner in blocks(node):
                yield inner if kind in (None, "cell_code") else wrapped(node, [inner])
        elif isinstance(node, nodes.container) and len(node.children) == 1:
            yield from blocks(node)
        else:
            yield node


def wrapped(like: nodes.Element, children: list[nodes.Node]) -> nodes.Element:
    """Return an empty copy of an element with these children."""
    copy = like.copy()
    copy += children
    return copy


def pieces(block: nodes.Element, room: int) -> Iterator[nodes.Element]:
    """Return a block as parts that are no higher than a slide, the first part of a listing no higher than `room`."""
    if height(block) <= room:
        yield block
    elif isinstance(block, nodes.container) and len(block.children) == 1:
        for part in pieces(block.children[0], room):
            yield wrapped(block, [part])
    elif isinstance(block, nodes.literal_block):
        text = block.astext().splitlines()
        while text:
            most = (room - CODE_GAP) // CODE_LINE
            end = cut(text, most)
            if 0 < len(text) - end < 6:  # not the last few lines alone
                end = cut(text, most - 6)
            part = block.copy()
            part += nodes.Text("\n".join(text[:end]))
            part.rawsource = part.astext()
            yield part
            text = text[end:]
            room = ROOM
    elif isinstance(block, nodes.table):
        yield from table_pieces(block)
    elif isinstance(block, (nodes.bullet_list, nodes.enumerated_list, nodes.definition_list)):
        start = 1
        for group in grouped(list(block.children), [height(item, TEXT_COLUMNS - 6) for item in block.children], 0):
            part = wrapped(block, group)
            if isinstance(block, nodes.enumerated_list):
                part["start"] = start
                start += len(group)
            yield part
    elif height(block) <= ROOM:
        yield block
    else:
        logger.warning("a block is higher than a slide and cannot be divided: %.60r", block.astext())
        yield block


def cut(text: list[str], most: int) -> int:
    """Return where to divide a listing: the last blank line of a slide's worth, before a definition if possible."""
    room, end = most, 0
    while end < len(text) and (room := room - lines(text[end], CODE_COLUMNS)) >= 0:
        end += 1
    end = max(end, 1)
    if end == len(text):
        return end
    blank = [number for number in range(end // 3, end + 1) if not text[min(number, len(text) - 1)].strip()]
    return blank[-1] if blank else end


def grouped(items: list[Any], heights: list[int], extra: int) -> list[list[Any]]:
    """Return items in as few groups as fit slides, of about the same height; each group needs `extra` pixels more."""
    fewest = len(filled(items, heights, ROOM - extra))
    room = sum(heights) // fewest
    while len(groups := filled(items, heights, room)) > fewest:
        room += 10
    return groups


def filled(items: list[Any], heights: list[int], room: int) -> list[list[Any]]:
    """Return items in groups, each as full as `room` pixels allow."""
    groups: list[list[Any]] = []
    used = 0
    for item, need in zip(items, heights, strict=True):
        if not groups or used + need > room:
            groups.append([])
            used = 0
        groups[-1].append(item)
        used += need
    return groups


def table_pieces(table: nodes.table) -> Iterator[nodes.table]:
    """Return a table as several, each with the heading row."""
    head = sum(row_height(row) for thead in table.findall(nodes.thead) for row in thead.children) + TEXT_GAP
    body = next(table.findall(nodes.tbody))
    rows = list(body.children)
    for group in grouped(list(range(len(rows))), [row_height(row) for row in rows], head):
        part = table.deepcopy()
        body = next(part.findall(nodes.tbody))
        body.children = [row for number, row in enumerate(body.children) if number in group]
        yield part


def paginate(section: nodes.Element) -> None:
    """Replace a section's own blocks by slides; its sub-sections, which follow, get slides of their own."""
    subsections = [node for node in section.children if isinstance(node, nodes.section)]
    title = [node for node in section.children if isinstance(node, nodes.title)]
    own = section.copy()
    own.children = [node for node in section.children if node not in subsections and node not in title]
    result: list[nodes.Node] = []
    page: list[nodes.Element] = []
    used = 0

    def close() -> None:
        nonlocal page, used
        images = [image for block in page for image in block.findall(nodes.image)]
        for image in images:
            most = LEAST_FIGURE + (ROOM - used) // len(images)
            image["height"] = f"{min(most, full_height(image))}px"
            image.attributes.pop("width", None)
        result.extend(page)
        page, used = [], 0

    for block in blocks(own):
        # A new slide for what does not fit here, but not one that leaves a lone line behind.
        alone = len(page) == 1 and leads(page[0]) and ROOM - used >= LEAST_LISTING
        for part in pieces(block, ROOM - used if alone else ROOM):
            need = height(part)
            if page and used + need > ROOM:
                # A line of text goes with what it leads to, an output with the text that explains it.
                carried = page[-1:] if len(page) > 1 and (leads(page[-1]) or short_output(page[-1])) else []
                page = page[: len(page) - len(carried)]
                used -= sum(height(block) for block in carried)
                close()
                result.append(revealjs_break())
                page, used = carried, sum(height(block) for block in carried)
            page.append(part)
            used += need
    close()
    section.children = []
    section += title + result + subsections
    for subsection in subsections:
        paginate(subsection)
        if len(subsection.children) == 1:  # its title: what it says is for the book only
            section.remove(subsection)


def leads(block: nodes.Element) -> bool:
    """Return whether a block is a short text before what it announces."""
    return isinstance(block, nodes.paragraph) and height(block) <= 2 * TEXT_LINE + TEXT_GAP


def short_output(block: nodes.Element) -> bool:
    """Return whether a block is a cell's output of a few lines of text."""
    return block.get("nb_element") == "cell_code_output" and not any(block.findall(nodes.image)) and height(block) < 260


def on_resolved(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Prepare a document for the builder that is about to write it."""
    if app.builder.name == "revealjs":
        note_aspects(doctree, Path(app.srcdir))
        if app.env.metadata[docname].get("talk"):  # its author has cut it
            return
        for section in [node for node in doctree.children if isinstance(node, nodes.section)]:
            paginate(section)
    else:
        for node in [node for node in doctree.findall(nodes.container) if "slide" in node["classes"]]:
            node.parent.remove(node)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.set_translator("revealjs", SlideTranslator, override=True)
    app.connect("doctree-resolved", on_resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
