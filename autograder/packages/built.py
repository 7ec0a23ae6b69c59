"""The result of building a package: what it installs, its executables and interfaces, and those that it imports."""

from __future__ import annotations

import ast
import difflib
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from autograder.reasons import Group, Kind, Reason


@dataclass(frozen=True)
class Built:
    """The result of building a package."""

    name: str
    status: int
    """The exit status of colcon."""
    log: str
    over: str = ""
    """The resource of which the build used too much, such as `memory`, so that it was ended; otherwise empty."""
    files: frozenset[str] = field(default_factory=frozenset)
    """The installed files, as paths below the package's folder in `install`."""
    folder: Path = Path()
    """The package's folder in `install`."""

    @property
    def executables(self) -> list[str]:
        """The names that `ros2 run` finds, which are those of the files in `lib/PACKAGE`."""
        where = f"lib/{self.name}"
        return sorted(Path(path).name for path in self.files if str(Path(path).parent) == where)

    def shared(self, name: str) -> str:
        """Return the path below `share/PACKAGE` at which `ros2 launch` finds a file of this name.

        If there is no such file, return the name.
        """
        where = f"share/{self.name}/"
        found = sorted(path for path in self.files if path.startswith(where) and Path(path).name == name)
        return found[0].removeprefix(where) if found else name

    def text(self, path: str) -> str:
        """Return the text of an installed file, or an empty text if there is no such file."""
        return (self.folder / path).read_text("utf-8", "replace") if path in self.files else ""


ENTRY_POINT = Kind("entry-point", "setup.py has no entry point of this name", Group.BUILT)
ENTRY_POINT_TARGET = Kind(
    "entry-point-target", "the entry point leads to a module or function that is not installed", Group.BUILT
)
EXECUTABLE_PLACE = Kind("executable-place", "the executable is installed, and not where `ros2 run` looks", Group.BUILT)

_MISSPELT = 0.85
"""The similarity from which one name is taken for a misspelling of another; `speed_sensor` and `speed_monitor` are
less similar than this."""


def why_no_executable(built: Built, name: str) -> Reason | None:
    """Return why `ros2 run` finds no executable of a name; None if it finds one."""
    if name in built.executables:
        return None
    places = (path.rpartition("/")[0] for path in sorted(built.files) if path.endswith(f"/{name}"))
    where = next((place for place in places if place.split("/")[0] in ("bin", "lib") and "python" not in place), "")
    points = _entry_points(built)
    if where or name in points:
        because = f"`{name}` is installed in {f'`{where}`' if where else 'another place'}."
        because += f" `ros2 run` looks in `lib/{built.name}` only."
        wanted = f"setup.cfg says where scripts go, below `[install]`: `install_scripts=$base/lib/{built.name}`."
        return EXECUTABLE_PLACE(because, wanted)
    near = next(iter(difflib.get_close_matches(name, points, 1, _MISSPELT)), "")
    has = ", ".join(f"`{one}`" for one in sorted(points)) or "none"
    because = f"setup.py has no entry point of the name `{name}`; its console_scripts are: {has}."
    return ENTRY_POINT(because + (f" Is `{near}` meant to be it?" if near else ""))


def why_other_target(built: Built, name: str, wanted: str = "") -> Reason | None:
    """Return why an executable's entry point does not lead to its function; None if it does, or may do so.

    Args:
        built: the package.
        name: the name of the executable.
        wanted: the function, as `module:function`; without it, any existing function is accepted.
    """
    target = re.sub(r"\s|\[.*", "", _entry_points(built).get(name, ""))
    if not target:
        because = f"`lib/{built.name}/{name}` is installed, but not by an entry point in `console_scripts` of setup.py."
        return ENTRY_POINT(because)
    module, _, function = target.partition(":")
    place = f"/site-packages/{module.replace('.', '/')}"
    places = (f"{place}/__init__.py", f"{place}.py")  # Python looks for them in this order
    path = next((one for end in places for one in built.files if one.endswith(end)), "")
    first = re.escape(function.partition(".")[0])
    defined = rf"^((def|class) {first}\b|{first}\s*=|.*\bimport\b.*\b{first}\b)"
    if ":" not in target:
        because = f"The entry point `{name}` leads to `{target}`, which has no `:` between module and function."
    elif not path:
        because = f"The entry point names the module `{module}`, and no such module is installed."
        return ENTRY_POINT_TARGET(because, _where_it_is(built, module, function))
    elif not re.search(defined, built.text(path), re.MULTILINE):
        because = f"The entry point names `{function}`, and the module `{module}` has no function of that name."
    elif wanted and target != wanted:
        because = f"The entry point `{name}` leads to `{target}`, not to `{wanted}`."
    else:
        return None
    return ENTRY_POINT_TARGET(because)


def _where_it_is(built: Built, module: str, function: str) -> str:
    """What to write for a module that is not installed under this name."""
    paths = [path.rpartition("/site-packages/")[2] for path in built.files if "/site-packages/" in path]
    modules = [path.removesuffix(".py").replace("/", ".") for path in paths if path.endswith(".py")]
    modules = [name for name in modules if not name.endswith("__init__")]
    plain = module.removesuffix(".py")
    if plain in modules:
        return f"A module is named without `.py`: `{plain}:{function}`."
    same = [name for name in modules if name.rpartition(".")[2] == plain.rpartition(".")[2]]
    if same:
        return f"With the folder that it is in, it is `{same[0]}:{function}`."
    if any(name.partition(".")[0] == module.partition(".")[0] for name in modules):
        return f"These modules are installed: {', '.join(f'`{name}`' for name in modules[:6])}."
    return "Only the folders of code that `packages` in setup.py names are installed."


def _entry_points(built: Built) -> dict[str, str]:
    """Return the console scripts that setup.py names: for each name, `module:function`."""
    for path in built.files:
        if path.endswith("/entry_points.txt"):
            section = built.text(path).partition("[console_scripts]")[2].partition("\n[")[0]
            pairs = (line.partition("=") for line in section.splitlines() if "=" in line)
            return {name.strip(): target.strip() for name, _, target in pairs}
    return {}


def imported_interfaces(sources: Path) -> dict[str, str]:
    """Return the packages whose messages, services or actions are imported, each with the first file that does so.

    Args:
        sources: the package's folder below `src`. Files in it that are not valid Python are skipped.
    """
    found: dict[str, str] = {}
    for path in sorted(sources.rglob("*.py")):
        try:
            tree = ast.parse(path.read_text("utf-8", "replace"))
        except (SyntaxError, ValueError):
            continue
        for name in (name for node in ast.walk(tree) for name in _imported(node)):
            package, kind = name.split(".")[0], name.split(".")[1:2]
            if kind in (["msg"], ["srv"], ["action"]):
                found.setdefault(package, path.name)
    return found


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and not node.level:
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []


class InterfaceError(ValueError):
    """Raised if an interface file cannot be read; the message says why."""


def interface_parts(package: str, name: str, text: str) -> list[dict[str, str]]:
    """Return the fields of a message, of a service's request and response, or of an action's goal, result and feedback.

    Args:
        package: the package of the interface; types of its own messages are returned without the package's name.
        name: the name of the interface, such as `msg/DetectedObject`.
        text: the text of the file.

    Raises:
        InterfaceError: the file cannot be read.
    """
    from rosidl_adapter import parser

    kind, _, base = name.partition("/")
    try:
        if kind == "msg":
            found = [parser.parse_message_string(package, base, text)]
        elif kind == "srv":
            service = parser.parse_service_string(package, base, text)
            found = [service.request, service.response]
        else:
            action = parser.parse_action_string(package, base, text)
            found = [action.goal, action.result, action.feedback]
    except Exception as error:  # the parser raises a dozen kinds of exceptions, some of them Python's own
        raise InterfaceError(f"`{name}` cannot be read: {error}.") from error
    return [{field.name: _type(field.type, package) for field in part.fields} for part in found]


def _type(kind: Any, package: str) -> str:
    """Return a field's type as it is written in a file: `DetectedObject[]`, `std_msgs/Header`."""
    return str(kind).removeprefix(f"{package}/")
