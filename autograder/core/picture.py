"""A picture that can stand anywhere: inert, without a script, with words for those who do not see it."""

from __future__ import annotations

import base64
from html import escape

from pydantic import BaseModel, ConfigDict


class Picture(BaseModel):
    """A drawing as SVG, with what it shows in words.

    As the last line of a cell it is shown. A front end that trusts no notebook, nbgrader's feedback and a browser
    without a network show it too: it is an `<img>` that holds its own data, and in such a one nothing can run.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    svg: str
    alt: str
    """What the picture shows, in words."""

    def html(self) -> str:
        """Return the `<img>`, on white paper, so that a dark page does not swallow the lines."""
        data = base64.b64encode(self.svg.encode()).decode()
        return (
            f'<img alt="{escape(" ".join(self.alt.split()))}" src="data:image/svg+xml;base64,{data}" '
            'style="background:#ffffff; max-width:100%; height:auto">'
        )

    def _repr_html_(self) -> str:
        return self.html()

    def __repr__(self) -> str:
        return self.alt

    __str__ = __repr__
