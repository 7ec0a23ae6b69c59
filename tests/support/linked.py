"""A copy of an environment's folder as hard links: no network, and no second copy on the disk."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path


def link_tree(source: Path, into: Path) -> None:
    """Link all files of a folder to the same places of another one, and leave what is there already.

    Other tests run programs of that environment meanwhile: a file that Python is just writing for itself may be gone
    before it is linked.
    """

    def link(one: str, other: str) -> str:
        with contextlib.suppress(FileNotFoundError, FileExistsError):
            os.link(one, other, follow_symlinks=False)
        return other

    shutil.copytree(source, into, symlinks=True, copy_function=link, dirs_exist_ok=True)
