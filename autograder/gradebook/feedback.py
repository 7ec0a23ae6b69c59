"""The course's own stages of `nbgrader generate_feedback`: the page that a student gets to read."""

from __future__ import annotations

import re
from typing import Any, ClassVar

from jinja2.bccache import Bucket, BytecodeCache
from nbconvert.filters import Highlight2HTML
from nbconvert.preprocessors import CSSHTMLHeaderPreprocessor
from nbgrader import utils
from nbgrader.preprocessors import ClearMarkScheme, GetGrades

from autograder.gradebook.inert import SanitizeOutputs
from autograder.gradebook.private_nbconvert import LeanHTMLExporter
from autograder.gradebook.released_notebook import HideTests


class HideMarkScheme(ClearMarkScheme):  # type: ignore[misc]
    """Keeps mark schemes out of feedback."""

    def preprocess_cell(self, cell: Any, resources: dict[str, Any], index: int) -> tuple[Any, dict[str, Any]]:
        """Cut in the lab's own cells; a student who types a marker only types a word."""
        if utils.is_solution(cell):
            return cell, resources
        made: tuple[Any, dict[str, Any]] = super().preprocess_cell(cell, resources, index)
        return made


class _CompiledTemplates(BytecodeCache):
    """Keeps templates compiled from one feedback page to the next."""

    def __init__(self) -> None:
        self._codes: dict[str, bytes] = {}

    def load_bytecode(self, bucket: Bucket) -> None:
        if bucket.key in self._codes:
            bucket.bytecode_from_string(self._codes[bucket.key])

    def dump_bytecode(self, bucket: Bucket) -> None:
        self._codes[bucket.key] = bucket.bytecode_to_string()


_TOO_LONG_TO_COLOUR = re.compile(r"\s{200}|\S{400}")
"""No program looks like that, and the time that Pygments takes for it grows with the square of its length."""


_LONGEST_KEPT, _MOST_KEPT = 10_000, 1000
"""Characters of a cell, and cells, that are kept coloured."""


class ColouredCode(Highlight2HTML):  # type: ignore[misc]
    """nbconvert's colouring of code, for what a person wrote; the rest is shown as plain text."""

    kept: ClassVar[dict[tuple[str, str | None, str], Any]] = {}
    """HTML by source, language and metadata."""

    def __call__(self, source: str, language: str | None = None, metadata: Any = None) -> Any:
        """Return the HTML of a code cell; most cells of a class's notebooks are the lab's, and coloured once."""
        if len(source) > _LONGEST_KEPT:
            return self._colour(source, language, metadata)
        cell = source, language, repr(metadata)
        if cell not in self.kept:
            if len(self.kept) >= _MOST_KEPT:
                self.kept.clear()
            self.kept[cell] = self._colour(source, language, metadata)
        return self.kept[cell]

    def _colour(self, source: str, language: str | None, metadata: Any) -> Any:
        return super().__call__(source, "text" if _TOO_LONG_TO_COLOUR.search(source) else language, metadata)


class FeedbackExporter(LeanHTMLExporter):
    """The page that a student gets to read."""

    compiled = _CompiledTemplates()

    def colour(self) -> ColouredCode:
        """Return what colours the code of the page."""
        return ColouredCode(pygments_lexer="ipython3", parent=self)


FEEDBACK = [GetGrades, HideTests, HideMarkScheme, SanitizeOutputs, CSSHTMLHeaderPreprocessor]
