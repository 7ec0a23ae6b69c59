"""Takes the life out of what students wrote, before it gets into a page of somebody else's."""

from __future__ import annotations

import re
import secrets
from typing import Any

from nbconvert.preprocessors.sanitize import SanitizeHTML
from nbgrader import utils
from nbgrader.preprocessors import NbGraderPreprocessor

UNDECIDED = "The grader could not find out. No points are taken: an instructor decides."
"""What stands in the output of a check without a verdict."""


class InertAnswers(NbGraderPreprocessor):  # type: ignore[misc]
    """Takes the life out of HTML in students' Markdown, which feedback and formgrader would put into their pages.

    A word joiner, which is invisible, parts every `<` from what would make it a tag. Unlike escaping it reads the same
    in text and in code.
    """

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Part the tags in an answer cell; the lab's own text stays as it is."""
        if cell.cell_type != "code" and utils.is_solution(cell):
            cell.source = inert(cell.source)
        return cell, resources


_BLANKS = 200
"""Longer rows of blanks in an answer are shortened to this many."""
_FORMULAS = 100
"""Formulas of LaTeX's longer spellings that are shown as such in an answer."""
_FORMULA = re.compile(r"(\\begin(?=\{)|\\\\(?=[\[(]))")
_FENCE = re.compile(r"^([ \t>*+\d.)-]*)(`{3,}|~{3,})[^`\n]*$", re.MULTILINE)


def inert(markdown: str) -> str:
    """Return Markdown in which nothing can become a tag, a script link or a picture from elsewhere."""
    return inert_text(re.sub(r"<(?=[A-Za-z/!?])", "<\u2060", markdown))


def inert_text(markdown: str) -> str:
    """Return Markdown in which nothing but tags can become a script link, a drawing or a picture from elsewhere."""
    # nbconvert hands such a block to a drawing program in the browser, as it stands: it fetches pictures, too.
    markdown = markdown.replace("mermaid", "m\u2060ermaid")
    # For each of many blanks the Markdown reader looks at all that follow: 60000 take it a quarter of a minute.
    markdown = re.sub(f" {{{_BLANKS},}}", " " * _BLANKS, markdown)
    # So it does for the beginning of a formula that does not end: 20000 take it a quarter of a minute.
    *first, rest = _FORMULA.split(markdown, _FORMULAS)
    markdown = "".join(first) + _FORMULA.sub("\\1\u2060", rest)
    # Without the name of a language code is not coloured, which takes half a minute for 20000 lines of a blank.
    markdown = _FENCE.sub(r"\1\2", markdown)
    # What a browser fetches by itself would tell its owner who reads the page.
    parted = markdown.replace("![", "!\u2060[")
    # Only links that plainly begin with http stay links: there are too many ways to spell the other schemes.
    return re.sub(r"\](?=(\(|:)(?!\s*https?://))", "]\u2060", parted)


_PICTURE = re.compile(
    r'<img alt="[^"<>]*" src="data:image/svg\+xml;base64,[A-Za-z0-9+/=]*" '
    r'style="background:#ffffff; max-width:100%; height:auto">'
)
"""A picture of a report, letter for letter: an `<img>` runs nothing and fetches nothing, whatever its SVG says."""


class SanitizeOutputs(SanitizeHTML):  # type: ignore[misc]
    """nbconvert's sanitizer for what students wrote and for outputs; the lab's own text may hold code with `<`."""

    def sanitize_html_tags(self, html_str: str) -> str:
        """Sanitize as nbconvert does, but let the pictures of reports stand: its sanitizer knows no `data:`."""
        word = f"picture {secrets.token_hex(16)} "
        pictures = _PICTURE.findall(html_str)
        numbers = iter(range(len(pictures)))
        clean = str(super().sanitize_html_tags(_PICTURE.sub(lambda _: f"{word}{next(numbers)}.", html_str)))
        for number, picture in enumerate(pictures):
            clean = clean.replace(f"{word}{number}.", picture)
        return clean

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Sanitize outputs, which the kit wrote, once more; answers are inert already and are made so again."""
        if cell.cell_type != "code":
            if utils.is_solution(cell):
                cell.source = inert(cell.source)
            return cell, resources
        for output in cell.outputs:
            if output.output_type == "error":
                output.traceback = [UNDECIDED]
        cell.outputs = self.sanitize_code_outputs(cell.outputs)
        return cell, resources
