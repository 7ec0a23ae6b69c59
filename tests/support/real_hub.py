"""A real JupyterHub that serves a course to users of this machine, as the page about the hub sets it up."""

from __future__ import annotations

import grp
import importlib.util
import json
import os
import pwd
import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import requests
from checkouts import ENVIRON, make, write_lock
from linked import link_tree
from own_environment import Environment

from autograder.authoring.hub import write_hub

LAB = "lab1_greeter"
"""The lab of a new course."""
SECONDS = 300
"""Far beyond what a step takes on a busy machine."""
OPENINGS = 5
"""How often a person opens a notebook whose kernel does not come up."""
PASSWORD = "hub-of-a-test"
SERVER = "etc/jupyter/jupyter_server_config.d"
"""Where packages say which extensions of JupyterLab they bring."""
GROUPS = ("hub-t-students", "hub-t-teachers")
PYTHON = shutil.which(f"python3.{sys.version_info.minor}", path="/usr/bin:/usr/local/bin")
"""A Python of this version that every user may run."""


def lacking() -> str:
    """What a real hub needs and this machine does not have, with the command that installs it; empty if it has all."""
    found = []
    if os.getuid() != 0:
        found.append("root, who makes users and lets the hub start their servers")
    if shutil.which("configurable-http-proxy") is None:
        found.append("the hub's proxy (npm install -g configurable-http-proxy)")
    if any(importlib.util.find_spec(name) is None for name in ("jupyterhub", "jupyterhub_idle_culler")):
        found.append("the hub (.venv/bin/uv pip install 'jupyterhub~=6.1' jupyterhub-idle-culler)")
    found += [name for name in ("useradd", "chpasswd", "runuser", "make") if shutil.which(name) is None]
    if PYTHON is None:
        found.append(f"a python3.{sys.version_info.minor} in /usr that every user may run")
    return ", ".join(found)


def free_port() -> int:
    """A port that nothing uses at this moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def wait_for(what: Callable[[], Any], told: str) -> Any:
    """Wait until something is true, and return it."""
    deadline = time.monotonic() + SECONDS
    while not (found := what()):
        assert time.monotonic() < deadline, told
        time.sleep(0.5)
    return found


class Hub:
    """The hub with its users; `start` it, and `remove` all in the end."""

    def __init__(self, place: Path, students: Sequence[str], grader: str) -> None:
        """Describe the hub; nothing is made yet.

        Args:
            place: a folder that every user of the machine may enter.
            students: the names of the students.
            grader: the name of the user to whom the course belongs.
        """
        self.place, self.students, self.grader = place, students, grader
        self.process: subprocess.Popen[bytes] | None = None
        self.address = f"http://127.0.0.1:{free_port()}"
        self.folder, self.course = place / "ros2", place / grader / "course"

    def make_users(self) -> None:
        """Make the users and their groups."""
        for group in GROUPS:
            subprocess.run(["groupadd", "--force", group], check=True)
        for user in (self.grader, *self.students):
            self._add_user(user, () if user == self.grader else ("--groups", GROUPS[0]))

    def _add_user(self, user: str, options: Sequence[str]) -> None:
        command = ["useradd", "--create-home", "--home-dir", self.place / user, "--shell", "/bin/bash", *options, user]
        subprocess.run(command, check=True)
        subprocess.run(["chpasswd"], input=f"{user}:{PASSWORD}\n", text=True, check=True)

    def set_up(self) -> None:
        """Write the course and the folder of the hub, with an environment for each."""
        assert PYTHON is not None
        environment = Environment(self.place / "graders", PYTHON)
        link_tree(Path(sys.prefix, SERVER), environment.folder / SERVER)
        for program in ("nbgrader", "jupyterhub-singleuser"):
            environment.link_program(program)
        for words in (("new", "course", str(self.course)), ("release", "--course", str(self.course))):
            self.run_as(self.grader, self.place / self.grader, str(environment.folder / "bin" / "autograder"), *words)
        (self.course / ".venv").symlink_to(environment.folder)

        book = self.place / "book"
        book.mkdir()
        (book / "index.html").write_text("<h1>Lectures</h1>", encoding="utf-8")
        write_hub(self.course, book, self.folder)
        kit = self.folder / "ros2-labs"
        write_lock(kit, "requirements.lock", "uv")
        made = make(kit, "setup", f"PYTHON={PYTHON}")
        assert made.returncode == 0, made.stderr
        for old in kit.glob(".venv/lib/python*/site-packages/*"):
            if old.name.startswith(("setuptools", "pkg_resources", "_distutils_hack")):
                shutil.rmtree(old)  # the base Python's own version, which must not be mixed with the locked one
        for name in ("lib", "share", SERVER):  # what the lock would have installed
            link_tree(Path(sys.prefix, name), kit / ".venv" / name)
        configuration = self.folder / "jupyterhub_config.py"
        text = configuration.read_text(encoding="utf-8").replace('"students", "instructors"', f"{GROUPS}"[1:-1])
        text = text.replace("http://127.0.0.1:8000", self.address)
        text += f"c.JupyterHub.hub_port = {free_port()}\n"
        text += f'c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:{free_port()}"\n'
        text += "c.JupyterHub.authenticate_prometheus = False\n"
        text += "c.JupyterHub.concurrent_spawn_limit = 0\n"
        configuration.write_text(text, encoding="utf-8")

    def run_as(self, user: str, cwd: Path, *words: str) -> str:
        """Run a command as a user, and return what it printed."""
        environ = {"HOME": str(self.place / user), "PATH": "/usr/sbin:/usr/bin:/bin", "LANG": "C.UTF-8"}
        done = subprocess.run(
            ["runuser", "-u", user, "--", *words], cwd=cwd, env=environ, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def start(self) -> None:
        """Start the hub and its proxy, and wait until the hub answers."""
        configuration = self.folder / "jupyterhub_config.py"
        command = [self.folder / "ros2-labs/.venv/bin/python", "-m", "jupyterhub", "-f", configuration]
        environ = ENVIRON | {"PATH": os.environ["PATH"]}
        with (self.place / "hub.log").open("a") as log:
            self.process = subprocess.Popen(command, cwd=self.folder / "state", env=environ, stdout=log, stderr=log)
        wait_for(self._answers, "the hub does not start")

    def _answers(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, self.log()[-3000:]
        try:
            return requests.get(f"{self.address}/hub/api", timeout=10).status_code == 200
        except requests.ConnectionError:
            return False

    def log(self) -> str:
        """What the hub has logged."""
        return (self.place / "hub.log").read_text(encoding="utf-8", errors="replace")

    def stop(self) -> None:
        """Stop the hub as `systemctl restart` does; the users' servers go on."""
        if self.process is not None:
            self.process.terminate()
            self.process.wait(SECONDS)
            self.process = None

    def remove(self) -> None:
        """End all that the users have started, and remove them."""
        self.stop()
        for user in (self.grader, *self.students):
            try:
                number = pwd.getpwnam(user).pw_uid
            except KeyError:
                continue
            wait_for(lambda number=number: not end_all_of(number), f"{user} still has processes")
            shutil.rmtree(f"/tmp/autograder-log-{number}", ignore_errors=True)
            subprocess.run(["userdel", "--remove", user], check=False, capture_output=True)
        for group in GROUPS:
            if any(one.gr_name == group for one in grp.getgrall()):
                subprocess.run(["groupdel", group], check=False, capture_output=True)


def processes_of(uid: int) -> list[Path]:
    """The folders in /proc of a user's processes that have not ended."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            state = (path / "stat").read_text().rpartition(")")[2].split()[0]
            if path.stat().st_uid == uid and state != "Z":
                found.append(path)
        except (OSError, IndexError):
            continue
    return found


def end_all_of(uid: int) -> list[Path]:
    """End what a user of the test has started, and return what there was."""
    found = processes_of(uid)
    for path in found:
        subprocess.run(["kill", "-KILL", path.name], check=False, capture_output=True)
    return found


class LostKernel(Exception):
    """A kernel that did not come up, or that has ended."""


class Person:
    """A user of the hub with a server, through the addresses that JupyterLab in a browser asks as well."""

    def __init__(self, hub: Hub, name: str) -> None:
        self.hub, self.name = hub, name
        self.lost_kernels = 0
        self.web = requests.Session()
        page = requests.get(f"{hub.address}/hub/login", timeout=SECONDS)
        token = re.search(r'name="_xsrf" value="([^"]+)"', page.text)
        assert token is not None
        form = {"username": name, "password": PASSWORD, "_xsrf": token[1]}
        came = requests.post(
            f"{hub.address}/hub/login", form, cookies=page.cookies, allow_redirects=False, timeout=SECONDS
        )
        assert came.status_code == 302, f"{name} cannot log in: {came.text[-1000:]}"
        auth = {"username": name, "password": PASSWORD}
        answer = self.web.post(f"{hub.address}/hub/api/users/{name}/tokens", json={"auth": auth}, timeout=SECONDS)
        assert answer.status_code in (200, 201), answer.text
        self.token = answer.json()["token"]
        self.web.headers["Authorization"] = f"token {self.token}"

    def start(self) -> None:
        """Start this user's server, and wait until it answers."""
        asked = self.web.post(f"{self.hub.address}/hub/api/users/{self.name}/server", timeout=SECONDS)
        assert asked.status_code in (201, 202), asked.text
        wait_for(
            lambda: self.get("api/status").ok, f"the server of {self.name} does not start:\n{self.hub.log()[-3000:]}"
        )

    def get(self, path: str, user: str = "") -> requests.Response:
        """Ask this user's server, or that of another one."""
        return self.web.get(f"{self.hub.address}/user/{user or self.name}/{path}", timeout=SECONDS)

    def ask(self, method: str, path: str, **options: Any) -> Any:
        """Ask this user's server for what must work, and return its answer."""
        answer = self.web.request(method, f"{self.hub.address}/user/{self.name}/{path}", timeout=SECONDS, **options)
        assert answer.ok, f"{path}: {answer.status_code} {answer.text[-1000:]}"
        return answer.json()

    def assignment(self, action: str) -> None:
        """Click on *Fetch*, *Submit* or *Fetch Feedback* in the list of assignments."""
        told = self.ask("POST", f"assignments/{action}", data={"course_id": "ros2", "assignment_id": LAB})
        assert told["success"], told

    def open(self, path: str) -> None:
        """Open a notebook, so that it has a kernel. If the kernel does not come up, open it again, as a user would."""
        body = {"path": path, "type": "notebook", "name": path, "kernel": {"name": "python3"}}
        for _ in range(OPENINGS):
            session = self.ask("POST", "api/sessions", json=body)
            self.kernel = session["kernel"]["id"]
            try:
                self.run("None")
                return
            except LostKernel:
                self.lost_kernels += 1
                self.web.delete(f"{self.hub.address}/user/{self.name}/api/sessions/{session['id']}", timeout=SECONDS)
        raise AssertionError(f"the kernel of {self.name} did not come up {OPENINGS} times")

    def run(self, code: str) -> str:
        """Run a cell in the open notebook's kernel, and return the text of its outputs.

        Raises:
            LostKernel: the kernel has ended, also if the server starts it again.
        """
        import websocket

        address = f"{self.hub.address}/user/{self.name}/api/kernels/{self.kernel}/channels"
        header = {"msg_id": os.urandom(8).hex(), "session": "test", "username": "", "msg_type": "execute_request"}
        content = {"code": code, "silent": False, "store_history": True, "allow_stdin": False, "stop_on_error": True}
        message = {"header": header, "parent_header": {}, "metadata": {}, "content": content, "channel": "shell"}
        try:
            line = websocket.create_connection(
                address.replace("http", "ws", 1), header=[f"Authorization: token {self.token}"], timeout=SECONDS
            )
        except websocket.WebSocketBadStatusException as error:
            raise LostKernel(self.name) from error
        told, ended = [], False
        try:
            line.send(json.dumps(message | {"buffers": []}))
            while not ended:
                one = json.loads(line.recv())
                if one["msg_type"] == "status" and one["content"]["execution_state"] in ("restarting", "dead"):
                    raise LostKernel(self.name)
                if one.get("parent_header", {}).get("msg_id") != header["msg_id"]:
                    continue
                given = one["content"]
                told.append(given.get("text") or given.get("data", {}).get("text/plain", ""))
                told += [re.sub(r"\x1b\[[\d;]*m", "", row) for row in given.get("traceback", [])]
                ended = one["msg_type"] == "status" and given["execution_state"] == "idle"
        finally:
            line.close()
        return "\n".join(filter(None, told))


def release_lab(grader: Person) -> None:
    """Release the lab from the graders' server."""
    grader.kernel = grader.ask("POST", "api/kernels", json={"name": "python3"})["id"]
    assert grader.get("formgrader").ok
    told = grader.run(f"!nbgrader generate_assignment {LAB}; nbgrader release_assignment {LAB}")
    assert f"Released as: ros2 {LAB}" in told, told


def grade_class(grader: Person) -> str:
    """Grade what was handed in, release the feedback, and return what the commands printed."""
    inbound = grader.hub.folder / "exchange" / "ros2" / "inbound"
    told = grader.run(f"!autograder grade {LAB} {inbound}; nbgrader release_feedback {LAB}")
    assert "Feedback released" in told, told
    return told


def write_answers(person: Person, answers: dict[str, str]) -> None:
    """Fill in the answers of the fetched lab, by grade_id, and open it."""
    path = f"{LAB}/{LAB}.ipynb"
    notebook = person.ask("GET", f"api/contents/{path}")["content"]
    for cell in notebook["cells"]:
        cell["source"] = answers.get(cell["metadata"].get("nbgrader", {}).get("grade_id", ""), cell["source"])
    person.ask("PUT", f"api/contents/{path}", json={"type": "notebook", "format": "json", "content": notebook})
    person.open(path)


def start_robot(person: Person, greeter: str) -> None:
    """Start the notebook's program, with the user's name as its namespace; it runs on until `robot.stop()`."""
    told = person.run("%load_ext autograder\nfrom autograder.checks import launch")
    assert "Error" not in told, told
    person.run(greeter)
    told = person.run(f'robot = launch("greeter", namespace="/{space_of(person.name)}").start()')
    assert f"/{space_of(person.name)}/greeter" in told, told


def space_of(user: str) -> str:
    """The namespace of a user's robot."""
    return user.replace("-", "_")
