"""Write the folder from which a JupyterHub serves a course: its configuration, the students' kit, and the exchange."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path

from autograder.authoring.student_kit import NAME, write_kit
from autograder.core.errors import KitError
from autograder.core.files import write_beside
from autograder.setup.places import KIT_FOLDER

CONFIGURATION = "jupyterhub_config.py"
_LONGEST = 40
"""The most characters of the folder's path. It begins the paths of the kernels' sockets, which can have 107."""
_TEMPLATE = Path(__file__).with_name("templates") / "jupyterhub_config.template"
# Without this setting, terminals are login shells, in which /etc/profile sets another PATH.
_TERMINALS = {"ServerApp": {"terminado_settings": {"shell_command": ["/bin/bash"]}}}
_ASSIGNMENT_LIST = {"ServerApp": {"jpserver_extensions": {"nbgrader.server_extensions.assignment_list": True}}}
# A student's kit switches off all of nbgrader. On a hub, students have the list of assignments.
_ONLY_ASSIGNMENT_LIST = {
    "disabledExtensions": {
        "@jupyter/nbgrader": False,
        **{f"@jupyter/nbgrader:{one}": True for one in ("course-list", "create-assignment", "formgrader")},
        "@jupyter/nbgrader:validate-assignment": True,
    }
}
_EXCHANGE = {"": 0o1777, "outbound": 0o755, "inbound": 0o2733, "feedback": 0o711}
"""The folders of nbgrader's exchange and their permissions, which are nbgrader's own. Students must be able to write to
the exchange itself; the sticky bit keeps them from removing the course's folder."""


def write_hub(root: Path, book: Path | None, folder: Path) -> list[str]:
    """Write the folder of a hub, or bring the kit in it up to date, and return a line for each part.

    The configuration is written only once, because administrators change it.

    Args:
        root: the course's folder. Its owner becomes the user who grades.
        book: a folder with the lectures as HTML; None if students get no lectures.
        folder: the folder to write. Its name is the course's name in nbgrader's exchange.

    Raises:
        KitError: the caller is not root, the course belongs to root, the folder's path is too long, or the students'
            kit cannot be written.
        OSError: the folder cannot be written.
    """
    if os.getuid() != 0:
        raise KitError("Only root can give the folders of a hub to their owners.", "Run it with sudo.")
    grader = root.owner()
    if grader == "root":
        raise KitError(
            f"The course in {root} belongs to root, so no user could grade it.",
            f"Give it to a user of its own: chown -R grader: {root}",
        )
    folder = folder.resolve()
    if len(str(folder)) > _LONGEST:
        raise KitError(
            f"The path {folder} has more than {_LONGEST} characters, which is too long for the sockets of kernels.",
            "Name another folder, such as /srv/ros2.",
        )
    os.umask(0o022)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        write_kit(root, book, Path(place))
        _put(Path(place) / NAME, folder / NAME)
    exchange = {"CourseDirectory": {"course_id": folder.name}, "Exchange": {"root": str(folder / "exchange")}}
    settings = folder / "settings"
    for name, content in {
        "nbgrader_config.json": exchange,
        "jupyter_server_config.json": _TERMINALS,
        "students/jupyter_server_config.json": _ASSIGNMENT_LIST,
        "students/labconfig/page_config.json": _ONLY_ASSIGNMENT_LIST,
    }.items():
        write_beside(settings / name, json.dumps(content, indent=2) + "\n")
        (settings / name).chmod(0o644)
    (folder / "state").mkdir(mode=0o700, exist_ok=True)
    _make_exchange(folder / "exchange", folder.name, grader)
    told = [f"{folder / NAME}: the students' kit", f"{folder / 'exchange'}: nbgrader's exchange, filled by {grader}"]
    configuration = folder / CONFIGURATION
    if configuration.exists():
        return [*told, f"{configuration}: kept as it is"]
    text = _TEMPLATE.read_text(encoding="utf-8").replace("@COURSE@", str(root)).replace("@GRADER@", grader)
    write_beside(configuration, text)
    return [*told, f"{configuration}: the hub's configuration; read it, and change what is different on this machine"]


def _put(made: Path, kit: Path) -> None:
    """Replace the files of the students' kit, and keep its environment, which set-up brings up to date."""
    for part in (KIT_FOLDER, "lectures"):
        shutil.rmtree(kit / part, ignore_errors=True)
    shutil.copytree(made, kit, dirs_exist_ok=True)
    kit.chmod(0o755)


def _make_exchange(exchange: Path, course: str, grader: str) -> None:
    for name, mode in _EXCHANGE.items():
        folder = exchange / course / name if name else exchange
        folder.mkdir(parents=True, exist_ok=True)
        if name:
            shutil.chown(folder, grader)
        folder.chmod(mode)
    shutil.chown(exchange / course, grader)
    (exchange / course).chmod(0o755)
