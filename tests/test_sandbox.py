"""The sandbox: what it does for an honest program, and that it holds against others, as root and as anyone else."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from autograder.errors import KitError
from autograder.results import Isolation
from autograder.sandbox import bubblewrap, isolation
from autograder.sandbox.environment import python_environment
from autograder.sandbox.isolation import Preflight, choose, preflight
from autograder.sandbox.nodes import Limits, NodeSandbox
from autograder.sandbox.outer import run_in_sandbox
from autograder.sandbox.processes import descendants

ATTACKS = {path.stem: path.read_text() for path in (Path(__file__).parent / "attacks").glob("*.py")}
ROOT = Path(__file__).parent.parent
ORDINARY_USER = 12345

RUN_STDIN = ("timeit", "-n1", "-r1", "exec(__import__('sys').stdin.read(), {})")
"""A module that everyone has, and that runs what it reads."""

needs_full = pytest.mark.skipif(not preflight().full, reason=f"no full isolation here: {preflight().why_not_full}")

# Runs inside the grading sandbox: every attack in turn, against one node sandbox.
DRIVER = """
import json, os, sys, time
from pathlib import Path
from autograder.results import Isolation
from autograder.sandbox.nodes import NodeSandbox, Limits
from autograder.sandbox.processes import descendants
Path("/tmp/secret_checks.py").write_text("secret = 42")
os.environ["SECRET"] = "secret"
folder = Path("/tmp/programs"); folder.mkdir()
report = {}
attacks = ATTACKS
for name, source in attacks.items():
    (folder / (name + ".py")).write_text(source)
with NodeSandbox(folder, Isolation.FULL) as sandbox:
    for name in attacks:
        group = sandbox.group()
        began = time.monotonic()
        program = group.start(name, env={"ROS_DOMAIN_ID": "7", "HOST_PORT": "HOSTPORT"})
        if name in ("ignores_term", "stops_launcher"):
            while not program.output() and program.running():
                time.sleep(0.01)
            program.stop(0.3)
        else:
            program.wait(20)
        at_end = time.monotonic() - began
        group.end()
        left = [pid for pid in descendants(os.getpid())]
        group = sandbox.group()
        after = group.start("honest")
        after.wait(20)
        report[name] = {
            "status": program.exit_status(), "stopped_by": program.stopped_by(), "output": program.output()[-4000:],
            "seconds": round(at_end, 2), "left": len(left), "after": after.output(), "events": len(program.events()),
        }
        group.end()
print("REPORT" + json.dumps(report), flush=True)
"""


def in_sandbox(source: str, time_limit: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run Python source in the grading sandbox, through a module that everyone has."""
    run = run_in_sandbox([*RUN_STDIN], source.encode(), Isolation.FULL, time_limit)
    return subprocess.CompletedProcess([], run.status, run.stdout.decode(), run.stderr)


def driver(host_port: int) -> str:
    return DRIVER.replace("ATTACKS", repr(ATTACKS), 1).replace("HOSTPORT", str(host_port))


def as_ordinary_user(source: str) -> str:
    """Run Python source outside any sandbox, as a user that owns nothing; return what it prints."""
    if os.getuid() != 0:
        command = [sys.executable, "-c", source]
        return subprocess.run(command, capture_output=True, text=True, timeout=150, cwd=ROOT, check=False).stdout
    environment = {**python_environment(), "PYTHONPATH": str(ROOT), "HOME": "/tmp"}
    become = (
        f"import os,sys;os.setgroups([]);os.setresgid({ORDINARY_USER},{ORDINARY_USER},{ORDINARY_USER});"
        f"os.setresuid({ORDINARY_USER},{ORDINARY_USER},{ORDINARY_USER});"
        f"os.execve(sys.executable,[sys.executable,'-c',sys.stdin.read()],{environment!r})"
    )
    # A world-writable /tmp of its own, since this user may write nowhere else.
    options = bubblewrap.level_zero_options()
    place = options.index("--tmpfs")
    options[place:place] = ["--perms", "1777"]
    process = bubblewrap.start_bwrap(
        options, [sys.executable, "-c", become],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    out, error = process.communicate(source.encode(), timeout=150)
    return out.decode() + error.decode()


@pytest.fixture(scope="module", params=["own user", "ordinary user"])
def report(request: pytest.FixtureRequest) -> dict[str, dict[str, Any]]:
    """What each attack came to: as whoever runs the tests (root, often), and as an ordinary user."""
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    import socket

    with socket.create_server(("127.0.0.1", 0)) as listener:
        source = driver(listener.getsockname()[1])
        if request.param == "own user":
            said = in_sandbox(source)
            text, trouble = said.stdout, said.stderr
        else:
            text, trouble = (
                as_ordinary_user(
                    "from autograder.results import Isolation\n"
                    "from autograder.sandbox.outer import run_in_sandbox\n"
                    f"run = run_in_sandbox({[*RUN_STDIN]!r}, {source.encode()!r}, Isolation.FULL, 120.0)\n"
                    "print(run.stdout.decode(), run.stderr)\n"
                ),
                "",
            )
    lines = [line for line in text.splitlines() if line.startswith("REPORT")]
    assert lines, text + trouble
    found: dict[str, dict[str, Any]] = json.loads(lines[0].removeprefix("REPORT"))
    return found


@needs_full
def test_every_attack_leaves_a_sandbox_that_works_and_no_process(report: dict[str, dict[str, Any]]) -> None:
    assert report.keys() == ATTACKS.keys()
    for name, entry in report.items():
        assert entry["after"] == "fine\n", (name, entry)
        assert entry["left"] <= 3, (name, entry)  # bwrap, its first process, the launcher


@needs_full
@pytest.mark.parametrize(
    ("name", "limit"),
    [("thread_bomb", "process limit"), ("memory_bomb", "memory limit"), ("endless_output", "output limit")],
)
def test_limits_end_a_program_and_say_so(report: dict[str, dict[str, Any]], name: str, limit: str) -> None:
    assert report[name]["stopped_by"] == limit, report[name]
    assert report[name]["seconds"] < 15


@needs_full
def test_a_program_cannot_start_processes(report: dict[str, dict[str, Any]]) -> None:
    assert report["fork_bomb"]["output"] == "processes 0\n", report["fork_bomb"]


@needs_full
def test_a_program_that_ignores_sigterm_is_killed(report: dict[str, dict[str, Any]]) -> None:
    assert report["ignores_term"]["status"] == -signal.SIGKILL


@needs_full
def test_nothing_outside_can_be_seen_reached_or_written(report: dict[str, dict[str, Any]]) -> None:
    assert "FOUND" not in report["looks_around"]["output"]
    assert "environment []" in report["looks_around"]["output"]
    assert "REACHED" not in report["network"]["output"]
    assert "OPENED" not in report["network"]["output"]
    assert "interfaces ['lo']" in report["network"]["output"]
    written = dict(line.split() for line in report["disk_fill"]["output"].splitlines())
    limit = Limits().disk
    assert int(written.pop("/tmp")) <= limit
    assert int(written.pop("/dev/shm")) <= limit
    assert set(written.values()) == {"0"}, written


@needs_full
def test_system_calls_that_pass_the_limits_are_refused(report: dict[str, dict[str, Any]]) -> None:
    said = report["system_calls"]["output"]
    assert "ALLOWED" not in said
    assert "CapEff:\\t0000000000000000" in said and "Seccomp:\\t2" in said
    shared = report["memory_shared"]["output"]
    assert "got" not in shared
    assert int(shared.split("shm ")[1]) <= Limits().disk


@needs_full
def test_nonsense_on_the_probe_channel_is_harmless_and_bounded(report: dict[str, dict[str, Any]]) -> None:
    assert report["events_flood"]["status"] == 0
    assert report["events_flood"]["events"] <= Limits().events


@pytest.mark.parametrize(("kind", "processes"), [(Isolation.FULL, 8), (Isolation.REDUCED, 4), (Isolation.NONE, 4)])
def test_when_the_parent_is_killed_nothing_remains(kind: Isolation, processes: int) -> None:
    if (
        kind is not Isolation.NONE
        and not {Isolation.FULL: preflight().full, Isolation.REDUCED: preflight().reduced}[kind]
    ):
        pytest.skip(f"no {kind.value} isolation here")
    inner = (
        "from pathlib import Path\nfrom autograder.results import Isolation\n"
        "from autograder.sandbox.nodes import NodeSandbox\n"
        "import tempfile; p = Path(tempfile.mkdtemp()); (p / 'sleeper.py').write_text('import time; time.sleep(600)')\n"
        f"s = NodeSandbox(p, Isolation.{kind.name}); g = s.group(); g.start('sleeper'); g.start('sleeper').wait(600)\n"
    )
    outer = (
        "from autograder.results import Isolation\nfrom autograder.sandbox.outer import run_in_sandbox\n"
        f"run_in_sandbox({[*RUN_STDIN]!r}, {inner.encode()!r}, Isolation.{kind.name}, 600.0)\n"
    )
    mounts = Path("/proc/self/mounts").read_text()
    parent = subprocess.Popen([sys.executable, "-c", outer], cwd=ROOT)
    try:
        # python, bwrap (outer, its first process), worker, bwrap (inner, first), launcher, two programs
        family = _wait_for(lambda: found if len(found := descendants(parent.pid)) >= processes else None, 20)
    finally:
        parent.kill()
        parent.wait()
    _wait_for(lambda: not [pid for pid in family if Path(f"/proc/{pid}").exists()], 5)
    assert Path("/proc/self/mounts").read_text() == mounts


@needs_full
def test_a_run_that_takes_too_long_is_ended_as_a_whole() -> None:
    began = time.monotonic()
    run = run_in_sandbox(["timeit", "-n1", "-r1", "import time; time.sleep(60)"], b"", Isolation.FULL, time_limit=1.0)
    assert run.timed_out
    assert time.monotonic() - began < 5


@needs_full
def test_the_grading_sandbox_sees_the_kit_and_nothing_else_of_the_course() -> None:
    run = in_sandbox(
        f"import os\nprint(sorted(os.listdir({str(ROOT)!r})), os.listdir('/tmp'), sorted(os.environ), os.getuid())\n"
    )
    seen = run.stdout.splitlines()[0]
    assert "autograder" in seen and "solutions" not in seen and "tests" not in seen
    # /tmp is the sandbox's own; where the checkout itself lies below it, the way there is all that it holds.
    way = [ROOT.parts[2]] if ROOT.is_relative_to("/tmp") else []
    assert str(way) in seen
    assert "SHELL" not in seen


@needs_full
def test_links_to_the_interpreter_open_no_home(tmp_path: Path) -> None:
    """As version managers lay Python out: the environment's `python` is a link to a link in a home, and so on."""
    home = tmp_path / "home"
    secrets = [home, home / "bin", home / ".local", home / ".local" / "share", home / "course" / "solutions"]
    for folder in [*secrets, home / ".local" / "bin"]:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "canary.txt").write_text("hidden tests")
    real = Path(sys.executable).resolve()
    (home / ".local" / "bin" / "python3.x").symlink_to(real)
    (home / "tools").symlink_to(".local")
    (home / "bin" / "python3").symlink_to("../tools/bin/python3.x")
    programs = tmp_path / "programs"
    programs.mkdir()
    environment = home / "course" / ".venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    (environment / "bin" / "python").unlink()
    (environment / "bin" / "python").symlink_to(home / "bin" / "python3")
    look = (
        "import os, sys\n"
        "seen = [os.path.join(f, n) for f, _, names in os.walk('/') if not f.startswith('/proc') for n in names]\n"
        "print('PYTHON', sys.executable, os.path.realpath(sys.executable))\n"
        "print('CANARIES', [name for name in seen if name.endswith('canary.txt')])\n"
    )
    show = (
        "import subprocess, sys\nfrom pathlib import Path\nfrom autograder.sandbox import bubblewrap\n"
        "from autograder.sandbox.limits import Limits\n"
        f"options = bubblewrap.inner_options(Path({str(programs)!r}), Limits(), {{}})\n"
        f"line = [sys.executable, '-I', '-S', '-c', {look!r}]\n"
        "print(bubblewrap.start_bwrap(options, line, stdout=1, stderr=1).wait())\n"
    )
    packages = os.pathsep.join([str(ROOT), *(path for path in sys.path if path.endswith("site-packages"))])
    done = subprocess.run(
        [environment / "bin" / "python", "-c", show], env={"PYTHONPATH": packages}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.stdout.splitlines() == [f"PYTHON {environment}/bin/python {real}", "CANARIES []", "0"], done


@pytest.fixture(params=[Isolation.NONE, Isolation.REDUCED])
def local(request: pytest.FixtureRequest, tmp_path: Path) -> NodeSandbox:
    """A node sandbox as in a student's kernel, and the reduced one."""
    if request.param is Isolation.REDUCED and not preflight().reduced:
        pytest.skip("no Landlock here")
    for name, source in ATTACKS.items():
        (tmp_path / f"{name}.py").write_text(source)
    sandbox = NodeSandbox(tmp_path, request.param)
    request.addfinalizer(sandbox.close)
    return sandbox


def test_a_program_runs_as_python_runs_a_file(local: NodeSandbox) -> None:
    (local.folder / "friend.py").write_text("WORD = 'imported'\n")
    (local.folder / "shown.py").write_text(
        "import os, sys, friend\n"
        "print(__name__, sys.argv[1:], friend.WORD, os.environ['ROS_DOMAIN_ID'], len(os.sched_getaffinity(0)))\n"
        "import __main__; print(__main__.__file__ == sys.argv[0], os.listdir('.') != [])\n"
        "def fail():\n    raise ValueError('no')\n"
        "fail()\n"
    )
    program = local.group().start("shown", ["--ros-args", "-r", "a:=b"], {"ROS_DOMAIN_ID": "9"}, cores=2)
    assert program.wait(10)
    assert program.exit_status() == 1
    said = program.output()
    assert "__main__ ['--ros-args', '-r', 'a:=b'] imported 9 2" in said
    assert "True True" in said
    assert "launcher.py" not in said
    assert said.rstrip().endswith("ValueError: no")


@pytest.mark.parametrize(
    ("source", "status", "said"),
    [
        ("import sys; sys.exit(3)", 3, ""),
        ("import sys; sys.exit('gone')", 1, "gone\n"),
        ("if x\n", 1, "SyntaxError: expected ':'"),
        ("import os; os.abort()", -signal.SIGABRT, ""),
        ("import atexit; atexit.register(print, 'bye')", 0, "bye\n"),
        ("import threading; threading.Timer(0.2, print, ['late']).start()", 0, "late\n"),
    ],
)
def test_a_program_ends_as_python_does(tmp_path: Path, source: str, status: int, said: str) -> None:
    (tmp_path / "it.py").write_text(source)
    with NodeSandbox(tmp_path, Isolation.NONE) as sandbox:
        program = sandbox.group().start("it")
        assert program.wait(10)
        assert program.exit_status() == status
        assert said in program.output()
        assert "launcher.py" not in program.output()


def test_a_program_starts_no_process_in_a_notebook_either(local: NodeSandbox) -> None:
    program = local.group().start("fork_bomb")
    assert program.wait(20)
    assert program.output() == "processes 0\n"


def test_stacks_name_the_waiting_line(local: NodeSandbox) -> None:
    (local.folder / "stuck.py").write_text("import threading\nprint('here')\nthreading.Event().wait()\n")
    program = local.group().start("stuck")
    _wait_for(program.output, 10)
    assert 'stuck.py", line 3' in program.stacks()
    assert program.running()


def test_output_keeps_its_beginning_and_its_end(tmp_path: Path) -> None:
    (tmp_path / "talks.py").write_text("print('first'); print('x' * 100000); print('last')")
    with NodeSandbox(tmp_path, Isolation.NONE, limits=Limits(output_kept=2000)) as sandbox:
        program = sandbox.group().start("talks")
        assert program.wait(10)
        assert program.truncated()
        assert program.output().startswith("first") and program.output().endswith("last\n")
        assert len(program.output()) < 2100


def test_a_program_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    (tmp_path / "sleeps.py").write_text("import time; time.sleep(60)")
    with NodeSandbox(tmp_path, Isolation.NONE, limits=Limits(wall_seconds=0.5)) as sandbox:
        program = sandbox.group().start("sleeps")
        assert program.wait(10)
        assert program.stopped_by() == "time limit"


def test_reduced_isolation_hides_files_and_processes(tmp_path: Path) -> None:
    if not preflight().reduced:
        pytest.skip("no Landlock here")
    hidden = tmp_path / "secret.txt"
    hidden.write_text("secret")
    folder = tmp_path / "programs"
    folder.mkdir()
    (folder / "peeks.py").write_text(
        "import os, signal\n"
        f"for act in (lambda: open({str(hidden)!r}), lambda: open('new.txt', 'w'), lambda: os.listdir({str(ROOT)!r}),\n"
        f"            lambda: open('/proc/{os.getpid()}/environ'), lambda: os.kill({os.getpid()}, 0),\n"
        f"            lambda: open({str(__file__)!r})):\n"
        "    try:\n        act(); print('ALLOWED')\n    except PermissionError:\n        print('refused')\n"
    )
    with NodeSandbox(folder, Isolation.REDUCED) as sandbox:
        program = sandbox.group().start("peeks")
        assert program.wait(10)
        assert program.output() == "refused\n" * 6


def test_isolation_fails_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolation, "preflight", lambda: Preflight(False, True, "no namespaces", "Allow them."))
    with pytest.raises(KitError, match="--isolation reduced"):
        choose(Isolation.FULL)
    monkeypatch.setattr(isolation, "preflight", lambda: Preflight(False, False, "no namespaces", "Allow them."))
    with pytest.raises(KitError, match="--isolation none"):
        choose(Isolation.FULL)
    with pytest.raises(KitError):
        choose(Isolation.REDUCED)
    assert choose(Isolation.NONE) is Isolation.NONE


def test_a_sandbox_can_be_used_from_threads_that_end(tmp_path: Path) -> None:
    (tmp_path / "honest.py").write_text(ATTACKS["honest"])
    made: list[NodeSandbox] = []
    thread = threading.Thread(target=lambda: made.append(NodeSandbox(tmp_path, Isolation.NONE)))
    thread.start()
    thread.join()
    with made[0] as sandbox:
        program = sandbox.group().start("honest")
        assert program.wait(10)
        assert program.output() == "fine\n"


def test_closing_leaves_nothing_on_the_disk(tmp_path: Path) -> None:
    (tmp_path / "honest.py").write_text(ATTACKS["honest"])
    sandbox = NodeSandbox(tmp_path, Isolation.NONE)
    sandbox.group().start("honest").wait(10)
    assert sandbox._scratch is not None
    scratch = sandbox._scratch.folder
    sandbox.close()
    sandbox.close()
    assert not scratch.exists()


def _wait_for(look: Any, seconds: float) -> Any:
    """Return what `look` returns as soon as it is true."""
    deadline = time.monotonic() + seconds
    while not (found := look()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)
    return found
