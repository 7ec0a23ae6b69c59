"""A colcon workspace: the packages below `src`, and what building them puts below `install`."""

from __future__ import annotations

import hashlib
import shutil
import sysconfig
from collections.abc import Mapping
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.packages.built import Built
from autograder.packages.fair_build import build
from autograder.sandbox.build import BuildRun

SOURCES, INSTALLED = "src", "install"
INSTALL = "Debian, Ubuntu: sudo apt-get install g++ cmake make python3-dev"
"""How to get what interfaces are built with."""


class Workspace:
    """The packages of one folder. What has been built is built again only after a change of its sources.

    Args:
        folder: with the folder `src` in it.
        isolation: for what the packages' own build files run.
        known: what builds came to before, by `digest_of` what was built.
    """

    def __init__(self, folder: Path, isolation: Isolation, known: Mapping[str, BuildRun] | None = None) -> None:
        """Begin with nothing installed."""
        self._known = known or {}
        self._folder = folder
        self._isolation = isolation
        self._built: dict[str, tuple[str, Built]] = {}

    def source(self, package: str) -> Path:
        """The folder of a package's sources."""
        return self._folder / SOURCES / package

    def build(self, package: str) -> Built:
        """Build a package, alone.

        Raises:
            KitError: this machine cannot build it, such as for want of a compiler; that says nothing about the package.
            OSError: what was built cannot be written.
        """
        lacking = missing_tools()
        if lacking and (self.source(package) / "CMakeLists.txt").is_file():
            raise KitError(
                f"Building `{package}` needs {', '.join(lacking)}, which this machine does not have.", INSTALL
            )
        digest = digest_of(package, _contents(self.source(package)))
        known, built = self._built.get(package, ("", None))
        if built is None or known != digest:
            run = self._known.get(digest) or build(self._folder / SOURCES, package, self._isolation)
            built = self._install(package, run)
            self._built[package] = (digest, built)
        return built

    def _install(self, package: str, run: BuildRun) -> Built:
        """Write what a build has installed, in place of what an earlier one had."""
        place = self._folder / INSTALLED / package
        shutil.rmtree(place, ignore_errors=True)
        prefix = f"{package}/"
        installed = {path.removeprefix(prefix): data for path, data in run.installed.items() if path.startswith(prefix)}
        for path, content in installed.items():
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            (place / path).write_bytes(content)
        return Built(package, run.status, run.log, run.over, frozenset(installed), place)


def missing_tools() -> list[str]:
    """What a package with interfaces is built with and this machine does not have."""
    programs = {"a C compiler": "cc", "a C++ compiler": "c++", "CMake": "cmake", "make": "make"}
    lacking = [what for what, program in programs.items() if shutil.which(program) is None]
    headers = Path(sysconfig.get_path("include")) / "Python.h"
    return lacking + ([] if headers.is_file() else ["the headers of Python"])


def _contents(folder: Path) -> dict[str, bytes]:
    """All files of a package, by their path in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def digest_of(package: str, files: Mapping[str, bytes]) -> str:
    """A word for a package and all that its files hold.

    Args:
        package: its name.
        files: content by path in the package.
    """
    found = hashlib.sha256(f"{package}\0".encode())
    for path, content in sorted(files.items()):
        found.update(f"{path}\0{len(content)}\0".encode() + content)
    return found.hexdigest()
