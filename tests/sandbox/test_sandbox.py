"""The sandbox: what it does for an honest program, and that it holds against others, as root and as anyone else."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from boxes import ATTACKS, RUN_STDIN, in_sandbox
from places import ROOT

from autograder.core.errors import KitError
from autograder.core.processes import descendants
from autograder.core.results import Isolation
from autograder.sandbox import isolation, loop, running_programs
from autograder.sandbox.grading_sandbox import run_in_sandbox
from autograder.sandbox.isolation import Preflight, choose, preflight
from autograder.sandbox.limits import Limits
from autograder.sandbox.node_sandbox import NodeSandbox
from autograder.sandbox.running_programs import RunningPrograms

HONEST = "print('fine')\n"

needs_full = pytest.mark.skipif(not preflight().full, reason=f"no full isolation here: {preflight().why_not_full}")


@pytest.mark.parametrize(("kind", "processes"), [(Isolation.FULL, 8), (Isolation.REDUCED, 4), (Isolation.NONE, 4)])
def test_when_the_parent_is_killed_nothing_remains(kind: Isolation, processes: int) -> None:
    if (
        kind is not Isolation.NONE
        and not {Isolation.FULL: preflight().full, Isolation.REDUCED: preflight().reduced}[kind]
    ):
        pytest.skip(f"no {kind.value} isolation here")
    inner = (
        "from pathlib import Path\nfrom autograder.core.results import Isolation\n"
        "from autograder.sandbox.node_sandbox import NodeSandbox\n"
        "import tempfile; p = Path(tempfile.mkdtemp()); (p / 'sleeper.py').write_text('import time; time.sleep(600)')\n"
        f"s = NodeSandbox(p, Isolation.{kind.name}); g = s.group(); g.start('sleeper'); g.start('sleeper').wait(600)\n"
    )
    outer = (
        "from autograder.core.results import Isolation\nfrom autograder.sandbox.grading_sandbox import run_in_sandbox\n"
        f"run_in_sandbox({[*RUN_STDIN]!r}, {inner.encode()!r}, Isolation.{kind.name}, 600.0)\n"
    )
    mounts = Path("/proc/self/mounts").read_text()
    parent = subprocess.Popen([sys.executable, "-c", outer], cwd=ROOT)
    try:
        # python, bwrap (outer, its first process), worker, bwrap, launcher, the launch's first process, two programs
        family = _wait_for(lambda: found if len(found := descendants(parent.pid)) >= processes else None, 120)
    finally:
        parent.kill()
        parent.wait()
    _wait_for(lambda: not [pid for pid in family if Path(f"/proc/{pid}").exists()], 120)
    assert Path("/proc/self/mounts").read_text() == mounts


@needs_full
def test_a_run_that_takes_too_long_is_ended_as_a_whole() -> None:
    deadline = time.monotonic() + 300
    run = run_in_sandbox(["timeit", "-n1", "-r1", "import time; time.sleep(600)"], b"", Isolation.FULL, time_limit=1.0)
    assert run.timed_out
    assert time.monotonic() < deadline


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
        "import subprocess, sys\nfrom pathlib import Path\nfrom autograder.sandbox.walls import bubblewrap\n"
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


@needs_full
def test_what_the_launcher_loads_is_never_a_students_file() -> None:
    # Loaded there, it would run with what the launcher keeps for making namespaces.
    run = in_sandbox(
        "import tempfile\nfrom pathlib import Path\nfrom autograder.core.results import Isolation\n"
        "from autograder.sandbox.node_sandbox import NodeSandbox\n"
        "folder = Path(tempfile.mkdtemp()); (folder / 'honest.py').write_text('print(\"fine\")')\n"
        "(folder / 'numpy.py').write_text('import os; os._exit(3)')\n"
        "with NodeSandbox(folder, Isolation.FULL) as sandbox, sandbox.group() as group:\n"
        "    program = group.start('honest'); program.wait(120); print(program.output())\n"
    )
    assert "fine" in run.stdout, run.stdout + run.stderr


@pytest.fixture(params=[Isolation.NONE, Isolation.REDUCED])
def local(request: pytest.FixtureRequest, tmp_path: Path) -> NodeSandbox:
    """A node sandbox as in a student's kernel, and the reduced one."""
    if request.param is Isolation.REDUCED and not preflight().reduced:
        pytest.skip("no Landlock here")
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
    assert program.wait(120)
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
        assert program.wait(120)
        assert program.exit_status() == status
        assert said in program.output()
        assert "launcher.py" not in program.output()


def test_a_program_starts_no_process_in_a_notebook_either(local: NodeSandbox) -> None:
    for name in ("fork_bomb", "_tries", "daemon"):
        (local.folder / f"{name}.py").write_text(ATTACKS[name])
    for name in ("fork_bomb", "daemon"):
        program = local.group().start(name)
        assert program.wait(120)
        assert "ESCAPED" not in program.output()


def test_stacks_name_the_waiting_line(local: NodeSandbox) -> None:
    (local.folder / "stuck.py").write_text("import threading\nprint('here')\nthreading.Event().wait()\n")
    program = local.group().start("stuck")
    _wait_for(program.output, 120)
    assert _wait_for(lambda: 'stuck.py", line 3' in program.stacks(), 120)  # it has printed, and goes on to wait
    assert program.running()


def test_looking_at_a_program_never_ends_it(local: NodeSandbox) -> None:
    """Its threads return from deep calls, and end, at any moment of a look."""
    (local.folder / "restless.py").write_text(
        "import threading\n"
        "def deep(n):\n    return n and deep(n - 1)\n"
        "def work():\n"
        "    while True:\n"
        "        deep(150)\n"
        "        short = threading.Thread(target=deep, args=(200,))\n"
        "        short.start()\n"
        "        short.join()\n"
        "for _ in range(4):\n    threading.Thread(target=work).start()\n"
        "print('here')\n"
    )
    program = local.group().start("restless")
    _wait_for(program.output, 120)
    looks = [program.stacks(120) for _ in range(80)]
    assert program.running()
    assert all('restless.py", line' in look for look in looks)


def test_output_keeps_its_beginning_and_its_end(tmp_path: Path) -> None:
    (tmp_path / "talks.py").write_text("print('first'); print('x' * 100000); print('last')")
    with NodeSandbox(tmp_path, Isolation.NONE, limits=Limits(output_kept=2000)) as sandbox:
        program = sandbox.group().start("talks")
        assert program.wait(120)
        assert program.truncated()
        assert program.output().startswith("first") and program.output().endswith("last\n")
        assert len(program.output()) < 2100


BEGINS = "import time\nwhile time.thread_time() < 4: pass\nprint('here', flush=True)\ntime.sleep(600)\n"
"""Computes for as long as a big library takes to load on a slow machine, and then rests."""
BURNS = "import threading\ndef burn():\n    while True: pass\nthreading.Thread(target=burn).start()\nburn()\n"
"""Computes without a pause, in two threads."""


@needs_full
def test_a_program_that_only_computes_goes_on_behind_all_others() -> None:
    run = in_sandbox(
        "import os, tempfile, time\nfrom pathlib import Path\nfrom autograder.core.processes import cpu_time, threads\n"
        "from autograder.core.results import Isolation\nfrom autograder.sandbox.node_sandbox import NodeSandbox\n"
        f"folder = Path(tempfile.mkdtemp()); (folder / 'burns.py').write_text({BURNS!r})\n"
        f"(folder / 'begins.py').write_text({BEGINS!r})\n"
        "(folder / 'rests.py').write_text('import time\\nwhile True: time.sleep(0.01)')\n"
        "def nice(program): return {os.getpriority(os.PRIO_PROCESS, thread) for thread in threads(program.pid)}\n"
        "with NodeSandbox(folder, Isolation.FULL) as sandbox, sandbox.group() as group:\n"
        "    rests, burns = group.start('rests'), group.start('burns')\n"
        "    begins = group.start('begins')\n"
        "    end = time.monotonic() + 500\n"
        "    while (nice(burns) != {19} or not begins.output()) and time.monotonic() < end: time.sleep(0.1)\n"
        "    print(nice(burns), nice(rests), nice(begins), burns.running(), rests.running())\n"
    )
    assert run.stdout.startswith("{19} {0} {0} True True\n"), run


def test_a_program_that_prints_without_end_waits_as_at_a_terminal(
    local: NodeSandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a busy machine a look may come late, and what could have been read meanwhile is read at once then.
    monkeypatch.setattr(running_programs, "_LONGEST", 0.5)
    source = (
        "import os, time\nprint('first', flush=True)\nbegan = time.monotonic()\n"
        "for _ in range(64): os.write(2, b'x' * 65536)\n"
        "print('waited' if time.monotonic() - began > 0.5 else 'waited for nobody', flush=True)\ntime.sleep(600)\n"
    )
    (local.folder / "floods.py").write_text(source)
    with local.group() as group:
        program = group.start("floods")
        with program._changed:
            assert program._changed.wait_for(lambda: b"waited" in program._tail[-30:] or not program.running(), 120)
        assert program.running() and program.truncated()
        assert program.output().startswith("first\n") and program.output().endswith("waited\n")


def test_a_machine_that_looks_seldom_makes_no_program_wait_that_prints_a_lot(
    local: NodeSandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks, over, watch = [], threading.Event(), RunningPrograms.watch

    def look(group: RunningPrograms) -> None:
        if not over.is_set():
            looks.append(watch(group))

    monkeypatch.setattr(RunningPrograms, "watch", look)
    monkeypatch.setattr(loop, "_LOOK_EVERY", 1.0)
    (local.folder / "prints.py").write_text(
        "import os, time\nwhile not os.path.exists('go'): time.sleep(0.01)\n"
        "for _ in range(16): os.write(1, b'x' * 65536)\nprint('done', flush=True)\ntime.sleep(600)\n"
    )
    with local.group() as group:
        program = group.start("prints")
        _wait_for(lambda: len(looks) > 3, 120)
        over.set()
        (local.folder / "go").touch()
        with program._changed:
            assert program._changed.wait_for(lambda: program._tail.endswith(b"done\n"), 60)


def test_one_launch_ends_its_own_programs_only(local: NodeSandbox) -> None:
    (local.folder / "stays.py").write_text("import time\nprint('here', flush=True)\ntime.sleep(600)\n")
    with local.group() as outer, local.group() as inner:
        kept, ended = outer.start("stays"), inner.start("stays")
        inner.end()
        assert not ended.running() and kept.running()
        assert outer.start("stays").running()
    assert not kept.running()


def test_a_launch_keeps_what_its_programs_said_before_the_end(local: NodeSandbox) -> None:
    (local.folder / "says.py").write_text("print('a word')\nraise SystemExit(3)\n")
    with local.group() as group:
        program = group.start("says")
        program.wait(120)
    assert (program.exit_status(), program.output()) == (3, "a word\n")


def test_a_sandbox_that_cannot_start_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no-python"))
    threads = threading.active_count()
    with pytest.raises(OSError, match="no-python"):
        NodeSandbox(tmp_path, Isolation.NONE)
    assert threading.active_count() == threads
    assert not list(tmp_path.iterdir())


def test_a_killed_notebook_leaves_nothing(tmp_path: Path) -> None:
    programs, scratch = tmp_path / "programs", tmp_path / "tmp"
    programs.mkdir()
    scratch.mkdir()
    (programs / "stays.py").write_text(
        "import ctypes, os, signal, time\nctypes.CDLL(None).prctl(1, 0)\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\nprint('here', flush=True)\ntime.sleep(600)\n"
    )
    source = (
        "import time\nfrom pathlib import Path\nfrom autograder.core.results import Isolation\n"
        "from autograder.sandbox.node_sandbox import NodeSandbox\n"
        f"sandbox = NodeSandbox(Path({str(programs)!r}), Isolation.NONE)\ngroup = sandbox.group()\n"
        "program = group.start('stays')\nwhile not program.output(): time.sleep(0.01)\n"
        "print('ready', flush=True)\ntime.sleep(600)\n"
    )
    environment = {**os.environ, "TMPDIR": str(scratch)}
    notebook = subprocess.Popen([sys.executable, "-c", source], cwd=ROOT, env=environment, stdout=subprocess.PIPE)
    try:
        assert notebook.stdout is not None
        assert notebook.stdout.readline() == b"ready\n"
        family = descendants(notebook.pid)
        assert len(family) >= 3 and list(scratch.iterdir())
    finally:
        notebook.kill()
        notebook.wait()
    _wait_for(lambda: not [pid for pid in family if Path(f"/proc/{pid}").exists()], 120)
    # All notebooks of a user share one folder for logs.
    assert not [path for path in scratch.rglob("*") if path.name != f"autograder-log-{os.getuid()}"]


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
        assert program.wait(120)
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
    (tmp_path / "honest.py").write_text(HONEST)
    made: list[NodeSandbox] = []
    thread = threading.Thread(target=lambda: made.append(NodeSandbox(tmp_path, Isolation.NONE)))
    thread.start()
    thread.join()
    with made[0] as sandbox:
        program = sandbox.group().start("honest")
        assert program.wait(120)
        assert program.output() == "fine\n"


def test_closing_leaves_nothing_on_the_disk(tmp_path: Path) -> None:
    (tmp_path / "honest.py").write_text(HONEST)
    sandbox = NodeSandbox(tmp_path, Isolation.NONE)
    sandbox.group().start("honest").wait(120)
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


def test_processes_that_make_their_folders_at_once_take_none_from_each_other() -> None:
    makes = "from autograder.sandbox.scratch import Scratch\nfor _ in range(300):\n    Scratch().remove()"
    makers = [subprocess.Popen([sys.executable, "-c", makes], stderr=subprocess.PIPE, text=True) for _ in range(6)]
    assert [maker.communicate(timeout=600)[1] for maker in makers] == [""] * len(makers)
