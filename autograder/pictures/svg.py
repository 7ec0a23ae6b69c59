"""A small canvas that writes SVG: boxes, lines, arrows, text, and hatching for printing in black and white."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape

from autograder.core.results import Picture

TEXT = 18
"""The size of text in the units of a canvas. On a canvas that is WIDTH wide and fills a slide, text has at least 2.5 %
of the slide's height."""
SMALL = 16
WIDTH = 900.0
LETTER = 0.58
"""The approximate ratio of a letter's width to its height. It is not exact because an `<img>` cannot choose its
font."""

_DARK = {
    "#ffffff": "#1c1c1c",
    "#fff": "#1c1c1c",
    "#000000": "#f0f0f0",
    "#000": "#f0f0f0",
    "#444444": "#c4c4c4",
    "#555555": "#a8a8a8",
    "#bbbbbb": "#6a6a6a",
    "#e4e4e4": "#454545",
    "#f1f1f1": "#333333",
    "#f6f6f6": "#2a2a2a",
    "#9bd3f5": "#1f5f8b",
    "#f7c873": "#855600",
    "#8fd6bf": "#0b6b50",
    "#e6bfd5": "#7d4665",
    "#f4ee9c": "#645e00",
    "#d9d9d9": "#595959",
    "#f2b091": "#8f3d12",
}
"""The colours of all drawings, and what they become on a page that declares a dark colour scheme."""
_NARROW = 0.53
"""The ratio of a letter's width to its height in the names of nodes and topics, which have few capitals."""

FILLS = ("#9bd3f5", "#f7c873", "#8fd6bf", "#e6bfd5", "#f4ee9c", "#d9d9d9", "#f2b091")
"""The colours of Okabe and Ito, lightened so that black text on them is readable."""

_HATCHES = (
    "",
    "M0 10L10 0",
    "M0 0L10 10",
    "M0 10L10 0M0 0L10 10",
    "M5 0V10",
    "M0 5H10",
    "M5 0V10M0 5H10",
)


def width_of(text: str, size: float = TEXT) -> float:
    """Return the approximate width of a text."""
    return len(text) * size * LETTER


def _printable(text: str) -> str:
    """Return a text without unprintable characters, which XML or JSON may not allow.

    They can occur because a program can forge names.
    """
    return "".join(letter for letter in text if letter.isprintable())


def shortened(text: str, room: float, size: float = TEXT) -> str:
    """Return a text that fits into `room`. If it is too long, its middle is left out."""
    most = max(3, int(room / (size * LETTER)))
    if len(text) <= most:
        return text
    head = (most - 1) // 2
    return f"{text[:head]}…{text[len(text) - (most - 1 - head) :]}"


def in_lines(text: str, room: float, size: float = TEXT, lines: int = 2) -> list[str]:
    """Return a name in lines that fit into `room`, broken before a slash or after an underscore where this is possible.

    A name that is too long for all lines together is shortened in its middle.
    """
    most = max(3, int(room / (size * _NARROW)))
    found = [""]
    for piece in re.findall(r"/?[^/_ ]*[_ ]?", text):
        if len(found[-1]) + len(piece) <= most or not found[-1]:
            found[-1] += piece
        else:
            found.append(piece)
    if len(found) > lines or any(len(line) > most for line in found):
        short = shortened(text, most * lines * size * LETTER, size)  # which takes every letter for a wide one
        found = [short[first : first + most] for first in range(0, len(short), most)]
    return [line.strip() for line in found]


class Canvas:
    """A sheet on which shapes are drawn in order, the later ones above the earlier ones."""

    def __init__(self, height: float, width: float = WIDTH) -> None:
        """Begin with an empty sheet."""
        self.width, self.height = width, height
        self._parts: list[str] = []

    def box(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        *,
        look: int | None = None,
        fill: str = "#ffffff",
        line: float = 1.2,
        round: float = 0,
        dashed: bool = False,
    ) -> None:
        """Draw a rectangle; `look` is the number of a colour and a hatching."""
        if look is not None:
            fill = FILLS[look % len(FILLS)]
        shape = f'x="{x:.1f}" y="{y:.1f}" width="{max(width, 0.1):.1f}" height="{height:.1f}" rx="{round:g}"'
        dashes = ' stroke-dasharray="6 4"' if dashed else ""
        self._parts.append(f'<rect {shape} fill="{fill}" stroke="#000" stroke-width="{line:g}"{dashes}/>')
        if look is not None and _HATCHES[look % len(_HATCHES)]:
            self._parts.append(f'<rect {shape} fill="url(#h{look % len(_HATCHES)})" stroke="none"/>')

    def band(self, x: float, y: float, width: float, height: float, fill: str = "#f1f1f1") -> None:
        """Draw a rectangle without a border."""
        self._parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}"/>')

    def oval(self, x: float, y: float, width: float, height: float, line: float = 1.6, *, dashed: bool = False) -> None:
        """Draw an ellipse in a rectangle."""
        dashes = ' stroke-dasharray="6 4"' if dashed else ""
        shape = f'cx="{x + width / 2:.1f}" cy="{y + height / 2:.1f}" rx="{width / 2:.1f}" ry="{height / 2:.1f}"'
        self._parts.append(f'<ellipse {shape} fill="#fff" stroke="#000" stroke-width="{line:g}"{dashes}/>')

    def words(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float = TEXT,
        anchor: str = "start",
        bold: bool = False,
        italic: bool = False,
        fill: str = "#000000",
        halo: bool = False,
    ) -> None:
        """Write a text whose baseline begins, ends or is centred at a point; `halo` draws a white border around it."""
        style = (' font-weight="bold"' if bold else "") + (' font-style="italic"' if italic else "")
        style += ' paint-order="stroke" stroke="#fff" stroke-width="5" stroke-linejoin="round"' if halo else ""
        self._parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" text-anchor="{anchor}" fill="{fill}"{style}>'
            f"{escape(_printable(text), quote=False)}</text>"
        )

    def badge(self, x: float, y: float, text: str, size: float = SMALL) -> None:
        """Write a short text in a white disc around a point."""
        radius = max(0.72 * size, width_of(text, size) / 2 + 3)
        self._parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="#fff" stroke="#000"/>')
        self.words(x, y + 0.36 * size, text, size=size, anchor="middle")

    def line(
        self,
        points: Sequence[tuple[float, float]],
        *,
        line: float = 1.6,
        dashed: bool = False,
        arrow: bool = False,
        grey: bool = False,
    ) -> None:
        """Draw a line through points, with an arrowhead at its end if `arrow` is true."""
        path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        self.path(path, line=line, dashed=dashed, arrow=arrow, grey=grey)

    def path(
        self,
        path: str,
        *,
        line: float = 1.6,
        dashed: bool = False,
        arrow: bool = False,
        grey: bool = False,
        fill: str = "none",
    ) -> None:
        """Draw along an SVG path, and fill what it encloses if `fill` is a colour."""
        more = (' stroke-dasharray="7 5"' if dashed else "") + (' marker-end="url(#arrow)"' if arrow else "")
        colour = "#bbbbbb" if grey else "#000000"
        self._parts.append(f'<path d="{path}" fill="{fill}" stroke="{colour}" stroke-width="{line:g}"{more}/>')

    def picture(self, alt: str) -> Picture:
        """Return the picture of everything that has been drawn, with its description in words."""
        body = "".join(self._parts)
        hatches = "".join(
            f'<pattern id="h{number}" width="10" height="10" patternUnits="userSpaceOnUse">'
            f'<path d="{path}" stroke="#000" stroke-width="1.1" stroke-opacity="0.6"/></pattern>'
            for number, path in enumerate(_HATCHES)
            if f"#h{number})" in body
        )
        arrow = (
            '<marker id="arrow" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="9" markerHeight="9" '
            'orient="auto-start-reverse" markerUnits="userSpaceOnUse"><path d="M0 0L10 5L0 10z" fill="#000"/></marker>'
            if "#arrow" in body
            else ""
        )
        svg = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}" '
            f'width="{self.width:g}" height="{self.height:g}" '
            'font-family="system-ui, Segoe UI, Roboto, Noto Sans, Liberation Sans, DejaVu Sans, sans-serif">'
            f"<style>{_dark_scheme()}</style><defs>{hatches}{arrow}</defs>"
            f'<rect width="{self.width:g}" height="{self.height:g}" fill="#fff"/>{body}</svg>'
        )
        return Picture(svg=svg, alt=_printable(alt))


def _dark_scheme() -> str:
    """Return the style that swaps paper and ink on a page that declares a dark colour scheme.

    The browser tells a picture in an `<img>` element which scheme the page around it declares.
    """
    rules = "".join(
        f'[fill="{light}"]{{fill:{dark}}}[stroke="{light}"]{{stroke:{dark}}}' for light, dark in _DARK.items()
    )
    return f"@media (prefers-color-scheme:dark){{{rules}}}"


def seconds_axis(canvas: Canvas, left: float, top: float, bottom: float, seconds: float) -> float:
    """Draw the grid of a time axis from 0 to `seconds`, with its numbers, and return the units for one second."""
    right = canvas.width - 24
    per_second = (right - left) / seconds
    steps = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 600.0, 3600.0)
    step = next((step for step in steps if seconds / step <= 10.5), seconds / 10)
    for number in range(int(seconds / step + 1e-6) + 1):
        x = left + number * step * per_second
        canvas.line([(x, top), (x, bottom)], line=1, grey=True)
        canvas.words(x, bottom + TEXT + 2, f"{number * step:g}", size=SMALL, anchor="middle")
    canvas.words(right, bottom + 2 * TEXT + 2, "seconds", size=SMALL, anchor="end")
    return per_second
