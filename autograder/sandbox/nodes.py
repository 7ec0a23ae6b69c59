"""The node sandbox: starts a student's programs by a warm launcher, watches what they use, and ends them.

Used by the grading worker inside the grading sandbox, and with `Isolation.NONE` in a student's own Jupyter kernel,
which is never forked: it has threads.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import random
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from autograder.errors import KitError
from autograder.results import Isolation
from autograder.sandbox import bubblewrap, seccomp
from autograder.sandbox.environment import HERE, python_environment
from autograder.sandbox.limits import Limits
from autograder.sandbox.processes import Process, descendants, proportional_memory
from autograder.sandbox.program import Program

__all__ = ["Limits", "NodeSandbox", "Program"]

_READY = 30.0
"""Seconds that a launcher may take to load rclpy on a machine that is busy."""
_ANSWER = 10.0
"""Seconds after which a launcher that does not answer is given up; a program may have stopped it."""
_WATCH = 0.1
"""Seconds between two looks at what the programs use."""


class _Launcher:
    """A launcher process, its channel, and the programs it started."""

    def __init__(self, process: subprocess.Popen[bytes], channel: socket.socket) -> None:
        self.process = process
        self.channel = channel
        self.ready = False
        self.lost = False
        self.all_ended = False
        self.pid = -1
        """The launcher's process id as this process sees it, once it is ready."""
        self.programs: dict[int, Program] = {}


class NodeSandbox:
    """Runs the programs of one folder.

    Args:
        folder: holds the programs (`NAME.py`) and their files; it is their working directory, read-only to them.
        isolation: how they are kept apart. `Isolation.FULL` works in the grading sandbox, and for an ordinary user.
        limits: what they may use.

    Raises:
        KitError: the sandbox cannot be started.
    """

    def __init__(self, folder: Path, isolation: Isolation, *, limits: Limits | None = None) -> None:
        """Start the launcher at once, without waiting for it: it warms up while the caller goes on."""
        self.folder = folder
        self.isolation = isolation
        self.limits = limits or Limits()
        self._changed = threading.Condition()
        self._launcher: _Launcher | None = None
        self._next = 0
        self._closed = False
        self._scratch = Path(tempfile.mkdtemp(prefix="autograder-nodes-"))
        self._wake_read, self._wake_write = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        self._todo: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._on_wake)
        # bwrap ends with the thread that started it, so this one thread starts it, and lives as long as the sandbox.
        self._thread = threading.Thread(target=self._keep, name="node sandbox", daemon=True)
        self._thread.start()
        self._in_thread(self._spawn)

    # What callers use.

    def start(
        self, program: str, args: Sequence[str] = (), env: Mapping[str, str] | None = None, cores: int = 2
    ) -> Program:
        """Start `program`.py of the folder as a process of its own.

        Args:
            program: name without `.py`.
            args: `sys.argv[1:]`.
            env: variables besides those of every program, such as ROS_DOMAIN_ID.
            cores: the number of CPUs that it sees.

        Raises:
            FileNotFoundError: the folder has no such program.
            KitError: the launcher does not start it.
        """
        if not (self.folder / f"{program}.py").is_file():
            raise FileNotFoundError(f"{program}.py")
        for attempt in (1, 2):
            launcher = self._ready_launcher()
            with contextlib.suppress(TimeoutError, OSError):
                return self._start_in(launcher, program, list(args), dict(env or {}), cores)
            if attempt == 1:
                self._restart()
        raise KitError(f"The sandbox does not start {program}.py.", "Run `autograder doctor`.")

    def end_all(self) -> None:
        """End everything that was started, daemons included, and make sure of it. The launcher stays warm if it can."""
        launcher = self._launcher
        if launcher is None or launcher.lost:
            return
        self._end_family(launcher)
        with self._changed:
            launcher.all_ended = False
        with contextlib.suppress(OSError):
            everyone = self.isolation is Isolation.FULL
            launcher.channel.send(json.dumps({"do": "end_all", "everyone": everyone}).encode())
        with self._changed:
            answered = self._changed.wait_for(lambda: launcher.all_ended or launcher.lost, 2.0)
        if launcher.lost or not answered or not self._only_launcher_left(launcher):
            self._restart()

    def close(self) -> None:
        """End everything, the launcher included, and remove what lies on the disk. Can be called twice."""
        if self._closed:
            return
        self._in_thread(self._end_launcher)
        self._closed = True
        os.write(self._wake_write, b"x")
        self._thread.join()
        self._selector.close()
        os.close(self._wake_read)
        os.close(self._wake_write)
        shutil.rmtree(self._scratch, ignore_errors=True)

    def __enter__(self) -> NodeSandbox:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    # Starting.

    def _environment(self) -> dict[str, str]:
        variables = python_environment()
        home = "/tmp" if self.isolation is Isolation.FULL else str(self._scratch)
        if self.isolation is Isolation.FULL:
            variables["FASTRTPS_DEFAULT_PROFILES_FILE"] = f"{bubblewrap.KIT_FOLDER}/fastdds.xml"
        variables |= {"HOME": home, "TMPDIR": home, "ROS_LOG_DIR": f"{home}/log"}
        return variables

    def _spawn(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        end = str(theirs.fileno())
        python = [sys.executable, "-I"]
        with (self._scratch / "launcher.log").open("wb") as log:
            if self.isolation is Isolation.FULL:
                filtered = bubblewrap.memory_file("seccomp", seccomp.filter_program())
                process = bubblewrap.start_bwrap(
                    bubblewrap.inner_options(self.folder, self.limits, self._environment(), filtered),
                    [*python, f"{bubblewrap.KIT_FOLDER}/launcher.py", end],
                    (theirs.fileno(), filtered),
                    stderr=log.fileno(),
                )
                os.close(filtered)
            else:
                command = [*python, str(HERE / "launcher.py"), end]
                if self.isolation is Isolation.REDUCED:
                    from autograder.sandbox.landlock import confined

                    command = confined(command, self.folder, self._scratch)
                process = subprocess.Popen(
                    command, env=self._environment(), start_new_session=True, pass_fds=(theirs.fileno(),),
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log.fileno(), cwd=self._scratch,
                )  # fmt: skip
        theirs.close()
        ours.setblocking(False)
        launcher = _Launcher(process, ours)
        self._selector.register(ours, selectors.EVENT_READ, lambda: self._on_channel(launcher))
        self._launcher = launcher

    def _ready_launcher(self) -> _Launcher:
        if self._closed:
            raise KitError("The node sandbox is closed.")
        launcher = self._launcher
        if launcher is None or launcher.lost:
            self._restart()
            launcher = self._launcher
        assert launcher is not None
        with self._changed:
            self._changed.wait_for(lambda: launcher.ready or launcher.lost, _READY)
        if not launcher.ready:
            said = (self._scratch / "launcher.log").read_text(errors="replace").strip().splitlines()
            why = " ".join(said[-3:]) or "no answer"
            raise KitError(
                f"The node sandbox does not start ({self.isolation.value} isolation): {why}",
                "Run `autograder doctor`.",
            )
        return launcher

    def _start_in(self, launcher: _Launcher, name: str, args: list[str], env: dict[str, str], cores: int) -> Program:
        program = Program(name, self.limits, self._changed, self._catch_up)
        ends = [os.pipe2(os.O_CLOEXEC) for _ in range(3)]
        for ours, _ in ends:
            os.set_blocking(ours, False)
        for _, theirs in ends[1:]:
            os.set_blocking(theirs, False)  # the probe drops what does not fit, it never waits
        usable = sorted(os.sched_getaffinity(0))
        folder = bubblewrap.STUDENT_FOLDER if self.isolation is Isolation.FULL else str(self.folder)
        fixed = {key: value for key, value in self._environment().items() if key in _FIXED}
        self._next += 1
        number = self._next
        request = {
            "do": "start",
            "id": number,
            "path": f"{folder}/{name}.py",
            "args": args,
            "env": {**self._environment(), **env, **fixed},
            # A random choice: with the same two CPUs for everyone, a big machine would be idle beside them.
            "cpus": sorted(random.sample(usable, min(cores, len(usable)))),
            "cores": cores,
            "limits": bubblewrap.rlimits(self.limits),
            "filter": seccomp.no_processes().hex(),
        }
        with self._changed:
            launcher.programs[number] = program
        try:
            socket.send_fds(launcher.channel, [json.dumps(request).encode()], [theirs for _, theirs in ends])
        except BaseException:
            for ours, _ in ends:
                os.close(ours)
            raise
        finally:
            for _, theirs in ends:
                os.close(theirs)
        takers: tuple[Callable[[bytes], None], ...] = (
            program._take_output, program._take_events, program._take_stacks,
        )  # fmt: skip
        readers = [(ours, taker) for (ours, _), taker in zip(ends, takers, strict=True)]
        program.readers = [ours for ours, _ in readers]
        self._in_thread(lambda: self._watch_pipes(program, readers))
        with self._changed:
            known = self._changed.wait_for(lambda: program.pid >= 0 or not program.running() or launcher.lost, _ANSWER)
        if not known or (program.pid < 0 and launcher.lost):
            raise TimeoutError
        return program

    # Ending.

    def _restart(self) -> None:
        self._in_thread(self._end_launcher)
        self._in_thread(self._spawn)

    def _end_launcher(self) -> None:
        launcher = self._launcher
        if launcher is None:
            return
        if self.isolation is not Isolation.FULL:
            self._end_family(launcher)
        self._lose(launcher)
        if self.isolation is not Isolation.FULL:
            # At the end of its channel the launcher ends what is below it, and itself.
            with contextlib.suppress(subprocess.TimeoutExpired):
                launcher.process.wait(2.0)
        launcher.process.kill()
        launcher.process.wait()
        self._launcher = None

    def _lose(self, launcher: _Launcher) -> None:
        """The launcher is gone, or to be: nothing of it can be believed or waited for any more."""
        if launcher.lost:
            return
        self._selector.unregister(launcher.channel)
        launcher.channel.close()
        if self.isolation is Isolation.FULL:
            launcher.process.kill()  # with its first process the whole PID namespace ends
            launcher.process.wait()
        with self._changed:
            launcher.lost = True
            for program in launcher.programs.values():
                self._drain(program)
                program._ended(-signal.SIGKILL)
                self._forget_pipes(program)
            launcher.programs.clear()
            self._changed.notify_all()

    def _end_family(self, launcher: _Launcher) -> None:
        """Kill whatever descends from the launcher until nothing does."""
        deadline = time.monotonic() + 2.0
        while launcher.pid > 0 and (family := descendants(launcher.pid)) and time.monotonic() < deadline:
            for pid in family:
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.kill(pid, signal.SIGKILL)

    def _only_launcher_left(self, launcher: _Launcher) -> bool:
        """Whether, seen from outside, nothing is left but the launcher and what holds it."""
        deadline = time.monotonic() + 1.0
        while time.monotonic() < deadline:
            family = set(descendants(launcher.process.pid)) | {launcher.process.pid}
            holders = self._holders(launcher)
            if family <= holders:
                return True
            for pid in family - holders:
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.kill(pid, signal.SIGKILL)
        return False

    @staticmethod
    def _holders(launcher: _Launcher) -> set[int]:
        """The launcher and its ancestors down from the process that was spawned."""
        everyone = descendants(launcher.process.pid)
        chain = {launcher.process.pid}
        pid = launcher.pid
        while pid in everyone:
            chain.add(pid)
            pid = everyone[pid].parent
        return chain

    # The sandbox's own thread.

    def _in_thread(self, action: Callable[[], None]) -> None:
        """Do something in the sandbox's thread, and wait until it is done. What it raises is raised here."""
        done = threading.Event()
        problem: list[BaseException] = []

        def do() -> None:
            try:
                action()
            except BaseException as error:
                problem.append(error)
            finally:
                done.set()

        self._todo.put(do)
        os.write(self._wake_write, b"x")
        while not done.wait(0.5):
            if not self._thread.is_alive():
                raise KitError("The node sandbox has ended by itself.", "Run the command again.")
        if problem:
            raise problem[0]

    def _on_wake(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake_read, 4096)
        while not self._todo.empty():
            self._todo.get()()

    def _keep(self) -> None:
        look = 0.0
        pause = _WATCH
        while not self._closed:
            launcher = self._launcher
            busy = launcher is not None and bool(launcher.programs)
            wait = max(0.0, look - time.monotonic()) if busy else None
            for key, _ in self._selector.select(wait):
                self._guarded(key.data)
            if busy and time.monotonic() >= look and launcher is not None and launcher is self._launcher:
                began = time.thread_time()
                self._guarded(lambda: self._watch(launcher))  # noqa: B023
                # On a machine with a thousand processes a look is dear: never more than a fiftieth of the time.
                pause = max(_WATCH, 50 * (time.thread_time() - began))
                look = time.monotonic() + pause

    def _guarded(self, action: Callable[[], None]) -> None:
        """A launcher that talks nonsense must not end this thread, which everyone waits for."""
        try:
            action()
        except Exception:
            traceback.print_exc()
            if self._launcher is not None:
                self._lose(self._launcher)

    def _watch_pipes(self, program: Program, readers: list[tuple[int, Callable[[bytes], None]]]) -> None:
        for descriptor, taker in readers:
            self._selector.register(descriptor, selectors.EVENT_READ, self._reader(program, descriptor, taker))

    def _reader(self, program: Program, descriptor: int, taker: Callable[[bytes], None]) -> Callable[[], None]:
        def read() -> None:
            if descriptor not in program.readers:
                return  # closed by what came before it in the same round
            data = b""
            with contextlib.suppress(BlockingIOError):
                data = os.read(descriptor, 1 << 16)
                if not data:
                    self._forget_pipe(program, descriptor)
                    return
            if data:
                with self._changed:
                    taker(data)
                    self._changed.notify_all()

        return read

    def _catch_up(self, program: Program) -> None:
        """Take what lies in a running program's pipes: its answer may have come by DDS before its notes were read."""
        if program.readers and not self._closed:
            self._in_thread(lambda: self._drain(program))

    def _drain(self, program: Program) -> None:
        """Take what a program has left in its pipes, at most one limit's worth."""
        for descriptor in list(program.readers):
            key = self._selector.get_map().get(descriptor)
            for _ in range(64):
                before = program._written + len(program._events) + len(program._event_rest)
                if key is None or descriptor not in program.readers:
                    break
                key.data()
                if program._written + len(program._events) + len(program._event_rest) == before:
                    break

    def _forget_pipe(self, program: Program, descriptor: int) -> None:
        if descriptor in program.readers:
            program.readers.remove(descriptor)
            self._selector.unregister(descriptor)
            os.close(descriptor)

    def _forget_pipes(self, program: Program) -> None:
        for descriptor in list(program.readers):
            self._forget_pipe(program, descriptor)

    def _on_channel(self, launcher: _Launcher) -> None:
        try:
            packet, handles, _, _ = socket.recv_fds(launcher.channel, 1 << 16, 1)
        except BlockingIOError:
            return
        except OSError:
            packet, handles = b"", []
        if not packet:
            self._lose(launcher)
            return
        answer: dict[str, Any] = json.loads(packet)
        with self._changed:
            if "ready" in answer:
                launcher.pid = self._find(launcher, answer["ready"])
                launcher.ready = True
            elif "started" in answer:
                launcher.programs[answer["started"]]._started(handles[0])
            elif "failed" in answer:
                launcher.programs.pop(answer["failed"])._ended(1)
            elif "ended" in answer:
                program = launcher.programs.pop(answer["ended"], None)
                if program is not None:
                    self._drain(program)
                    program._ended(answer["status"])
                    self._forget_pipes(program)
            elif "all_ended" in answer:
                launcher.all_ended = True
            self._changed.notify_all()

    def _find(self, launcher: _Launcher, inner_pid: int) -> int:
        """Return the launcher's process id as seen from here."""
        if self.isolation is not Isolation.FULL:
            return launcher.process.pid
        family = descendants(launcher.process.pid)
        return next(pid for pid in family if not any(other.parent == pid for other in family.values()))

    # Limits.

    def _watch(self, launcher: _Launcher) -> None:
        """Look at what the programs use, and end the biggest of those that use too much together."""
        family = descendants(launcher.pid)
        now = time.monotonic()
        with self._changed:
            programs = [program for program in launcher.programs.values() if program.pid > 0]
            for program in programs:
                if now - program.began > self.limits.wall_seconds:
                    program._kill("time limit")
            base = _anonymous(launcher.pid)
            if sum(max(0, process.anonymous - base) for process in family.values()) > self.limits.memory:
                sizes = {pid: proportional_memory(pid) for pid in family}
                if sum(sizes.values()) > self.limits.memory:
                    self._end_biggest(programs, family, sizes, "memory limit")
            if sum(process.threads for process in family.values()) >= self.limits.processes - 8:
                counts = {pid: process.threads for pid, process in family.items()}
                self._end_biggest(programs, family, counts, "process limit")
            self._changed.notify_all()

    @staticmethod
    def _end_biggest(programs: list[Program], family: dict[int, Process], sizes: dict[int, int], why: str) -> None:
        """End the program whose processes use most, and all processes that belong to no program any more."""
        owned: dict[int, list[int]] = {}
        roots = {program.pid for program in programs}
        for pid in family:
            owner = pid
            while owner in family and owner not in roots:
                owner = family[owner].session if family[owner].session in roots else family[owner].parent
            owned.setdefault(owner if owner in roots else 0, []).append(pid)
        doomed = owned.pop(0, [])
        if owned:
            worst = max(owned, key=lambda owner: sum(sizes[pid] for pid in owned[owner]))
            doomed += owned[worst]
            next(program for program in programs if program.pid == worst)._kill(why)
        for pid in doomed:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)


_FIXED = ("FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_LOG_DIR", "HOME", "TMPDIR", "LD_LIBRARY_PATH")
"""What a caller cannot set for a program: it depends on where the program runs."""


def _anonymous(pid: int) -> int:
    with contextlib.suppress(OSError):
        sizes = Path(f"/proc/{pid}/statm").read_text().split()
        return (int(sizes[1]) - int(sizes[2])) * os.sysconf("SC_PAGE_SIZE")
    return 0
