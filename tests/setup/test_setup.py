"""Set-up on fresh checkouts: cold, warm, interrupted, moved, outdated, and on machines that lack something.

One checkout gets the whole lock. The others get a lock of two small packages, since it is the way there that counts.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from checkouts import BASE_PYTHON, ENVIRON, MAKE, SYSTEM_PATH, make, write_lock
from places import ROOT

from autograder.setup import bootstrap, refusals
from autograder.setup.labs import put_labs
from autograder.setup.places import MARKER

UNREACHABLE = "http://127.0.0.1:9/simple"
ORDINARY_USER = 12345


def check_out(folder: Path, *, whole_lock: bool = False) -> Path:
    """Copy what a clone of this tree would hold."""
    shutil.copytree(
        ROOT,
        folder,
        ignore=lambda path, names: [
            name
            for name in names
            if name in {".git", ".venv", "__pycache__", ".hypothesis"}
            or (path == str(ROOT) and name == "build")
            or name.endswith("_cache")
        ],
    )
    if not whole_lock:
        write_lock(folder, "requirements.lock", "uv")
        write_lock(folder, "requirements-dev.lock", "uv", "annotated-types")
    return folder


def imports(folder: Path, module: str) -> bool:
    """Whether the checkout's environment holds the module."""
    python = folder / ".venv" / "bin" / "python"
    return subprocess.run([python, "-I", "-c", f"import {module}"], env=ENVIRON, capture_output=True).returncode == 0


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def stand_in(folder: Path, name: str = "python3", **answer: object) -> Path:
    """Put a Python into `folder` that works, but says of itself what `answer` says."""
    says = {
        "program": BASE_PYTHON,
        "version": sys.version_info[:3],
        "build": "CPython64",
        "venv": True,
        "ensurepip": True,
        "pip": True,
    } | answer
    return script(
        folder / name,
        f"#!/bin/sh\ncase \"$*\" in *ensurepip*) echo '{json.dumps(says)}' ;; *) exec '{BASE_PYTHON}' \"$@\" ;; esac\n",
    )


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout with a small, finished environment, in a path with a space."""
    folder = check_out(tmp_path_factory.mktemp("set up") / "the course")
    done = make(folder, "setup")
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.complete  # `make test` itself begins with it
def test_the_whole_lock_makes_a_working_command_from_anywhere(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "my course", whole_lock=True)
    done = make(folder, "setup")
    assert done.returncode == 0, done.stderr
    assert "ready in" in done.stderr
    # As a link on somebody's search path, from another folder.
    (tmp_path / "link").symlink_to(folder / ".venv" / "bin" / "autograder")
    asked = subprocess.run(
        [tmp_path / "link", "doctor", "--json"], cwd="/", env=ENVIRON, capture_output=True, text=True, check=False
    )
    findings = {finding["name"]: finding for finding in json.loads(asked.stdout)["findings"]}
    assert findings["environment"]["good"], findings
    assert findings["environment"]["found"].startswith(f"{folder}/.venv agrees")
    assert findings["ROS 2"]["good"], findings

    # A newer lock must leave the ROS messages alone: their wheels carry metadata of other packages.
    (folder / "requirements.lock").write_text((folder / "requirements.lock").read_text() + "\n")
    again = make(folder, "setup")
    assert again.returncode == 0, again.stderr
    assert "up to date" in again.stderr
    assert imports(folder, "std_msgs.msg")


def test_a_second_run_does_nothing(small: Path) -> None:
    def written() -> dict[Path, int]:
        files = (path for path in (small / ".venv").rglob("*") if "__pycache__" not in path.parts)
        return {path: path.lstat().st_mtime_ns for path in files}

    before = written()
    done = make(small, "setup")
    assert (done.returncode, done.stderr) == (0, "")
    assert written() == before


def test_nbgrader_finds_the_courses_configuration_from_every_folder(small: Path) -> None:
    link = small / ".venv" / "etc" / "jupyter" / "nbgrader_config.py"
    assert link.resolve() == small / "nbgrader_config.py"
    link.unlink()  # as in an environment that was made before there was one
    assert make(small, "setup").returncode == 0
    assert link.resolve() == small / "nbgrader_config.py"


def test_a_changed_lock_brings_the_environment_up_to_date(small: Path) -> None:
    write_lock(small, "requirements.lock", "uv", "annotated-doc")
    assert not imports(small, "annotated_doc")
    done = make(small, "setup")
    assert "up to date with requirements.lock" in done.stderr
    assert imports(small, "annotated_doc")
    assert make(small, "setup").stderr == ""


def test_one_environment_serves_students_and_tests(small: Path) -> None:
    assert "requirements-dev.lock" in make(small, "setup-dev").stderr
    assert imports(small, "annotated_types")
    assert make(small, "setup").stderr == ""
    assert make(small, "setup-dev").stderr == ""


def test_an_interrupted_environment_is_made_anew(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    with socket.create_server(("127.0.0.1", 0)) as mute:  # a package index that never answers, so set-up does not end
        index = f"http://127.0.0.1:{mute.getsockname()[1]}/simple"
        environ = ENVIRON | {"PIP_CONFIG_FILE": "/dev/null", "PIP_FIND_LINKS": "", "PIP_INDEX_URL": index}
        process = subprocess.Popen(
            [MAKE, "-C", folder, "setup"], env=environ, stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        deadline = time.monotonic() + 600
        while not (folder / ".venv" / "pyvenv.cfg").exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        assert "The next run starts over" in process.communicate(timeout=600)[1]
    assert process.returncode != 0
    (folder / ".venv" / "left-over").touch()

    done = make(folder, "setup")
    assert "Creating .venv again" in done.stderr
    assert done.returncode == 0, done.stderr
    assert not (folder / ".venv" / "left-over").exists()
    assert make(folder, "setup").stderr == ""

    # A moved checkout is no longer finished: the scripts inside name the old place.
    moved = folder.rename(tmp_path / "elsewhere")
    asked = "from autograder.setup.environment import read_marker; print(read_marker())"
    found = subprocess.run([BASE_PYTHON, "-c", asked], cwd=moved, capture_output=True, text=True)
    assert found.stdout == "{}\n", found.stderr


def test_an_unpinned_package_is_refused_and_the_environment_made_anew_but_not_on_itself(small: Path) -> None:
    for lock in ("requirements.lock", "requirements-dev.lock"):
        write_lock(small, lock, "uv", "defusedxml")
        head, package = (small / lock).read_text().split("defusedxml", 1)
        (small / lock).write_text(head + "defusedxml" + re.sub(r"sha256:\w{8}", "sha256:00000000", package))
    done = make(small, "setup")
    assert done.returncode == 2
    assert "hash" in done.stderr.lower()
    assert not imports(small, "defusedxml")
    assert not (small / ".venv" / MARKER.name).exists()

    for lock in ("requirements.lock", "requirements-dev.lock"):
        write_lock(small, lock, "uv")
    path = f"{small / '.venv' / 'bin'}:{ENVIRON['PATH']}"  # as in a shell in which it is active
    done = make(small, "setup", path=path, VIRTUAL_ENV=str(small / ".venv"))
    assert done.returncode == 0, done.stderr
    assert "Creating .venv again" in done.stderr
    assert f": {small}" not in done.stderr
    assert make(small, "setup", path=path).stderr == ""


def test_an_old_python_is_passed_over_for_a_newer_one_beside_it(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    stand_in(tmp_path / "bin", version=(3, 9, 2))
    stand_in(tmp_path / "bin", "python3.12", version=(3, 12, 1))
    done = make(folder, "setup", path=f"{tmp_path / 'bin'}")
    assert done.returncode == 0, done.stderr
    assert "Python 3.12.1" in done.stderr


def test_an_old_python_alone_is_named(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    old = stand_in(tmp_path / "bin", version=(3, 9, 2))
    script(tmp_path / "bin" / "python3.13", "#!/bin/sh\nexit 1\n")
    done = make(folder, "setup", path=str(tmp_path / "bin"))
    assert done.returncode == 2
    assert f"{old} is Python 3.9.2" in done.stderr
    assert "python3.13 does not run" in done.stderr
    assert "needs Python 3.11 to 3.14" in done.stderr
    assert "PYTHON=" in done.stderr
    assert not (folder / ".venv").exists()


def test_no_python_at_all(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    (tmp_path / "bin").mkdir()
    done = make(folder, "setup", path=str(tmp_path / "bin"))
    assert done.returncode == 2
    assert "No Python was found" in done.stderr
    assert "apt-get install" in done.stderr


def test_an_old_python_can_read_what_sets_the_kit_up() -> None:
    kit = ROOT / "autograder"
    above = [kit / name for name in ("__init__.py", "core/__init__.py", "core/version.py")]
    for path in (*above, *kit.glob("setup/*.py")):
        ast.parse(path.read_text(encoding="utf-8"), str(path), feature_version=(3, 6))
        assert "from __future__ import annotations" not in path.read_text(encoding="utf-8"), path  # of Python 3.7


def test_a_named_python_that_is_not_there(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    done = make(folder, "setup", "PYTHON=/nowhere/python3")
    assert done.returncode == 2
    assert "/nowhere/python3 does not exist" in done.stderr


def test_without_ensurepip_the_pip_of_the_python_below_helps(tmp_path: Path) -> None:
    if subprocess.run([BASE_PYTHON, "-m", "pip", "--version"], capture_output=True).returncode:
        pytest.skip("the Python below has no pip")
    folder = check_out(tmp_path / "course")
    stand_in(tmp_path / "bin", ensurepip=False)
    done = make(folder, "setup", path=str(tmp_path / "bin"))
    assert done.returncode == 0, done.stderr
    assert not imports(folder, "pip")


def test_without_ensurepip_and_pip_the_package_to_install_is_named(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    stand_in(tmp_path / "bin", ensurepip=False, pip=False)
    done = make(folder, "setup", path=str(tmp_path / "bin"))
    assert done.returncode == 2
    assert "apt-get install python3-venv" in done.stderr


def test_without_network_it_says_so(tmp_path: Path) -> None:
    folder = check_out(tmp_path / "course")
    done = make(folder, "setup", PIP_CONFIG_FILE=os.devnull, PIP_INDEX_URL=UNREACHABLE, PIP_FIND_LINKS="")
    assert done.returncode == 2
    assert "index does not answer" in done.stderr
    assert "Connect to the network" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (folder / ".venv" / MARKER.name).exists()


def test_pip_helps_where_uv_does_not_manage(small: Path) -> None:
    for lock in ("requirements.lock", "requirements-dev.lock"):
        write_lock(small, lock, "uv", "mdurl")
    assert not imports(small, "mdurl")
    done = make(small, "setup", UV_DEFAULT_INDEX=UNREACHABLE, UV_NO_CACHE="1", UV_HTTP_RETRIES="0")
    assert "uv failed" in done.stderr
    assert done.returncode == 0, done.stderr
    assert imports(small, "mdurl")


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("PYTHONPATH", "/opt/ros/humble/lib/python3.10/site-packages"),
        ("AMENT_PREFIX_PATH", "/home/me/ws/install:/opt/ros/kilted"),
        ("ROS_DISTRO", "rolling"),
    ],
)
def test_a_foreign_ros_is_refused(small: Path, variable: str, value: str) -> None:
    done = make(small, "setup", **{variable: value})
    assert done.returncode == 2
    assert "Another ROS distribution" in done.stderr
    assert f"-u {variable}" in done.stderr


def test_a_sourced_jazzy_is_welcome() -> None:
    assert not refusals.foreign_ros({"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/opt/ros/jazzy", "PYTHONPATH": "/x"})


def test_other_machines_are_told_what_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    refusals.refuse_other_machines()
    monkeypatch.setattr(refusals.platform, "machine", lambda: "aarch64")
    with pytest.raises(refusals.SetUpError, match="Linux on x86_64"):
        refusals.refuse_other_machines()
    monkeypatch.undo()
    monkeypatch.setattr(refusals.platform, "libc_ver", lambda: ("glibc", "2.17"))
    with pytest.raises(refusals.SetUpError, match=r"glibc 2\.17"):
        refusals.refuse_other_machines()


def test_help_lists_every_target() -> None:
    listed = make(ROOT, "--no-print-directory", "help").stdout
    for target in re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE):
        assert re.search(rf"^  {target} ", listed, re.MULTILINE), target


@pytest.fixture
def ordinary_folder() -> Iterator[Path]:
    """A folder of another user's, below folders that everybody may enter."""
    folder = Path(tempfile.mkdtemp(prefix="ordinary user "))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else; the others are ordinary already")
def test_an_ordinary_user_can_do_it(ordinary_folder: Path) -> None:
    folder = check_out(ordinary_folder / "course")
    for path in (ordinary_folder, *ordinary_folder.rglob("*")):
        os.chown(path, ORDINARY_USER, ORDINARY_USER, follow_symlinks=False)
    done = subprocess.run(
        [MAKE, "-C", folder, "setup"],
        env=ENVIRON | {"HOME": str(ordinary_folder), "PATH": SYSTEM_PATH},
        user=ORDINARY_USER,
        group=ORDINARY_USER,
        extra_groups=[],
        cwd="/",
        capture_output=True,
        text=True,
        check=False,
    )
    if "needs Python" in done.stderr:
        pytest.skip("every Python here that would do is root's own")
    assert done.returncode == 0, done.stderr
    assert (folder / ".venv" / MARKER.name).stat().st_uid == ORDINARY_USER


def test_a_checkout_of_somebody_elses_is_explained(ordinary_folder: Path) -> None:
    folder = check_out(ordinary_folder / "course")
    ordinary_folder.chmod(0o755)
    folder.chmod(0o555)
    become = {"user": ORDINARY_USER, "group": ORDINARY_USER, "extra_groups": []} if os.geteuid() == 0 else {}
    try:
        done = subprocess.run(
            [MAKE, "-C", folder, "setup"],
            env=ENVIRON | {"HOME": str(ordinary_folder), "PATH": SYSTEM_PATH if become else ENVIRON["PATH"]},
            cwd="/", capture_output=True, text=True, check=False, **become,
        )  # type: ignore[call-overload]  # fmt: skip
    finally:
        folder.chmod(0o755)
    if "needs Python" in done.stderr:
        pytest.skip("every Python here that would do is root's own")
    assert done.returncode == 2
    assert f"may not write to {folder}" in done.stderr
    assert "chown" in done.stderr and "python3-venv" not in done.stderr


def test_a_full_disk_is_explained(tmp_path: Path) -> None:
    # A disk of one megabyte, in a mount tree of its own.
    unshare = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", "--mount"]
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "none", str(tmp_path)]
    if subprocess.run([*unshare, *mount], capture_output=True, check=False).returncode:
        pytest.skip("this machine lets nobody mount a small disk")
    steps = '"$@" && cp -r "$COPY/." "$DISK" && exec make -C "$DISK" setup'
    copy = tmp_path.with_name(f"{tmp_path.name} copy")
    only_python = shutil.ignore_patterns("__pycache__")
    for folder in ("setup", "core"):
        shutil.copytree(ROOT / "autograder" / folder, copy / "autograder" / folder, ignore=only_python)
    for name in ("Makefile", "autograder/__init__.py"):
        shutil.copy(ROOT / name, copy / name)
    for lock in ("requirements.lock", "requirements-dev.lock"):
        write_lock(copy, lock, "uv")
    done = subprocess.run(
        [*unshare, "sh", "-c", steps, "sh", *mount],
        env=ENVIRON | {"COPY": str(copy), "DISK": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "no space left" in done.stderr and "Free 1.5 GB" in done.stderr
    assert "python3-venv" not in done.stderr


def handed_out(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lay out a student's kit with one lab, and let set-up take it for the one that it belongs to."""
    (root / "kit" / "labs" / "toy").mkdir(parents=True)
    (root / "kit" / "labs" / "toy" / "toy.ipynb").write_text("as handed out")
    for module in ("labs", "bootstrap"):
        monkeypatch.setattr(f"autograder.setup.{module}.ROOT", root)


def test_a_lab_that_another_first_start_puts_there_meanwhile_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    handed_out(tmp_path, monkeypatch)
    copy = shutil.copytree

    def slower(source: str, target: str) -> None:
        copy(source, target)
        copy(source, tmp_path / "labs" / "toy")
        (tmp_path / "labs" / "toy" / "toy.ipynb").write_text("begun")

    monkeypatch.setattr("autograder.setup.labs.shutil.copytree", slower)
    put_labs()
    assert (tmp_path / "labs" / "toy" / "toy.ipynb").read_text() == "begun"
    assert [path.name for path in (tmp_path / "labs").iterdir()] == ["toy"]


def test_labs_that_cannot_be_put_there_are_not_said_to_be_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    handed_out(tmp_path, monkeypatch)
    (tmp_path / "labs").touch()
    monkeypatch.setattr("autograder.setup.bootstrap.WHEEL", "kit/some.whl")
    monkeypatch.setattr("autograder.setup.bootstrap.make_ready", lambda *_: None)
    monkeypatch.setattr("sys.argv", ["setup"])
    assert bootstrap.main() == 2
    assert f".venv is ready, but the labs could not be put into {tmp_path / 'labs'}" in capsys.readouterr().err
