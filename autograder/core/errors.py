"""The errors that end a command: each is a sentence for a person, never a traceback."""

from __future__ import annotations


class KitError(Exception):
    """Set-up or usage error: what happened, and what to do. A command prints both and exits with status 2."""

    def __init__(self, what: str, do: str = "") -> None:
        """Keep what happened and what to do about it as two sentences."""
        super().__init__(what if not do else f"{what}\n{do}")
        self.what = what
        self.do = do

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in a notebook: the two sentences, and no traceback."""
        return str(self).splitlines()


GRADEBOOK_REFUSED = (
    "Check that no other program uses the gradebook, that the disk has space and that you may write there. Then run the"
    " command again: what is finished is kept."
)
"""What to do when the database says no."""
