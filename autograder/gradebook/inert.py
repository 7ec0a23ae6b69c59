"""Takes the life out of what students wrote, before it gets into a page of somebody else's."""

from __future__ import annotations

import re
from typing import Any

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
_FENCE = re.compile(r"^([ \t>*+\d.)-]*+)(`{3,}+|~{3,}+)[^`\n]*+$", re.MULTILINE)  # what was taken is never given back


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
