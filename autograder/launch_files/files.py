"""Finds the files that a launch file names: paths in an installed package, translated to the lab's single folder.

An installed package has its launch files and parameter files in `share/PACKAGE/launch`, but a lab has all of them in
one folder. `$(dirname)` is that folder, and `$(find-pkg-share PACKAGE)/launch` leads to it. The folder of a package
that was built is the one in which it is installed, `…/share/PACKAGE`, and its files are where they were installed.
"""

from __future__ import annotations

import os.path
import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from autograder.core import student_yaml
from autograder.launch_files.errors import Place
from autograder.reasons import Refused


class Packages:
    """The packages that a launch file may name."""

    def __init__(
        self,
        find: Callable[[str], Path],
        programs: Collection[str] | None,
        stand_ins: Mapping[str, str] | None = None,
    ) -> None:
        """Keep how packages and files are found.

        Args:
            find: returns the folder of a package, or raises KeyError if there is none.
            programs: the names of a package's programs; None if any program is assumed to exist.
            stand_ins: the names of launch files to read in place of others, by the names of the others.
        """
        self.programs = programs
        self.stand_ins = dict(stand_ins or {})
        self._find = find
        self._folders: dict[str, Path] = {}

    def folder(self, name: str) -> Path:
        """Return the folder with a package's files.

        Raises:
            KeyError: there is no such package.
        """
        if name not in self._folders:
            self._folders[name] = self._find(name).resolve()
        return self._folders[name]

    def share(self, name: str) -> str:
        """Return the value of `$(find-pkg-share NAME)`.

        If the package was not built, only the folder `launch/` below it contains files.

        Raises:
            KeyError: there is no such package.
        """
        place = self.folder(name)
        return str(place) if _is_installed(place, name) else f"{place}/share/{name}"

    def is_built(self, name: str) -> bool:
        """Whether a package has been built, so that its folder is the one in which it is installed."""
        return _is_installed(self.folder(name), name)

    def in_installed(self, text: str) -> str:
        """Return a path relative to the folder in which its package is installed, or "" if it is in no such folder."""
        path = os.path.normpath(text)
        places = [str(place) for name, place in self._folders.items() if _is_installed(place, name)]
        return next((path[len(place) + 1 :] for place in places if path.startswith(f"{place}/")), "")

    def called_in_words(self, path: Path) -> str:
        """Return a file as a command line names it.

        A file in the lab's folder is named by its name, and a file in an installed package by its path.
        """
        return str(path) if self.in_installed(str(path)) else path.name

    def called(self, path: Path) -> str:
        """Return the name of a file in the launch files; for a stand-in, this is the name of the file it replaces."""
        return next((name for name, file in self.stand_ins.items() if file == path.name), path.name)

    def has(self, program: str, file: str) -> bool:
        """Whether a launch file may start a program; a stand-in may start any program."""
        return self.programs is None or program in self.programs or file in self.stand_ins.values()

    def file(self, text: str, folder: Path) -> Path | None:
        """Return the file to which a path leads after the package is installed, or None if the lab has no such file.

        Args:
            text: the path as written in the launch file.
            folder: the folder of the launch file.
        """
        if not text.startswith("/"):
            return None  # `ros2 launch` looks for it in the folder from which it is called
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
    """Whether a package's folder was created by building the package."""
    return place.parts[-2:] == ("share", name)


_IN_PYTHON = re.compile(
    r"^\s*(from\s+(launch|launch_ros)[\w.]*\s+import\b|import\s+launch|def\s+generate_launch_description\b)"
    r"|\bLaunchDescription\s*\(",
    re.MULTILINE,
)
_IN_YAML = {
    "Node": "`- node:` with `pkg`, `exec`, `name` and `namespace` below it",
    "LifecycleNode": "`- node:`",
    "DeclareLaunchArgument": "`- arg:` with `name` and `default`",
    "LaunchConfiguration": "`$(var NAME)`",
    "SetLaunchConfiguration": "`- let:` with `name` and `value`",
    "EnvironmentVariable": "`$(env NAME)`",
    "SetEnvironmentVariable": "`- set_env:` with `name` and `value`",
    "FindPackageShare": "`$(find-pkg-share PACKAGE)`",
    "get_package_share_directory": "`$(find-pkg-share PACKAGE)`",
    "IncludeLaunchDescription": "`- include:` with `file`, and `arg` for its arguments",
    "GroupAction": "`- group:` with a list below it",
    "PushRosNamespace": "`- push_ros_namespace:` with `namespace`",
    "SetParameter": "`- set_parameter:` with `name` and `value`",
    "SetRemap": "`- set_remap:` with `from` and `to`",
    "IfCondition": "the key `if`",
    "UnlessCondition": "the key `unless`",
    "PythonExpression": '`$(eval "…")`',
    "LogInfo": "`- log:` with `message`",
    "remappings": "`remap:` with entries `{from: OLD, to: NEW}`",
    "parameters": "`param:` with entries `{name: NAME, value: VALUE}`, or `{from: FILE}` for a file",
    "arguments": "`args:`",
}
"""The words of launch files in Python, and what corresponds to them in YAML."""


def content(path: Path, place: Place) -> Any:
    """Return the content of `launch:` in a launch file.

    Raises:
        Refused: the file is missing, or is not a launch file in YAML.
    """
    if not path.is_file():
        hint = "Its name is the one after `%%file` in the first line of its cell."
        if "share" in path.parts:
            hint = "It is started from where the package installs it: `data_files` in setup.py has to name it."
        raise place.error("there is no such file.", hint)
    try:
        found = student_yaml.read(path, written=True)
    except Refused as error:
        _refuse_python(path, place)
        because = (
            error.reason.because.removeprefix(f"`{path.name}`").lstrip(", ").removeprefix(error.place).lstrip(" :")
        )
        because = f"it {because}" if because.startswith("is ") else because
        hint = "Look at the indentation and the `-` there." if "not YAML" in because else ""
        raise Place(path.name, place.folder, error.place).error(because, hint) from None
    if not isinstance(found, dict) or list(found) != ["launch"]:
        _refuse_python(path, place)
        xml = "XML is not covered here; in YAML " if str(found).startswith("<") else ""
        because = f"{xml}a launch file has one key at the top, `launch:`, with a list below it."
        raise place.error(because, "Begin with `launch:` and `- node:`.")
    return found["launch"]


def _refuse_python(path: Path, place: Place) -> None:
    """Refuse a file that is a launch file in Python.

    Raises:
        Refused: the file is one.
    """
    with path.open("rb") as file:
        text = file.read(student_yaml.FILE_BYTES).decode("utf-8", "replace")
    if not _IN_PYTHON.search(text):
        return
    used = [(word, yaml) for word, yaml in _IN_YAML.items() if re.search(rf"\b{word}\s*[(=]", text)]
    used = used or [("Node", _IN_YAML["Node"])]
    raise place.error(
        "it is a launch file in Python, and the launch files of this course are written in YAML.",
        "Begin with `launch:`, and write a list below it. "
        + " ".join(f"What is `{word}` in Python is {yaml} in YAML." for word, yaml in used),
    )
