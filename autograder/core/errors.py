"""Errors that end a command. Each is shown as a sentence for a person, never as a traceback."""

from __future__ import annotations


class KitError(Exception):
    """An error of set-up or usage that says what happened and what to do. A command prints both and exits with 2."""

    def __init__(self, what: str, do: str = "") -> None:
        """Store two sentences: what happened, and what to do about it."""
        super().__init__(what if not do else f"{what}\n{do}")
        self.what = what
        self.do = do

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows in a notebook: the two sentences instead of a traceback."""
        return str(self).splitlines()


GRADEBOOK_REFUSED = (
    "Check that no other program uses the gradebook, that the disk has space and that you may write there. Then run the"
    " command again: what is finished is kept."
)
"""What a person can do when the database refuses to read or write."""
