"""The zip of feedback pages that a platform takes back and gives to each student."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Sequence

from autograder.report.export.entry import Entry, Export

_ALWAYS = (1980, 1, 1, 0, 0, 0)
"""Date of every file, so that equal pages give equal zips."""


def feedback_zip(entries: Sequence[Entry], platform: str, place: Callable[[Entry], str]) -> Export:
    """Return the pages of a class in a zip.

    Args:
        entries: of one lab.
        platform: that takes it.
        place: the name of a student's page in it; empty if the platform could not tell whose it is.
    """
    left_out = []
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry in entries:
            name = place(entry)
            if not name:
                left_out.append(
                    f"{entry.student}: {platform} could not tell whose page it is. Grade what it gives out,"
                    " or name its number for the student in roster.csv."
                )
            elif entry.feedback is None:
                left_out.append(f"{entry.student} has no feedback page: run autograder grade {entry.lab} once more.")
            else:
                info = zipfile.ZipInfo(name, _ALWAYS)
                info.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(info, entry.feedback.read_bytes())
    return Export(content.getvalue(), left_out)
