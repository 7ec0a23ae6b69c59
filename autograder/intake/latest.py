"""Which of the notebooks that one student handed in counts."""

from __future__ import annotations

import re
from collections.abc import Sequence

from autograder.intake.claims import Claim

_COPY = re.compile(r"(-\d+| ?\(\d+\)|-copy\d*)$")
"""What platforms, browsers and JupyterLab put behind the name of a file that they have already."""


def latest(claims: Sequence[Claim], lab: str) -> Claim | None:
    """Return the notebook that counts: in the last attempt the one with the lab's name, or else the only one.

    Args:
        claims: what one student handed in.
        lab: whose notebook is wanted.

    Returns:
        None if the last attempt holds several notebooks, and none has the lab's name.
    """
    attempt = max(claim.attempt for claim in claims)
    among = [claim for claim in claims if claim.attempt == attempt]
    named = [claim for claim in among if lab.casefold() in (_stem(claim), _plain(claim))]
    if not named and len({_plain(claim) for claim in among}) > 1:
        return None
    return max(named or among, key=lambda claim: claim.turn)


def _stem(claim: Claim) -> str:
    return claim.called.casefold().removesuffix(".ipynb")


def _plain(claim: Claim) -> str:
    return _COPY.sub("", _stem(claim))
