"""A JupyterHub for a course: its folder, and a real hub with two users of this machine."""

from __future__ import annotations

import importlib.util
import json
import os
import pwd
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import requests
import toy
from checkouts import ENVIRON, make, write_lock
from linked import link_tree

from autograder.authoring.hub import write_hub
from autograder.core.errors import KitError

HUB = "http://127.0.0.1:18888"
USERS = ("hub-test-ann", "hub-test-bob")
AS_IN_A_TEST = f"""
c.JupyterHub.bind_url = "{HUB}"
c.JupyterHub.hub_port = 18881
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:18882"
c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.DummyAuthenticator.password = "secret"
c.JupyterHub.services = c.JupyterHub.load_roles = []
c.JupyterHub.load_groups = {{}}
"""
"""The users of the test have no passwords, and the machine may lack the group of the instructors."""

PYTHON = shutil.which(f"python3.{sys.version_info.minor}", path="/usr/bin:/usr/local/bin")
"""A Python of this version that every user may run."""
needs_root = pytest.mark.skipif(os.getuid() != 0, reason="only root may give the folders of a hub to their owners")


def lacking() -> str:
    """What a real hub needs and this machine does not have; empty if it has all."""
    programs = [name for name in ("configurable-http-proxy", "useradd", "userdel") if shutil.which(name) is None]
    if importlib.util.find_spec("jupyterhub") is None:
        programs.append("jupyterhub")
    if PYTHON is None:
        programs.append("a Python of this version in /usr that every user may run")
    return ", ".join(programs)


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder that every user of the machine may enter, unlike pytest's own."""
    folder = Path(tempfile.mkdtemp(prefix="hub-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def course_of(place: Path, owner: str) -> Path:
    from autograder.authoring.release import START_PAGE, release, start_page

    root = toy.make_course(place / "course")
    release(root, toy.LAB)
    (root / "labs" / START_PAGE).write_text(start_page(root / "labs"), encoding="utf-8")
    shutil.chown(root, owner)
    return root


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@needs_root
def test_the_folder_of_a_hub_belongs_to_root_and_its_exchange_to_the_grader(place: Path) -> None:
    root = course_of(place, "nobody")
    hub = place / "ros2"
    write_hub(root, None, hub)
    exchange = hub / "exchange" / "ros2"
    assert mode(hub / "exchange") == 0o1777 and mode(hub / "state") == 0o700
    assert {path.name: mode(path) for path in exchange.iterdir()} == {
        "inbound": 0o2733, "outbound": 0o755, "feedback": 0o711,
    }  # fmt: skip
    assert exchange.owner() == "nobody" and (hub / "ros2-labs" / "kit" / "labs" / "toy" / "toy.ipynb").is_file()
    settings = json.loads((hub / "settings" / "nbgrader_config.json").read_text())
    assert settings["CourseDirectory"]["course_id"] == "ros2" and settings["Exchange"]["root"] == str(hub / "exchange")
    configuration = hub / "jupyterhub_config.py"
    assert f'COURSE = Path("{root}")' in configuration.read_text() and "@" not in configuration.read_text()

    configuration.write_text("# changed by the administrator")
    (hub / "ros2-labs" / ".venv").mkdir()
    told = write_hub(root, None, hub)  # a new version of the labs
    assert configuration.read_text() == "# changed by the administrator" and "kept as it is" in told[-1]
    assert (hub / "ros2-labs" / ".venv").is_dir()


@needs_root
def test_a_course_that_belongs_to_root_is_not_served(place: Path) -> None:
    with pytest.raises(KitError, match="belongs to root") as refused:
        write_hub(course_of(place, "root"), None, place / "ros2")
    assert "chown" in refused.value.do and not (place / "ros2").exists()


class Browser(requests.Session):
    """Somebody's browser at the hub."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name
        token = re.search(r'name="_xsrf" value="([^"]+)"', self.get(f"{HUB}/hub/login").text)
        assert token is not None
        answer = self.post(
            f"{HUB}/hub/login", {"username": name, "password": "secret", "_xsrf": token[1]}, allow_redirects=False
        )
        assert answer.status_code == 302

    def start(self) -> None:
        """Start this user's server, and wait until it answers."""
        self.get(f"{HUB}/hub/spawn/{self.name}")
        deadline = time.monotonic() + 120
        while "/hub/" in self.get(f"{HUB}/user/{self.name}/api").url:
            assert time.monotonic() < deadline, "the server does not start"
            time.sleep(0.5)
        assert self.at("lab").status_code == 200

    def at(self, path: str, user: str = "") -> requests.Response:
        return self.get(f"{HUB}/user/{user or self.name}/{path}")


@pytest.fixture
def hub(place: Path) -> Iterator[Path]:
    """A running hub with two users; the folder of it."""
    book = place / "book"
    book.mkdir()
    (book / "index.html").write_text("<h1>Lectures</h1>", encoding="utf-8")
    folder = place / "ros2"
    write_hub(course_of(place, "nobody"), book, folder)
    kit = folder / "ros2-labs"
    write_lock(kit, "requirements.lock", "uv")
    made = make(kit, "setup", f"PYTHON={PYTHON}")
    assert made.returncode == 0, made.stderr
    for name in ("lib", "share", "etc/jupyter/jupyter_server_config.d"):  # what the lock would have installed
        link_tree(Path(sys.prefix, name), kit / ".venv" / name)
    configuration = folder / "jupyterhub_config.py"
    text = configuration.read_text().replace("list(grp.getgrnam(INSTRUCTORS).gr_mem)", "[]")
    configuration.write_text(text + AS_IN_A_TEST)
    for user in USERS:
        subprocess.run(["useradd", "--create-home", "--home-dir", place / user, user], check=True)
        (place / user).chmod(0o755)
    with (place / "hub.log").open("w") as log:
        command = [kit / ".venv" / "bin" / "python", "-m", "jupyterhub", "-f", configuration]
        process = subprocess.Popen(
            command, cwd=folder / "state", env=ENVIRON | {"PATH": os.environ["PATH"]}, stdout=log, stderr=log
        )
    try:
        deadline = time.monotonic() + 120
        while "is now running" not in (place / "hub.log").read_text(errors="replace"):
            assert process.poll() is None and time.monotonic() < deadline, (place / "hub.log").read_text()[-2000:]
            time.sleep(0.2)
        yield folder
    finally:
        process.terminate()
        process.wait(60)
        for user in USERS:
            end_all_of(user)
            subprocess.run(["userdel", "--remove", user], check=False, capture_output=True)


def end_all_of(user: str) -> None:
    """End what a user of the test has started."""
    number = pwd.getpwnam(user).pw_uid
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        theirs = [path for path in Path("/proc").glob("[0-9]*") if owner_of(path) == number]
        if not theirs:
            return
        for path in theirs:
            subprocess.run(["kill", "-KILL", path.name], check=False, capture_output=True)
        time.sleep(0.2)


def owner_of(path: Path) -> int:
    try:
        return path.stat().st_uid
    except OSError:
        return -1


@needs_root
@pytest.mark.skipif(bool(lacking()), reason=f"a real hub needs what this machine lacks: {lacking()}")
def test_students_of_a_real_hub_have_the_labs_the_lectures_and_no_formgrader(hub: Path, place: Path) -> None:
    ann, bob = map(Browser, USERS)
    ann.start()
    bob.start()
    page = ann.at("api/contents/README.md").json()["content"]
    assert "Assignment List" in page and "(toy/toy.ipynb)" in page
    link = re.search(r"\[Read the lectures\]\(([^)]+)\)", page)
    assert link is not None and ann.get(HUB + link[1]).text == "<h1>Lectures</h1>"
    assert ann.at("lab/tree/README.md").status_code == 200
    found = re.search(r'"disabledExtensions":\s*(\[.*?\]|\{.*?\})', ann.at("lab").text, re.DOTALL)
    assert found is not None and "nbgrader:formgrader" in found[1] and "assignment-list" not in found[1]
    assert ann.at("formgrader").status_code == 404
    listed = ann.at("assignments?course_id=ros2").json()
    assert listed == {"success": True, "value": []}

    assert [mode(place / user) for user in USERS] == [0o700, 0o700]
    assert ann.at("api/contents/", user=USERS[1]).status_code in (403, 404)
