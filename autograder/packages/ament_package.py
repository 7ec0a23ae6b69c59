"""Writes a lab's programs and launch files as an ament_python package, to be built and launched by an installed ROS 2.

The programs are not changed: each is started as a script, with the package's folder first on Python's path, as the kit
starts it. Launch files and the parameter files beside them are installed into `share/PACKAGE/launch`, where
`$(dirname)` finds them; other files go to `share/PACKAGE/config`. The folders that a lab has below `src/` are packages
already, so they are written unchanged beside this one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.sax.saxutils import escape

from autograder.arguments.params_file import node_keys
from autograder.core.errors import KitError
from autograder.course.lab import Lab
from autograder.packages.workspace import SOURCES
from autograder.submission.reader import read_submission

_IMPORT = re.compile(r"^\s*(?:from|import)\s+([a-z]\w*)", re.MULTILINE)
_ROS_PACKAGE = re.compile(r"rclpy|\w+_msgs|\w+_interfaces|\w+_srvs|tf2_ros")
_PACKAGE_OF_CHECKS = re.compile(r"""package["']?\s*[=:]\s*["']([a-z][a-z0-9_]*)["']""")

_STARTED_WITH = re.compile(r"""launch_file\(\s*["']([\w.]+)["'][^)]*?\bpackage\s*=\s*["'](\w+)["']""")
_PACKAGE_OF_NODE = re.compile(r"""^[\s{-]*pkg:\s*["']?([a-z]\w*)""", re.MULTILINE)
_LAUNCH_FILE = re.compile(r"\.launch\.ya?ml$")

_PACKAGE_XML = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>{description}</description>
  <maintainer email="student@example.org">student</maintainer>
  <license>Apache-2.0</license>
{depends}
  <export>
    <build_type>ament_python</build_type>
  </export>
</package>
"""
_SETUP_PY = """\
from glob import glob

from setuptools import setup

setup(
    name="{name}",
    version="0.1.0",
    packages=["{name}"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/{name}"]),
        ("share/{name}", ["package.xml"]),
        ("share/{name}/launch", glob("launch/*")),
        ("share/{name}/config", glob("config/*")),
    ],
    install_requires=["setuptools"],
    entry_points={{
        "console_scripts": [
{scripts}
        ]
    }},
)
"""
_SETUP_CFG = """\
[develop]
script_dir=$base/lib/{name}
[install]
install_scripts=$base/lib/{name}
"""
_INIT_PY = '''\
"""The programs of this package: each function starts the file of its name as a script."""

import runpy
import sys
from pathlib import Path

_FOLDER = Path(__file__).resolve().parent


def _start(name: str) -> None:
    sys.path.insert(0, str(_FOLDER))
    runpy.run_path(str(_FOLDER / f"{{name}}.py"), run_name="__main__")
{functions}'''


def package_name(lab: Lab) -> str:
    """Return the package that the check cells name, or the lab's name if they name only the student's own packages."""
    own = packages_in(lab_files(lab, None))
    named = (match[1] for cell in lab.cells for match in _PACKAGE_OF_CHECKS.finditer(cell.source))
    return next((name for name in named if name not in own), lab.name)


def packages_of(lab: Lab, files: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Return the packages that a lab's launch files name, with the files of each.

    The first package also holds all files that belong to no other package. A launch file belongs to the package from
    which the lab starts it, or otherwise to the package of its nodes. Programs and parameter files are in every
    package, because its launch files may name any of them.
    """
    first, own = package_name(lab), packages_in(files)
    text = "\n".join(cell.source for cell in lab.cells)
    started = dict(_STARTED_WITH.findall(text))
    belongs = {}
    for file, content in files.items():
        if _LAUNCH_FILE.search(file) and "/" not in file:
            nodes = set(_PACKAGE_OF_NODE.findall(content)).difference(own)
            belongs[file] = started.get(file) or (nodes.pop() if len(nodes) == 1 else first)
    found = {first: {file: content for file, content in files.items() if belongs.get(file, first) == first}}
    for name in sorted(set(belongs.values()) - {first, *own}):
        found[name] = {
            file: content
            for file, content in files.items()
            if "/" not in file and (file.endswith(".py") or belongs.get(file) == name or _has_parameters(file, content))
        }
    return found


def _has_parameters(file: str, text: str) -> bool:
    return not file.endswith(".py") and not _LAUNCH_FILE.search(file) and bool(node_keys(text))


def packages_in(files: Iterable[str]) -> list[str]:
    """Return the names of the packages that a lab has below `src/`.

    Args:
        files: the names of all files of the lab.
    """
    return sorted({file.split("/")[1] for file in files if file.startswith(f"{SOURCES}/")})


def lab_files(lab: Lab, notebook: Path | None) -> dict[str, str]:
    """Return the programs and files of a lab by their names.

    Args:
        lab: the lab.
        notebook: the student's notebook to read them from; None for the files as students receive them.

    Raises:
        KitError: the notebook cannot be read.
    """
    if notebook is None:
        blank = {answer.file.file_name: answer.file.text for answer in lab.answers.values() if answer.file}
        return {**lab.given, **blank}
    submission = read_submission(notebook, lab)
    if not submission.readable:
        raise KitError(f"{notebook}: {submission.problems[0].because}", "Name a notebook of this lab.")
    return submission.files


def write_packages(lab: Lab, files: Mapping[str, str], folder: Path) -> dict[str, Path]:
    """Write the packages of a lab, and return their folders by the names of the packages.

    Args:
        lab: the lab.
        files: the lab's programs and files by their names.
        folder: where the packages' folders are created.

    Raises:
        KitError: as for `write_package`. If a package exists already, nothing is written.
    """
    found = packages_of(lab, files)
    _refuse_what_is_there(folder, [*found, *packages_in(files)])
    title = f"Programs and launch files of {lab.name}"
    return {name: write_package(name, title, of, folder) for name, of in found.items()}


def _refuse_what_is_there(folder: Path, names: Iterable[str]) -> None:
    for made in names:
        if (folder / made).exists():
            raise KitError(
                f"{folder / made} exists already and stays as it is.", "Move it away, or name another folder."
            )


def write_package(name: str, title: str, files: Mapping[str, str], folder: Path) -> Path:
    """Write a package, and beside it the packages that are complete already. Return the folder of the first.

    Args:
        name: the name of the package.
        title: one line for its description.
        files: programs (`NAME.py`) and other files by their names; those below `src/` belong to complete packages.
        folder: where the packages' folders are created, such as the `src` of a workspace.

    Raises:
        KitError: one of the packages exists already, and is left as it is; or there are no programs.
    """
    _refuse_what_is_there(folder, [name, *packages_in(files)])
    complete = {
        file.removeprefix(f"{SOURCES}/"): text for file, text in files.items() if file.startswith(f"{SOURCES}/")
    }
    files = {file: text for file, text in files.items() if not file.startswith(f"{SOURCES}/")}
    programs = sorted(file.removesuffix(".py") for file in files if file.endswith(".py"))
    if not programs:
        raise KitError("There are no programs to make a package of.", "Programs are cells with `%%node NAME`.")
    texts = {
        "package.xml": _package_xml(name, title, files),
        "setup.py": _SETUP_PY.format(
            name=name,
            scripts="\n".join(f'            "{program} = {name}:run_{program}",' for program in programs),
        ),
        "setup.cfg": _SETUP_CFG.format(name=name),
        f"resource/{name}": "",
        f"{name}/__init__.py": _INIT_PY.format(
            functions="".join(f'\n\ndef run_{program}() -> None:\n    _start("{program}")\n' for program in programs)
        ),
        **{f"{_place(file, text, name)}/{file}": text for file, text in files.items()},
    }
    for path, text in {**{f"{name}/{path}": text for path, text in texts.items()}, **complete}.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder / name


def _place(file: str, text: str, name: str) -> str:
    """Return the folder in the package to which a file belongs."""
    if file.endswith(".py"):
        return name
    return "launch" if _LAUNCH_FILE.search(file) or node_keys(text) else "config"


def _package_xml(name: str, title: str, files: Mapping[str, str]) -> str:
    used = {found for file, text in files.items() if file.endswith(".py") for found in _IMPORT.findall(text)}
    depends = {"rclpy"} | {package for package in used if _ROS_PACKAGE.fullmatch(package)}
    depends |= {"launch_ros", "launch_yaml", "ros2launch"} if any(".launch." in file for file in files) else set()
    lines = "\n".join(f"  <exec_depend>{package}</exec_depend>" for package in sorted(depends))
    return _PACKAGE_XML.format(name=name, description=escape(title), depends=lines)
