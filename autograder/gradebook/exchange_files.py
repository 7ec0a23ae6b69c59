"""What nbgrader's exchange puts beside a notebook, and wants to find beside its feedback to bring it back."""

from __future__ import annotations

import contextlib
import copy
import datetime
import secrets
from pathlib import Path
from typing import Any

from nbgrader.exchange.default import ExchangeCollect

from autograder.core.files import read_plain, write_beside
from autograder.submission import exchange_secret, timestamp


class CollectNotebooks(ExchangeCollect):  # type: ignore[misc]
    """Takes of what was submitted to nbgrader's exchange the notebooks, and what the exchange added to them."""

    coursedir: Any

    def do_copy(self, src: str, dest: str, log: Any = None) -> None:
        """Copy one submission."""
        self.coursedir = copy.copy(self.coursedir)
        self.coursedir.include = ["*.ipynb", timestamp.FILE_NAME, exchange_secret.FILE_NAME]
        super().do_copy(src, dest, log)


def only_notebooks(course: Any) -> Any:
    """Return nbgrader's description of a course by which nothing but notebooks is copied on.

    A file such as ipykernel_launcher.py, lying beside a notebook that an instructor opens from formgrader, would be
    imported by that kernel. The exchange, however, has to take along what belongs to a lab.
    """
    described = copy.copy(course)
    described.ignore = ["*"]
    return described


def carry(submitted: Path, into: Path) -> None:
    """Put what the exchange needs into a folder of nbgrader's, if it lies beside a submission and is as it must be."""
    into.mkdir(parents=True, exist_ok=True)
    for name, text in (_moment(submitted), _secret(submitted)):
        if text:
            (into / name).unlink(missing_ok=True)  # nbgrader makes its files unwritable
            write_beside(into / name, text)


def complete(submitted: Path, feedback: Path) -> None:
    """Put what `nbgrader release_feedback` needs beside a feedback page, also where no exchange was used.

    It ends in the middle of a class otherwise. A page whose secret nobody knows is fetched by nobody.
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
