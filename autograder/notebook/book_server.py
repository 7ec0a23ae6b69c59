"""Serves the lectures of a student's kit, or those that a checkout has built, through JupyterLab, below `/lectures`.

Jupyter shows HTML files in a user's folder in a sandbox, without their pictures and style sheets and with links that do
not work, because anybody may have written them. The lectures are files of the course itself, so they are not sandboxed.
"""

from __future__ import annotations

from typing import Any

from jupyter_server.base.handlers import AuthenticatedFileHandler
from jupyter_server.utils import url_path_join

from autograder.course.paths import built_book

ROUTE = "lectures"


class Pages(AuthenticatedFileHandler):  # type: ignore[misc]
    """Serves the book's files to users who are logged in."""

    @property
    def content_security_policy(self) -> str:
        """The policy: there is no sandbox, but only the book's own scripts and pictures are allowed."""
        return "default-src 'self' 'unsafe-inline' data:; frame-ancestors 'self'"

    def check_xsrf_cookie(self) -> None:
        """Allow every request, because the pages are the same for everybody and change nothing."""


def _load_jupyter_server_extension(server: Any) -> None:
    book = built_book()
    if book is not None:
        place = url_path_join(server.web_app.settings["base_url"], ROUTE, "(.*)")
        options = {"path": str(book), "default_filename": "index.html"}
        server.web_app.add_handlers(".*$", [(place, Pages, options)])
