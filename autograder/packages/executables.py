"""The executables of a package that was built, and why one is missing: read from what is installed."""

from __future__ import annotations

import difflib
import re

from autograder.packages.built import Built
from autograder.reasons import Group, Kind, Reason

ENTRY_POINT = Kind("entry-point", "setup.py has no entry point of this name", Group.BUILT)
ENTRY_POINT_TARGET = Kind(
    "entry-point-target", "the entry point leads to a module or function that is not installed", Group.BUILT
)
EXECUTABLE_PLACE = Kind("executable-place", "the executable is installed, and not where `ros2 run` looks", Group.BUILT)

_MISSPELT = 0.85
"""How alike two names of programs have to be for one to be the other misspelt: `speed_sensor` is no `speed_monitor`."""


def why_no_executable(built: Built, name: str) -> Reason | None:
    """Why `ros2 run` finds no executable of a name; None if it does."""
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
    """Why an executable does not lead to its function; None if it does, or to something that is made at run time.

    Args:
        built: the package.
        name: of the executable.
        wanted: as `module:function`; without it, any function that is there will do.
    """
    target = re.sub(r"\s|\[.*", "", _entry_points(built).get(name, ""))
    module, _, function = target.partition(":")
    path = next((one for one in built.files if one.endswith(f"/site-packages/{module.replace('.', '/')}.py")), "")
    first = re.escape(function.partition(".")[0])
    defined = rf"^((def|class) {first}\b|{first}\s*=|.*\bimport\b.*\b{first}\b)"
    if target and ":" not in target:
        because = f"The entry point `{name}` leads to `{target}`, which has no `:` between module and function."
    elif not path:
        because = f"The entry point names the module `{module}`, and no such module is installed."
        where = "Only the folders of code that `packages` in setup.py names are installed."
        return ENTRY_POINT_TARGET(because, where)
    elif not re.search(defined, built.text(path), re.MULTILINE):
        because = f"The entry point names `{function}`, and the module `{module}` has no function of that name."
    elif wanted and target != wanted:
        because = f"The entry point `{name}` leads to `{target}`, not to `{wanted}`."
    else:
        return None
    return ENTRY_POINT_TARGET(because)


def _entry_points(built: Built) -> dict[str, str]:
    """The console scripts that setup.py names, as `module:function` by name."""
    for path in built.files:
        if path.endswith("/entry_points.txt"):
            section = built.text(path).partition("[console_scripts]")[2].partition("\n[")[0]
            pairs = (line.partition("=") for line in section.splitlines() if "=" in line)
            return {name.strip(): target.strip() for name, _, target in pairs}
    return {}
