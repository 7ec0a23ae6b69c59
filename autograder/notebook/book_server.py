"""The lectures of a student's kit, served by JupyterLab itself below `/lectures`.

Jupyter shows HTML files of a user's folder in a sandbox, without their pictures and style sheets and with links that
lead nowhere: anybody may have written them. These are the course's own.
"""

from __future__ import annotations

from typing import Any

from jupyter_server.base.handlers import AuthenticatedFileHandler
from jupyter_server.utils import url_path_join

from autograder.course.paths import book_of_kit

ROUTE = "lectures"


class Pages(AuthenticatedFileHandler):  # type: ignore[misc]
    """The book's files, for who is logged in."""

    @property
    def content_security_policy(self) -> str:
        """No sandbox; scripts and pictures of the book itself only."""
        return "default-src 'self' 'unsafe-inline' data:; frame-ancestors 'self'"

    def check_xsrf_cookie(self) -> None:
        """Whoever asks may have the pages: they say the same to everybody, and change nothing."""


def _load_jupyter_server_extension(server: Any) -> None:
    book = book_of_kit()
    if book is not None:
        place = url_path_join(server.web_app.settings["base_url"], ROUTE, "(.*)")
        options = {"path": str(book), "default_filename": "index.html"}
        server.web_app.add_handlers(".*$", [(place, Pages, options)])
