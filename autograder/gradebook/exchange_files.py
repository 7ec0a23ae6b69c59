"""The files that nbgrader's exchange puts beside a notebook, and needs beside the feedback in order to return it."""

from __future__ import annotations

import contextlib
import copy
import datetime
import secrets
import tempfile
from pathlib import Path
from typing import Any

from autograder.core.files import read_plain, write_beside
from autograder.gradebook.private_nbgrader import CollectOwned
from autograder.submission import exchange_secret, timestamp


class CollectNotebooks(CollectOwned):
    """Collects from nbgrader's exchange only the notebooks, and the files that the exchange itself added to them.

    A link is left out, because the person who collects can read files that students must not see, such as solutions.
    """

    coursedir: Any

    def do_copy(self, src: str, dest: str, log: Any = None) -> None:
        """Copy one submission."""
        submission, most = Path(src), 1000 * self.coursedir.max_file_size
        with tempfile.TemporaryDirectory() as place:
            plain = Path(place, "plain")
            plain.mkdir()
            for name in sorted(path.name for path in submission.iterdir()):
                if not name.endswith(".ipynb") and name not in (timestamp.FILE_NAME, exchange_secret.FILE_NAME):
                    continue
                try:
                    content = read_plain(submission.parent, (submission.name, name), most)
                except OSError as error:
                    self.log.warning("%s in %s is left out: %s", name, submission.name, error.strerror)
                else:
                    (plain / name).write_bytes(content)
            super().do_copy(str(plain), dest, log)


def only_notebooks(course: Any) -> Any:
    """Return a copy of nbgrader's description of a course with which only notebooks are copied.

    If an instructor opens a notebook from formgrader, its kernel would import a file such as ipykernel_launcher.py in
    the same folder. The exchange uses the original description, because it has to copy all files that belong to a lab.
    """
    described = copy.copy(course)
    described.ignore = ["*"]
    return described


def carry(submitted: Path, into: Path) -> None:
    """Copy the exchange's files from a submission into a folder of nbgrader, if they exist and have the right form."""
    into.mkdir(parents=True, exist_ok=True)
    for name, text in (_moment(submitted), _secret(submitted)):
        if text:
            (into / name).unlink(missing_ok=True)  # nbgrader makes its files read-only
            write_beside(into / name, text)


def complete(submitted: Path, feedback: Path) -> None:
    """Put the files that `nbgrader release_feedback` needs beside a feedback page, even if no exchange was used.

    Without them, that command would stop in the middle of a class. If a submission has no secret, a random one is
    written; nobody knows it, so nobody can fetch that page.
    """
    carry(submitted, feedback)
    if not (feedback / timestamp.FILE_NAME).exists():
        now = datetime.datetime.now(datetime.UTC)
        write_beside(feedback / timestamp.FILE_NAME, f"{now:%Y-%m-%d %H:%M:%S} UTC")
    if not (feedback / exchange_secret.FILE_NAME).exists():
        write_beside(feedback / exchange_secret.FILE_NAME, secrets.token_hex(64))


def _moment(submitted: Path) -> tuple[str, str]:
    with contextlib.suppress(OSError):
        content = read_plain(submitted, [timestamp.FILE_NAME], timestamp.MOST_BYTES)
        return timestamp.FILE_NAME, timestamp.moment(content) or ""
    return timestamp.FILE_NAME, ""


def _secret(submitted: Path) -> tuple[str, str]:
    with contextlib.suppress(OSError):
        content = read_plain(submitted, [exchange_secret.FILE_NAME], exchange_secret.MOST_BYTES)
        return exchange_secret.FILE_NAME, exchange_secret.secret(content)
    return exchange_secret.FILE_NAME, ""
