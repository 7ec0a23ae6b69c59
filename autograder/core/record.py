"""A record: a small JSON file that the kit keeps for a course and that must never be lost or half-written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import TypeAdapter, ValidationError

from autograder.core.errors import KitError
from autograder.core.files import write_beside

T = TypeVar("T")


class Record(Generic[T]):
    """One kind of record: its form, what it is about, and what a person can do if it cannot be read."""

    def __init__(self, form: type[T], empty: Callable[[], T], about: str, without: str) -> None:
        """Describe it.

        Args:
            form: the type of its content.
            empty: makes the content of a record that has not been written yet.
            about: what the file is about, as a clause, such as "which remembers the names of the students".
            without: what happens if nobody has an earlier copy and the file is moved away, as a clause.
        """
        self._adapter, self._empty, self._about, self._without = TypeAdapter(form), empty, about, without

    def read(self, path: Path) -> T:
        """Return the content of this file.

        Raises:
            KitError: the file cannot be read.
        """
        try:
            return self._adapter.validate_json(path.read_bytes())
        except FileNotFoundError:
            return self._empty()
        except (OSError, ValidationError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is damaged, or of another version of the kit"
            raise KitError(
                f"{path}, {self._about}, cannot be read: {why}.",
                f"Replace it with an earlier copy. If you have none, move it away; {self._without}.",
            ) from error

    def write(self, path: Path, content: T) -> None:
        """Write the content to this file, completely or not at all, unless the file has this content already."""
        text = self._adapter.dump_json(content, indent=1) + b"\n"
        if not path.is_file() or path.read_bytes() != text:
            write_beside(path, text)
