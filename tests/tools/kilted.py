"""Runs the book's *measured* statements and the labs' solutions on ROS 2 Kilted, and prints a table of what differs.

`make kilted`. The course runs on Jazzy. This says which of its statements can be kept on the next distribution. A copy
of the checkout below `build/kilted` gets an environment of its own, in which each package of Jazzy is replaced by
Kilted's of the same name. Nothing else of the kit needs that environment. The first run needs the network.

What does not hold is run again, at most three times in all: on a busy machine a program may come too late for an
experiment. Only what never held differs; what held at last is listed with the number of runs.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent.parent
PLACE = ROOT / "build" / "kilted"
KIT = PLACE / "kit"
LOCK = "requirements-dev.lock"
RUNS = 3

PACKAGES = {
    # Kilted builds interfaces without the first, and needs the second.
    "ros-jazzy-python-cmake-module": "ros-kilted-ament-cmake-ros-core",
    "ros-jazzy-": "ros-kilted-",
}
"""Names of packages in pyproject.toml, and what they are called in Kilted."""
WORDS = {
    "FASTRTPS_DEFAULT_PROFILES_FILE": "FASTDDS_DEFAULT_PROFILES_FILE",
    "heartbeatPeriod": "heartbeat_period",
}
"""What Fast DDS 3, which comes with Kilted, calls otherwise than Fast DDS 2."""
SET_BY_WHEELS = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
"""What the wheels of an environment set when Python starts: where their libraries are, and that this is known."""


def replaced(text: str, words: dict[str, str]) -> str:
    """The text with each of the words replaced, in their order."""
    for old, new in words.items():
        text = text.replace(old, new)
    return text


def environment() -> dict[str, str]:
    """The environment of the copy's programs, without what the wheels have set for the course's own environment.

    With it, the copy's Python would look for the libraries of Jazzy, and nothing of Kilted could be loaded.
    """
    kept = {name: value for name, value in os.environ.items() if name not in SET_BY_WHEELS}
    path = os.pathsep.join([str(KIT / ".venv" / "bin"), os.environ.get("PATH", "")])
    return {**kept, "PATH": path, "PYTHONPATH": "tests/support"}


def copy_kit(kit: Path) -> None:
    """Copy the checkout's files, and change the words in which the two distributions differ. The environment stays."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
    kit.mkdir(parents=True, exist_ok=True)
    for old in kit.iterdir():
        if old.name not in (".venv", "build"):
            shutil.rmtree(old) if old.is_dir() and not old.is_symlink() else old.unlink()
    for name in filter(None, names):
        if (ROOT / name).exists() or (ROOT / name).is_symlink():
            (kit / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, kit / name, follow_symlinks=False)
    pyproject = kit / "pyproject.toml"
    pyproject.write_text(replaced(pyproject.read_text(encoding="utf-8"), PACKAGES), encoding="utf-8")
    for path in (path for folder in ("autograder", "lectures") for path in (kit / folder).rglob("*")):
        if path.suffix in (".py", ".xml", ".md") and not path.is_symlink():
            text = path.read_text(encoding="utf-8")
            if replaced(text, WORDS) != text:
                path.write_text(replaced(text, WORDS), encoding="utf-8")


def set_up() -> None:
    """Pin Kilted's packages beside the versions that the course has of everything else, and install them."""
    # A pin may hold on some versions of Python only, which is said after a semicolon.
    pins = re.findall(r"^(?!ros)\S+==[^\\\n]+", (ROOT / LOCK).read_text(encoding="utf-8"), re.MULTILINE)
    constraints = PLACE / "constraints.txt"
    constraints.write_text("\n".join(pins) + "\n", encoding="utf-8")
    options = ["--quiet", "--universal", "--python-version", "3.11", "--generate-hashes", "--no-emit-index-url"]
    options += ["--no-emit-find-links", "--no-annotate", "--no-header", "--extra", "lectures", "--extra", "dev"]
    # uv keeps the versions of the file that it writes, so that a second run installs nothing.
    options += ["--constraint", str(constraints), "-o", str(PLACE / LOCK)]
    subprocess.run(["uv", "pip", "compile", "pyproject.toml", *options], cwd=KIT, check=True)
    shutil.copy(PLACE / LOCK, KIT / LOCK)
    subprocess.run(["make", "--no-print-directory", "setup-dev"], cwd=KIT, check=True)


def in_kit(*command: str) -> str:
    """What a program of the copy's environment prints, whatever its exit status is."""
    program = KIT / ".venv" / "bin" / command[0]
    done = subprocess.run([program, *command[1:]], cwd=KIT, env=environment(), capture_output=True, text=True)
    # A cell that raises takes all its statements with it, so the reason is worth a look.
    for line, place in pairwise(done.stderr.splitlines()):
        if line.startswith("a cell ended with"):
            print(f"{command[-1]}: {line}\n{place}", file=sys.stderr)
    if not done.stdout.strip():
        sys.exit(f"{' '.join(command)} printed nothing. Its last words:\n{done.stderr[-2000:]}")
    return done.stdout


def statements(page: str) -> dict[str, str]:
    """For each statement of a page that does not hold what is wrong with it."""
    held = json.loads(in_kit("python", "tests/lectures/test_lecture_claims.py", page))
    return {key: "does not hold" for key, holds in held.items() if not holds}


def points(lab: str) -> dict[str, str]:
    """For each check that a lab's solution does not pass in full its points, and the first reason."""
    result = json.loads(in_kit("autograder", "check", f"solutions/{lab}/{lab}.ipynb", "--json"))
    lost = {}
    for check in result["checks"]:
        if check["points"] != check["max_points"]:
            because = next((outcome["because"] for outcome in check["outcomes"] if outcome["because"]), "")
            got = "undecided" if check["points"] is None else f"{check['points']:g} of {check['max_points']:g} points"
            lost[check["title"]] = f"{got}: {because}"
    return lost


def differences(ask: Callable[[str], dict[str, str]], what: str) -> dict[str, str]:
    """What differs, asked until nothing does, at most three times; what held in the end is said, too."""
    first = found = ask(what)
    runs = 1
    while found and runs < RUNS:
        runs += 1
        again = ask(what)
        found = {key: again[key] for key in found if key in again}
    held = {key: "held in one of several runs" for key in first if key not in found}
    return {**held, **{key: f"{text} (in {runs} of {runs} runs)" for key, text in found.items()}}


def versions() -> dict[str, str]:
    """The versions that the copy runs on."""
    names = ("ros-rclpy", "ros-rcl", "ros-fastdds", "ros-rmw-fastrtps-cpp")
    asked = f"import importlib.metadata as m, json; print(json.dumps({{n: m.version(n) for n in {names!r}}}))"
    found: dict[str, str] = json.loads(in_kit("python", "-c", asked))
    return found


def table(rows: list[tuple[str, str, str]]) -> str:
    """The rows as a table in Markdown, as the page "Which ROS this is" has it."""
    lines = ["| where | what | on Kilted |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows)])


def main(only: list[str]) -> None:
    """Run everything, or the pages and labs that are named, and print the table."""
    PLACE.mkdir(parents=True, exist_ok=True)
    copy_kit(KIT)
    set_up()
    book: dict[str, Any] = tomllib.loads((ROOT / "course.toml").read_text(encoding="utf-8"))
    labs = sorted(path.parent.name for path in ROOT.glob("solutions/*/*.ipynb"))
    rows: list[tuple[str, str, str]] = []
    for ask, names in ((statements, list(book["lectures"].values())), (points, labs)):
        for name in (name for name in names if not only or name in only):
            found = differences(ask, name)
            rows += [(f"`{name}`", key, text) for key, text in found.items()] or [
                (f"`{name}`", "everything", "the same")
            ]
            print(f"{name}: {len(found)} differences", file=sys.stderr)
    print(", ".join(f"{name} {version}" for name, version in versions().items()) + "\n\n" + table(rows))


if __name__ == "__main__":
    main(sys.argv[1:])
