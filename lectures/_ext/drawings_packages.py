"""Concept drawings of lecture 7: a workspace and who looks where, and what is made of an interface."""

from __future__ import annotations

from collections.abc import Callable

from autograder.core.results import Picture
from autograder.pictures.svg import Canvas


def workspace() -> Picture:
    """The folders of a workspace, and what reads and writes them."""
    canvas = Canvas(356)
    canvas.box(20, 44, 250, 290, round=12, fill="#f6f6f6")
    canvas.words(145, 32, "src: yours", anchor="middle", bold=True)
    for number, name in enumerate(("car_interfaces", "car_signs", "car_motors")):
        canvas.box(44, 66 + number * 62, 202, 48, look=number, round=8)
        canvas.words(145, 96 + number * 62, name, anchor="middle", halo=True)
    canvas.words(145, 276, "package.xml", anchor="middle")
    canvas.words(145, 304, "in each of them", anchor="middle")
    canvas.line([(272, 180), (366, 180)], arrow=True, line=2.6)
    canvas.words(450, 128, "colcon build", anchor="middle", bold=True)
    canvas.box(370, 146, 160, 66, round=12, line=2.2)
    canvas.words(450, 174, "what is needed", anchor="middle")
    canvas.words(450, 198, "comes first", anchor="middle")
    canvas.line([(450, 214), (450, 268)], arrow=True, dashed=True)
    canvas.words(450, 292, "build, log", anchor="middle")
    canvas.words(450, 318, "may be deleted", anchor="middle")
    canvas.line([(532, 180), (626, 180)], arrow=True, line=2.6)
    canvas.box(630, 44, 250, 290, round=12, fill="#f6f6f6")
    canvas.words(755, 32, "install: what runs", anchor="middle", bold=True)
    for number, (path, who) in enumerate(
        (("lib/car_signs", "ros2 run"), ("share/car_signs", "ros2 launch"), ("setup.bash", "each new terminal"))
    ):
        canvas.box(648, 66 + number * 88, 214, 40, round=6)
        canvas.words(755, 92 + number * 88, path, anchor="middle")
        canvas.words(755, 126 + number * 88, f"for {who}", anchor="middle", italic=True)
    return canvas.picture(
        "A workspace. The folder src holds your packages, each with a package.xml. colcon build builds them, what is "
        "needed first. It writes build and log, which may be deleted, and install, which is what runs: lib/car_signs "
        "for ros2 run, share/car_signs for ros2 launch, and setup.bash for each new terminal."
    )


def set_up_files() -> Picture:
    """Which line of the set-up files puts what where."""
    canvas = Canvas(330)
    canvas.words(170, 28, "a line in a set-up file", anchor="middle", bold=True)
    canvas.words(690, 28, "what is installed", anchor="middle", bold=True)
    rows = (
        ("entry_points", "setup.py", "lib/car_signs/reader", 0),
        ("install_scripts", "setup.cfg", "", 0),
        ("packages", "setup.py", "the Python modules", 1),
        ("data_files", "setup.py", "marker, launch files, config", 2),
        ("name, exec_depend", "package.xml", "who I am, what I need", 3),
    )
    for number, (line, file, result, look) in enumerate(rows):
        y = 46 + number * 56
        canvas.box(20, y, 300, 44, look=look, round=6)
        canvas.words(170, y + 29, line, anchor="middle", halo=True)
        canvas.words(340, y + 29, file, size=16)
        if result:
            below = 28 if line == "entry_points" else 0
            canvas.box(500, y + below, 380, 44, look=look, round=6)
            canvas.words(690, y + below + 29, result, anchor="middle", halo=True)
            canvas.line([(450, y + 22), (496, y + 22 + below)], arrow=True, line=2)
        else:
            canvas.line([(450, y + 22), (496, y - 6)], arrow=True, line=2)
    return canvas.picture(
        "Which line puts what where. entry_points in setup.py and install_scripts in setup.cfg together give the "
        "program lib/car_signs/reader. packages in setup.py gives the Python modules. data_files in setup.py gives the "
        "marker, launch files and config. name and exec_depend in package.xml say who the package is and what it needs."
    )


def interface_code() -> Picture:
    """What is made of one interface file."""
    canvas = Canvas(316)
    canvas.box(20, 110, 190, 90, look=1, round=10)
    canvas.words(115, 150, "Sign.msg", anchor="middle", bold=True, halo=True)
    canvas.words(115, 180, "seven lines", anchor="middle", halo=True)
    canvas.line([(212, 155), (286, 155)], arrow=True, line=2.6)
    canvas.box(290, 110, 170, 90, round=10, line=2.2)
    canvas.words(375, 150, "generators", anchor="middle", bold=True)
    canvas.words(375, 180, "and a compiler", anchor="middle")
    for y, head, words in (
        (20, "Python", "from car_interfaces.msg"),
        (116, "C and C++", "headers, libraries"),
        (212, "middleware", "message to bytes and back"),
    ):
        canvas.box(560, y, 320, 78, look=0 if y == 20 else None, round=10)
        canvas.words(720, y + 33, head, anchor="middle", bold=True, halo=True)
        canvas.words(720, y + 62, words, anchor="middle", halo=True)
        canvas.line([(462, 155), (556, y + 39)], arrow=True, line=2)
    return canvas.picture(
        "From one file, Sign.msg, generators and a compiler make three things: a Python module to import from, headers "
        "and libraries for C and C++, and for the middleware the code that turns a message into bytes and back."
    )


DRAWINGS: dict[str, Callable[[], Picture]] = {
    "workspace": workspace,
    "set-up-files": set_up_files,
    "interface-code": interface_code,
}
