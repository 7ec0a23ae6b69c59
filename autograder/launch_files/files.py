"""Where a launch file finds other files: a package's share folder as it is installed, seen from the lab's one folder.

An installed package has its launch files and parameter files in `share/PACKAGE/launch`; a lab has them all in one
folder. `$(dirname)` is that folder, and `$(find-pkg-share PACKAGE)/launch` leads to it. Of a package that was built,
the folder is the one that it is installed in, `…/share/PACKAGE`, with its files where they are.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Collection, Mapping
from pathlib import Path


class Packages:
    """The packages that a launch file may name."""

    def __init__(
        self,
        find: Callable[[str], Path],
        programs: Collection[str] | None,
        stand_ins: Mapping[str, str] | None = None,
    ) -> None:
        """Keep what the packages hold.

        Args:
            find: asked for the folder of a package, KeyError if there is none.
            programs: names of a package's programs; None: any program is taken to exist.
            stand_ins: names of launch files to read in place of others, by the names of those.
        """
        self.programs = programs
        self.stand_ins = dict(stand_ins or {})
        self._find = find
        self._folders: dict[str, Path] = {}

    def folder(self, name: str) -> Path:
        """The folder that has a package's files.

        Raises:
            KeyError: there is no such package.
        """
        if name not in self._folders:
            self._folders[name] = self._find(name).resolve()
        return self._folders[name]

    def share(self, name: str) -> str:
        """What `$(find-pkg-share NAME)` stands for; unless it was built, only `launch/` below it holds files.

        Raises:
            KeyError: there is no such package.
        """
        place = self.folder(name)
        return str(place) if _is_installed(place, name) else f"{place}/share/{name}"

    def is_built(self, name: str) -> bool:
        """Whether a package has been built, and its folder is the one that it is installed in."""
        return _is_installed(self.folder(name), name)

    def in_installed(self, text: str) -> str:
        """The path below the folder that a package was installed in; empty if it is in no such folder."""
        path = os.path.normpath(text)
        places = [str(place) for name, place in self._folders.items() if _is_installed(place, name)]
        return next((path[len(place) + 1 :] for place in places if path.startswith(f"{place}/")), "")

    def called_in_words(self, path: Path) -> str:
        """How a command line names a file: by its name in the lab's folder, by its path in an installed package."""
        return str(path) if self.in_installed(str(path)) else path.name

    def called(self, path: Path) -> str:
        """The name by which the launch files know a file: of a stand-in, the one that it stands for."""
        return next((name for name, file in self.stand_ins.items() if file == path.name), path.name)

    def has(self, program: str, file: str) -> bool:
        """Whether a launch file may start a program; a stand-in may start any."""
        return self.programs is None or program in self.programs or file in self.stand_ins.values()

    def file(self, text: str, folder: Path) -> Path | None:
        """The file that a path leads to once the package is installed; None if there is none, or not in the lab.

        Args:
            text: the path as the launch file has it.
            folder: of the launch file.
        """
        if not text.startswith("/"):
            return None  # looked for in the folder that `ros2 launch` is called from
        if self.in_installed(text) and Path(text).name not in self.stand_ins:
            built = Path(os.path.normpath(text))
            return built if built.is_file() else None
        installed = {str(folder.resolve()): "/share//launch"}
        for name, place in self._folders.items():
            installed[f"{place}/share/{name}"] = f"/share/{name}"
        longest = max(
            (root for root in installed if text == root or text.startswith(root + "/")), key=len, default=None
        )
        if longest is None:
            return None
        parent, name = os.path.split(os.path.normpath(f"/r{installed[longest]}{text[len(longest) :]}"))
        places = {f"/r/share/{package}/launch": place for package, place in self._folders.items()}
        holder = {"/r/share/launch": folder.resolve(), **places}.get(parent)
        path = holder / self.stand_ins.get(name, name) if holder else None
        return path if path and path.is_file() and path.resolve().parent == holder else None


def _is_installed(place: Path, name: str) -> bool:
    """Whether a package's folder is the one that building it made."""
    return place.parts[-2:] == ("share", name)
