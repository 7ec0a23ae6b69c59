"""A colcon workspace: the packages below `src`, and the files that building them installs below `install`."""

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
from autograder.sandbox.scratch import Scratch

SOURCES, INSTALLED, REFERENCE = "src", "install", "reference"
INSTALL = "Debian, Ubuntu: sudo apt-get install g++ cmake make python3-dev"
"""How to install the tools that build interfaces."""


class Workspace:
    """The packages of one folder. A package is built again only after its sources have changed.

    Args:
        folder: the folder that contains `src`.
        isolation: the isolation of builds, because the packages' build files run the student's code.
        known: the results of earlier builds, by the `digest_of` the package that was built.
        reference: the text of the files of the lab's own packages, by path in `folder`. They are never written there.
    """

    def __init__(
        self,
        folder: Path,
        isolation: Isolation,
        known: Mapping[str, BuildRun] | None = None,
        reference: Mapping[str, str] | None = None,
    ) -> None:
        """Begin with nothing installed."""
        self._known = known or {}
        self._reference = reference or {}
        self._folder = folder
        self._isolation = isolation
        self._built: dict[str, tuple[str, Built]] = {}

    def source(self, package: str) -> Path:
        """Return the folder of a package's sources."""
        return self._folder / SOURCES / package

    def build(self, package: str) -> Built:
        """Build a single package, if it has changed since it was built.

        Raises:
            KitError: this machine cannot build it, for example because it has no compiler. This says nothing about the
                package.
            OSError: the installed files cannot be written.
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
            built = self._install(package, run, INSTALLED)
            self._built[package] = (digest, built)
        return built

    def has_reference(self, package: str) -> bool:
        """Whether the lab's own package of this name is known here."""
        return any(name.startswith(f"{SOURCES}/{package}/") for name in self._reference)

    def build_reference(self, package: str) -> None:
        """Build the lab's own package of this name, and install it in `reference`, beside what the student installs.

        Raises:
            KitError: this machine cannot build it.
            OSError: the installed files cannot be written.
        """
        prefix = f"{SOURCES}/{package}/"
        texts = {name.removeprefix(prefix): text for name, text in self._reference.items() if name.startswith(prefix)}
        run = self._known.get(digest_of(package, {path: text.encode() for path, text in texts.items()}))
        if run is None:
            with Scratch() as scratch:
                scratch.chmod(0o755)  # the sandbox runs as another user
                write_files(scratch / package, texts)
                run = build(scratch, package, self._isolation)
        if run.status != 0:
            raise KitError(f"The lab's own `{package}` cannot be built.", "Repair the solution of the lab.")
        self._install(package, run, REFERENCE)

    def _install(self, package: str, run: BuildRun, into: str) -> Built:
        """Write the files that a build has installed, in place of those of an earlier build."""
        place = self._folder / into / package
        shutil.rmtree(place, ignore_errors=True)
        prefix = f"{package}/"
        installed = {path.removeprefix(prefix): data for path, data in run.installed.items() if path.startswith(prefix)}
        for path, content in installed.items():
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            (place / path).write_bytes(content)
        return Built(package, run.status, run.log, run.over, frozenset(installed), place)


def write_files(folder: Path, texts: Mapping[str, str]) -> None:
    """Write the files of a package, given as texts by their paths in the package."""
    for path, text in texts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


def missing_tools() -> list[str]:
    """Return what this machine lacks to build a package with interfaces."""
    programs = {"a C compiler": "cc", "a C++ compiler": "c++", "CMake": "cmake", "make": "make"}
    lacking = [what for what, program in programs.items() if shutil.which(program) is None]
    headers = Path(sysconfig.get_path("include")) / "Python.h"
    return lacking + ([] if headers.is_file() else ["the headers of Python"])


def _contents(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files of a package, by their paths in the package."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def digest_of(package: str, files: Mapping[str, bytes]) -> str:
    """Return a digest of a package's name and files.

    Args:
        package: the package's name.
        files: the contents of its files, by their paths in the package.
    """
    found = hashlib.sha256(f"{package}\0".encode())
    for path, content in sorted(files.items()):
        found.update(f"{path}\0{len(content)}\0".encode() + content)
    return found.hexdigest()
