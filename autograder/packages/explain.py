"""Finds why a package was not built: from its files if they show the reason, otherwise from what the build printed.

Each reason needs words in the tool's output that only this mistake causes. If none of these words are found, the reason
quotes the first error that the build printed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from autograder.packages.built import Built
from autograder.reasons import Group, Kind, Reason

INTERFACE_LINE = Kind(
    "interface-line", "a line of an interface file is not a field, or its name or type is not allowed", Group.BUILDING
)
INTERFACE_TYPE = Kind(
    "interface-type", "an interface file uses a message type that its package does not build", Group.BUILDING
)
BUILD_FAILED = Kind("build-failed", "the build failed in another way; its first error is quoted", Group.BUILDING)
BUILD_TIME = Kind("build-time", "the build took too long and was ended", Group.BUILDING)
BUILD_LIMIT = Kind(
    "build-limit", "the build went over one of the limits of builds, which is named, and was ended", Group.BUILDING
)
PACKAGE_XML = Kind(
    "package-xml", "package.xml is missing, or is not a package description that ROS's tools accept", Group.BUILDING
)
PACKAGE_NAME = Kind("package-name", "package.xml gives the package another name than its folder has", Group.BUILDING)
BUILD_TYPE = Kind(
    "build-type",
    "package.xml exports no build type, or one whose file, CMakeLists.txt or setup.py, is missing",
    Group.BUILDING,
)
CMAKE = Kind("cmake", "CMake stopped at a line of CMakeLists.txt with the error that is quoted", Group.BUILDING)
BUILD_FILES = Kind("build-files", "the build made too many files and was ended", Group.BUILDING)
PACKAGE_FILE = Kind("package-file", "setup.py names a file or folder that is not in the package", Group.BUILDING)
SETUP_PY = Kind(
    "setup-py",
    "setup.py ended with an error, which is quoted, or without a call of `setup` that names what is there",
    Group.BUILDING,
)
INTERFACE_PARTS = Kind(
    "interface-parts", "a service or action file does not have the parts that `---` separates", Group.BUILDING
)
INTERFACE_FILE = Kind("interface-file", "CMakeLists.txt names an interface file that is not there", Group.BUILDING)
INTERFACE_DEPENDENCY = Kind(
    "interface-dependency", "an interface file uses a package that DEPENDENCIES does not name", Group.BUILDING
)
CMAKE_PACKAGE = Kind(
    "cmake-package", "CMakeLists.txt uses a package that it has not looked up with find_package", Group.BUILDING
)
INTERFACE_GROUP = Kind(
    "interface-group",
    "package.xml does not make the package a member of the group of interface packages",
    Group.BUILDING,
)

_BUILD_FILES = {"ament_cmake": "CMakeLists.txt", "ament_python": "setup.py"}
"""For each build type, the file that says how to build such a package."""
_Reason = Callable[[re.Match[str]], Reason]


def why_not_built(built: Built, sources: Path) -> Reason | None:
    """Return why a build failed; None if it did not.

    Args:
        built: the result of the build.
        sources: the package's folder below `src`.
    """
    wrong = not_described(sources, built.name)
    if wrong is not None:
        return wrong
    if built.status == 0:
        return None
    if built.over == "time":
        hint = "Does a build file wait for something?"
        return BUILD_TIME("The build took too long and was ended.", hint)
    if built.over:
        hint = "Does a build file start programs without an end, or keep more and more?"
        return BUILD_LIMIT(f"The build went over its limit of {built.over} and was ended.", hint)
    return said_of_files(built.log) or _quoted(built.log)


def said_of_files(log: str) -> Reason | None:
    """Return the mistake in the package's own files that the tools report, in words that have no other cause; or None.

    Args:
        log: the whole output of a build that failed.
    """
    text = " ".join(log.split())
    for pattern, reason in _REASONS:
        match = re.search(pattern, text)
        if match:
            return reason(match)
    return None


_HERE = {"ROS_VERSION": "2", "ROS_DISTRO": "jazzy", "ROS_PYTHON_VERSION": "3"}
"""The values of the variables that a condition in package.xml may use."""


def needed_packages(sources: Path, to_build: bool = False) -> list[str]:
    """Return the packages that package.xml names as needed at run time, or to build.

    Args:
        sources: the package's folder, with a package.xml that can be read.
        to_build: return the packages that are needed to build it, not those that are needed at run time.
    """
    from catkin_pkg.package import parse_package

    package = parse_package(str(sources / "package.xml"))
    named = [*package.buildtool_depends, *package.build_depends] if to_build else package.exec_depends
    package.evaluate_conditions(_HERE)  # a dependency may hold for some versions only (REP 149)
    return [str(one) for one in named if one.evaluated_condition]


def not_described(sources: Path, name: str) -> Reason | None:
    """Return what in package.xml, or beside it, prevents colcon from building the package, or under its name."""
    from catkin_pkg.package import InvalidPackage, parse_package

    path = sources / "package.xml"
    if not path.is_file():
        return PACKAGE_XML(f"There is no `src/{name}/package.xml`: without it, no folder is a package.")
    try:
        package = parse_package(str(path))
    except InvalidPackage as error:
        words = str(error).replace(str(path), "package.xml").split("\n")
        lines = [line.removeprefix("- ") for line in words if line and not line.startswith("Error(s)")]
        said = "; ".join(lines[:2]).rstrip(".")
        return PACKAGE_XML(f"`src/{name}/package.xml` is not accepted: {said}.")
    except Exception as error:  # a file that cannot be parsed causes exceptions of several libraries
        return PACKAGE_XML(f"`src/{name}/package.xml` cannot be read as XML: {error}.")
    if package.name != name:
        because = f"package.xml names the package `{package.name}`; its folder, and this task, name it `{name}`."
        return PACKAGE_NAME(because)
    exported = [str(export.content) for export in package.exports if export.tagname == "build_type"]
    return _other_build_type(exported, sources, name)


def _other_build_type(exported: list[str], sources: Path, name: str) -> Reason | None:
    """Return why the build types that package.xml exports do not fit the package's files; None if they do."""
    there = [kind for kind, file in _BUILD_FILES.items() if (sources / file).is_file()]
    if len(exported) == 1 and exported[0] in there:
        return None
    types = " and ".join(f"`{one}`" for one in exported)
    has = f"exports the build type {types}" if exported else "exports no build type"
    if there:
        because = f"package.xml {has}, so colcon does not build the package as an `{there[0]}` package."
        hint = f"It needs `<export><build_type>{there[0]}</build_type></export>`, as its only build type."
        return BUILD_TYPE(because, hint)
    missing = [file for kind, file in _BUILD_FILES.items() if kind in exported] or list(_BUILD_FILES.values())
    because = f"package.xml {has}, and the package has {' and '.join(f'no `{file}`' for file in missing)}."
    cells = " or ".join(f"`%%file src/{name}/{file}`" for file in missing)
    return BUILD_TYPE(because, f"Run the cell that begins with {cells}, or write it.")


def _not_a_file(match: re.Match[str]) -> Reason:
    """Return what setup.py may mean by something that is not a file: the tool's words are the same for a folder."""
    path = match[1].rstrip("/")
    hint = ""
    if "*" in path:
        hint = f'A pattern has to be looked up: `glob("{path}")`, with `from glob import glob`.'
    elif not Path(path).suffix and not path.startswith("resource/"):  # the marker has no suffix, and is no folder
        hint = f'If it is a folder, its files have to be named: `glob("{path}/*")`, with `from glob import glob`.'
    return PACKAGE_FILE(f"setup.py installs `{match[1]}`, and the package has no file of that name.", hint)


def _interface_line(match: re.Match[str]) -> Reason:
    line, name, said = match.groups()
    said = said.strip() + "'" * (said.count("'") % 2)  # the pattern does not include a quotation mark at the end
    if line.startswith(" "):
        because = f"The line `{line.strip()}` of the interface `{name}` begins with a blank, so no type is read there."
        return INTERFACE_LINE(because, "Each line begins with the type, at the very left.")
    because = f"The line `{line}` of the interface `{name}` is not accepted: {said}."
    full = re.search(r"\b(\w+)/msg/(\w+)", line)
    if full:
        return INTERFACE_LINE(because, f"In an interface file it is `{full[1]}/{full[2]}`, without `msg`.")
    hint = (
        "A line is a type and a name. Types are built in (`string`, `int32`, `float32`, `bool`, …) or messages; names"
        " of fields are written in small letters."
    )
    return INTERFACE_LINE(because, hint)


def _unknown_type(match: re.Match[str]) -> Reason:
    package, name = match.groups()
    because = f"An interface uses the message `{package}/{name}`,"
    because += f" and `rosidl_generate_interfaces` in CMakeLists.txt names no `msg/{name}.msg`."
    hint = (
        "Is the name right? A message of the same package needs a file, which has to be named there. A message of"
        " another package is written with that package: `std_msgs/Header`."
    )
    return INTERFACE_TYPE(because, hint)


_REASONS: list[tuple[str, _Reason]] = [
    (
        r"The build was ended: it made more than ([\d,]+) files",
        lambda m: BUILD_FILES(
            f"The build was ended because it made more than {m[1]} files and folders.",
            "Does a build file make files in a loop?",
        ),
    ),
    (
        r"error: can't copy '([^']+)': doesn't exist",
        _not_a_file,
    ),
    (
        r"error: package directory '([^']+)' does not exist",
        lambda m: PACKAGE_FILE(f"setup.py names the Python package `{m[1]}`; there is no such folder."),
    ),
    (
        r"Multiple top-level packages discovered in a flat-layout: \[([^\]]{0,1000})\]",
        lambda m: SETUP_PY(
            f"setup.py does not name the Python package; setuptools looked for one, and found several folders: {m[1]}.",
            "`packages=[…]` names it.",
        ),
    ),
    (
        r"RuntimeError: 'distutils.core.setup\(\)' was never called",
        lambda m: SETUP_PY(
            "setup.py ends without a call of `setup(…)` whose arguments setuptools accepts.",
            "Is `setup(…)` called? Has each entry point the form `name = module:function`, and a comma after it?",
        ),
    ),
    (
        r"Error processing '([^']{0,1000})' of '([^']{0,200})': '?('.{0,1000}?)'? Traceback",
        _interface_line,
    ),
    (
        r"InvalidServiceSpecification: Could not find separator '---'",
        lambda m: INTERFACE_PARTS("A service file has no line `---` between request and response."),
    ),
    (
        r"InvalidActionSpecification: Number of '---' separators",
        lambda m: INTERFACE_PARTS(
            "An action file needs exactly two lines `---`: one before the result, and one before the feedback.",
        ),
    ),
    (
        r"passed file '([^']+)' doesn't exist",
        lambda m: INTERFACE_FILE(f"CMakeLists.txt names `{m[1]}`; the package has no such file."),
    ),
    (
        r"include_map\[pkg\].{0,2000}?KeyError: '([^']{1,200})'",
        lambda m: INTERFACE_DEPENDENCY(
            f"An interface uses a message of `{m[1]}`, but rosidl_generate_interfaces does not name this package.",
            f"Is `{m[1]}` the right name of a package? If so, name it in the last line there: `DEPENDENCIES {m[1]}`.",
        ),
    ),
    (
        r"No such file or directory: '[^']*/rosidl_generator_type_description/(\w+)/msg/(\w+)\.json'",
        _unknown_type,
    ),
    (
        r"the passed dependency '([^']+)' has not been found before",
        lambda m: CMAKE_PACKAGE(
            f"CMakeLists.txt uses `{m[1]}` before it has looked it up.",
            f"Is `{m[1]}` the right name of a package? If so, put `find_package({m[1]} REQUIRED)` above that line.",
        ),
    ),
    (
        r'Unknown CMake command "rosidl_generate_interfaces"',
        lambda m: CMAKE_PACKAGE(
            "CMake does not know `rosidl_generate_interfaces`: the package that brings it was not looked up.",
            "Put `find_package(rosidl_default_generators REQUIRED)` above the line that uses it.",
        ),
    ),
    (
        r'Unknown CMake command "ament_(\w+)"',
        lambda m: CMAKE_PACKAGE(
            f"CMake does not know `ament_{m[1]}`: it is misspelt, or the package that brings it was not looked up.",
            "Is the name right? If so, put `find_package(ament_cmake REQUIRED)` above the line that uses it.",
        ),
    ),
    (
        r"Packages installing interfaces must include",
        lambda m: INTERFACE_GROUP(
            "package.xml does not say that this is a package of interfaces.",
            "It needs `<member_of_group>rosidl_interface_packages</member_of_group>`.",
        ),
    ),
]


def _quoted(log: str) -> Reason:
    """Return a reason that quotes the first error that the build printed."""
    error = re.search(r"CMake Error at (\S+):(\d+) \((\w+)\):\n((?:  .*\n?)+)(Call Stack.*\n(?:  .*\n?)*)?", log)
    if error:
        own = re.search(r"CMakeLists\.txt:(\d+) \((\w+)\)", f"{error[1]}:{error[2]} ({error[3]}) {error[5] or ''}")
        where = f"line {own[1]} of CMakeLists.txt, `{own[2]}`" if own else f"`{error[3]}`"
        said = " ".join(error[4].split()).rstrip(".")[:300]
        return CMAKE(f"CMake stops at {where}: {said}.")
    if "setup.py" in log:
        wrong = _python_error(log)
        if wrong:
            return SETUP_PY(f"setup.py ends with an error: {wrong}.")
    return BUILD_FAILED(f"The build fails: {first_error(log)}", "The whole log is below.")


def first_error(log: str) -> str:
    """Return the first line of a build's log that mentions an error, or the last line if none does.

    The text is empty if the log is.
    """
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    error = next((line for line in lines if re.search(r"\berror\b|Error", line)), "")
    return (error or "".join(lines[-1:]))[:300]


def _python_error(log: str) -> str:
    """Return the last line of the first traceback, and the number of the line of setup.py if it is named.

    The text is empty if there is no traceback.
    """
    match = re.search(r"^(\w+(?:Error|Exception)): (.+)$", log, re.MULTILINE)
    if match is None:
        return ""
    place = re.findall(r'File "[^"]*setup\.py", line (\d+)', log[: match.start()])
    where = f" (line {place[-1]})" if place else ""
    return f"{match[1]}: {match[2].rstrip('.')}{where}"
