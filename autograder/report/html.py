"""Show a result as HTML, for notebooks and feedback pages, with inline styles only and with all values escaped.

Each verdict is shown as a word, a symbol and a colour, so that it can be read in print, on a dark page and with any
colour vision. Only symbols and borders have colours, which are those of Okabe and Ito. Text has the colour of the page.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from autograder.core.output import last_lines, plain
from autograder.core.results import CellResult, Outcome, Status
from autograder.course.settings import NO_BOOK, Book, Section
from autograder.report import words
from autograder.report.audience import Audience, check_for
from autograder.report.words import Verdict

_PIECE = re.compile(r";\s+|(?<=[.?!])\s+(?=[A-Z`])")


@dataclass(frozen=True)
class Hint:
    """A hint. The hint after it tells more."""

    text: str
    section: Section | None = None
    """The section of a lecture in which to read more."""


def hints(outcome: Outcome, book: Book) -> list[Hint]:
    """Return an outcome's hints. The first ones tell least: where to read more. Then follows what to look at or do."""
    pieces = [piece.strip() for piece in _PIECE.split(outcome.hint) if piece.strip()]
    pointing = [(piece, book.named_in(piece)) for piece in pieces]
    read = [Hint(_sentence(text), section) for text, section in pointing if section is not None]
    section = book.sections.get(outcome.code)
    if not read and section is not None:
        read = [Hint(f"{section}.", section)]
    named = {hint.text for hint in read}
    return [*read, *(Hint(text) for text in map(_sentence, pieces) if text not in named)]


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "?", "!", ":", "…", "`")) else f"{text}."


_LOOK = {
    Verdict.PASSED: {"colour": "#009e73", "border": "3px solid"},
    Verdict.HOLDS: {"colour": "#0072b2", "border": "3px solid"},
    Verdict.PARTLY: {"colour": "#d55e00", "border": "5px double"},
    Verdict.FAILED: {"colour": "#d55e00", "border": "5px double"},
    Verdict.NOT_ATTEMPTED: {"colour": "#767676", "border": "3px dotted"},
    Verdict.UNKNOWN: {"colour": "#b3588c", "border": "3px dashed"},
}
_VERDICT = {Status.FAILED: Verdict.FAILED, Status.UNKNOWN: Verdict.UNKNOWN, Status.PASSED: Verdict.PASSED}

# JupyterLab's own colours, so that a dark theme stays dark. The second colour of each is for pages without a theme.
_INK = "var(--jp-content-font-color1, #1a1a1a)"
_FAINT = "var(--jp-content-font-color2, #555555)"
_LINE = "var(--jp-border-color1, #bdbdbd)"
_CODE_STYLE = "white-space:pre-wrap; color:inherit; background:var(--jp-layout-color2, #eeeeee); padding:0 3px"

LOG_LINES = 40
"""The number of lines of a program's output that are shown under a failed check."""


def _code(text: str) -> Markup:
    """Escape a text, and set the parts between backticks in code type."""
    pieces = plain(text).split("`")
    if len(pieces) % 2 == 0:
        return escape(plain(text))
    marked = [
        Markup('<code style="{}">{}</code>').format(_CODE_STYLE, piece) if number % 2 else escape(piece)
        for number, piece in enumerate(pieces)
    ]
    return Markup("").join(marked)


def _shown(value: Any) -> Any:
    """Make a value safe for a page, because even names may contain characters that change the direction of text."""
    return plain(value) if type(value) is str else value


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("autograder.report", "templates"),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["code"] = _code
    environment.filters["shown"] = lambda picture: Markup(picture.html())
    environment.globals |= {"looks": _LOOK, "symbols": words.SYMBOL, "words": _VERDICT, "code_style": _CODE_STYLE}
    environment.globals |= {"hints_of": hints, "ink": _INK, "faint": _FAINT, "line": _LINE}
    return environment


def render(template: str, **values: Any) -> str:
    """Fill in a template of this package. Every value is escaped."""
    return _environment().get_template(template).render(**values)


def check_html(
    check: CellResult,
    audience: Audience = "student",
    *,
    title: str = "",
    remarks: Sequence[str] = (),
    origin: str = "",
    fold_pictures: bool = False,
    on_demand: bool = False,
    book: Book = NO_BOOK,
) -> str:
    """Return a check's report as an HTML fragment: first the findings, then the collapsed list of what holds.

    Args:
        check: the result to show.
        audience: the reader. A student does not see what hidden tests check.
        title: the title of the check; empty if there is a heading above the report.
        remarks: what the student should know about the cells that the programs came from.
        origin: the cells that the programs came from, in words.
        fold_pictures: whether pictures are collapsed, because other checks on the page are more important.
        on_demand: whether hints open one after the other, for a student who still works on the lab.
        book: the course's lectures, to which hints on demand link.
    """
    shown = _each_thing_once(check_for(check, audience))
    verdict, found = words.verdict(shown), words.findings(shown)
    lost, again = words.said_once(found)
    cut = [log.model_copy(update={"text": last_lines(log.text, LOG_LINES)}) for log in shown.logs if log.text.strip()]
    return render(
        "check.html",
        title=title,
        check=shown,
        verdict=verdict,
        points=words.points(shown),
        not_attempted=words.not_attempted(shown),
        remarks=remarks,
        findings=Markup(
            render(
                "findings.html",
                bad=found.bad,
                lost=lost,
                again=again,
                not_looked_at=found.not_looked_at,
                on_demand=on_demand,
                book=book,
                fold_pictures=fold_pictures,
            )
        ),
        folded=verdict is Verdict.NOT_ATTEMPTED,
        passed=found.passed,
        held=found.held,
        holding=words.holding(found),
        pictured=[one for one in shown.outcomes if one.status is Status.PASSED and one.picture is not None],
        logs=cut if shown.status is not Status.PASSED else [],
        origin=origin,
    )


def _each_thing_once(check: CellResult) -> CellResult:
    """Leave out a picture or hint that an earlier finding has, because several expectations may check the same run."""
    seen: set[str] = set()
    outcomes = []
    for outcome in check.outcomes:
        if outcome.picture is not None and outcome.picture.svg in seen:
            outcome = outcome.model_copy(update={"picture": None})
        if outcome.hint in seen:
            outcome = outcome.model_copy(update={"hint": ""})
        seen |= {outcome.hint} | ({outcome.picture.svg} if outcome.picture is not None else set())
        outcomes.append(outcome)
    return check.model_copy(update={"outcomes": outcomes})
