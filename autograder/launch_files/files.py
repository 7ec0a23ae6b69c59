"""Where a launch file finds other files: a package's share folder as it is installed, seen from the lab's one folder.

An installed package has its launch files and parameter files in `share/PACKAGE/launch`; a lab has them all in one
folder. `$(dirname)` is that folder, and `$(find-pkg-share PACKAGE)/launch` leads to it. Of a package that was built,
the folder is the one that it is installed in, `…/share/PACKAGE`, with its files where they are.
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
"""The words of Python, and where the same stands in YAML."""


def content(path: Path, place: Place) -> Any:
    """What stands below `launch:` in a launch file.

    Raises:
        Refused: it is missing, or no launch file in YAML.
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
    """Say that a file is a launch file in Python, if it is one.

    Raises:
        Refused: it is.
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
