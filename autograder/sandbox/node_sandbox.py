"""The node sandbox: starts a student's programs with a launcher that has already loaded rclpy, and ends them.

The grading worker uses it inside the grading sandbox. With `Isolation.NONE`, it is used in a student's own Jupyter
kernel, which is never forked, because it has threads.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from autograder.core.errors import KitError
from autograder.core.results import Isolation
from autograder.sandbox import spare_launcher
from autograder.sandbox.environment import INSIDE, python_environment
from autograder.sandbox.limits import Limits
from autograder.sandbox.loop import Loop
from autograder.sandbox.running_programs import GroupLost, RunningPrograms
from autograder.sandbox.scratch import Scratch
from autograder.sandbox.walls import bubblewrap, seccomp

_READY_WITHIN = 30.0
"""The seconds that a launcher may take to load rclpy on a busy machine."""
_ENDED_WITHIN = 2.0
"""The seconds that a launcher may take to end its descendants if there is no PID namespace that ends them."""


class NodeSandbox:
    """Runs the programs of one folder.

    Args:
        folder: the folder with the programs (`NAME.py`) and their files. It is the programs' working directory, and
            they cannot write to it.
        isolation: how they are isolated. `Isolation.FULL` works in the grading sandbox, and for an ordinary user.
        limits: what the programs of a group may use together.

    Raises:
        KitError: the sandbox cannot be started.
    """

    def __init__(self, folder: Path, isolation: Isolation, *, limits: Limits | None = None) -> None:
        """Start the launcher immediately, without waiting for it: it loads rclpy while the caller continues."""
        self.folder = folder
        self.isolation = isolation
        self.limits = limits or Limits()
        self._lock = threading.Lock()
        self._groups: list[RunningPrograms] = []
        self._launcher: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None
        self._said = -1
        """A file with what the launcher writes to its standard error."""
        self._closed = False
        self._may_use_spare = True
        """Whether the launcher may be one that is loaded already; not after such a launcher was lost."""
        self._scratch = None if isolation is Isolation.FULL else Scratch()
        # bwrap ends with the thread that started it, so this thread starts it and runs as long as the sandbox.
        self._loop = Loop(self._busy, self._look)
        try:
            self._loop.do(self._spawn)
        except BaseException:
            self.close()
            raise

    def group(self) -> RunningPrograms:
        """Begin a launch. Its programs have a new, empty /tmp, and end with this launch and with no other.

        Raises:
            KitError: the launch cannot be started.
        """
        why = ""
        for _ in range(2):
            try:
                group = self._new_group()
                group.wait_ready(_READY_WITHIN)
            except (OSError, GroupLost) as error:
                why = self._last_words() or str(error)
                self._may_use_spare = False
                self._loop.do(self._end_launcher)
                self._loop.do(self._spawn)
                continue
            return group
        raise KitError(
            f"The node sandbox does not start ({self.isolation.value} isolation): {why}", "Run `autograder doctor`."
        )

    def close(self) -> None:
        """End everything, including the launcher, and remove the files on the disk. This can be called twice."""
        if self._closed:
            return
        self._closed = True
        try:
            self._loop.do(self._end_launcher)
        finally:
            self._loop.stop()
            if self._scratch is not None:
                self._scratch.remove()

    def __enter__(self) -> NodeSandbox:
        """Return the sandbox."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the sandbox."""
        self.close()

    def _new_group(self) -> RunningPrograms:
        with self._lock:
            if self._closed or self._channel is None:
                raise KitError("The node sandbox is closed.")
            full = self.isolation is Isolation.FULL
            limits = bubblewrap.rlimits(self.limits)
            if not full:
                # Without a user namespace, the kernel counts all processes of the user, so no program could start
                # while a browser is running. Instead, `watch` counts the processes of a launch.
                del limits["RLIMIT_NPROC"]
            request = {
                "namespaces": full,
                "disk": self.limits.disk,
                "inodes": self.limits.inodes,
                "limits": limits,
                # With reduced isolation, the launcher already has this filter. Without isolation, none is needed,
                # because the programs are the user's own.
                "filter": seccomp.filter_program().hex() if full else "",
                "program_filter": seccomp.no_processes().hex(),
            }
            ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            try:
                socket.send_fds(self._channel, [json.dumps(request).encode()], [theirs.fileno()])
                inside = bubblewrap.STUDENT_FOLDER if full else str(self.folder)
                group = RunningPrograms(self.folder, inside, self._environment(), self.limits, self._loop, ours)
            except BaseException:
                ours.close()
                raise
            finally:
                theirs.close()
            self._groups = [*(one for one in self._groups if not one.over), group]
            return group

    def _environment(self) -> dict[str, str]:
        variables = python_environment()
        home = "/tmp"
        if self._scratch is None:
            variables["FASTRTPS_DEFAULT_PROFILES_FILE"] = f"{bubblewrap.KIT_FOLDER}/fastdds.xml"
        else:
            home = tempfile.mkdtemp(dir=self._scratch.folder)
        return variables | {"HOME": home, "TMPDIR": home, "ROS_LOG_DIR": f"{home}/log"}

    def _last_words(self) -> str:
        os.lseek(self._said, 0, os.SEEK_SET)
        return " ".join(os.read(self._said, 10_000).decode("utf-8", "replace").strip().splitlines()[-3:])

    # Methods that run in the sandbox's thread.

    def _spawn(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._said = os.memfd_create("launcher")
        end = str(theirs.fileno())
        python = [sys.executable, "-I"]
        try:
            if self._scratch is None:
                options = bubblewrap.inner_options(self.folder, self.limits, python_environment())
                with contextlib.suppress(OSError):  # then this sandbox starts a launcher of its own
                    if self._may_use_spare:
                        self._launcher = spare_launcher.start_launcher(options, theirs.fileno(), self._said)
                self._launcher = self._launcher or bubblewrap.start_bwrap(
                    options,
                    [*python, f"{bubblewrap.KIT_FOLDER}/launcher.py", end],
                    (theirs.fileno(),),
                    stderr=self._said,
                )
            else:
                command = [*python, str(INSIDE / "launcher.py"), end, str(self._scratch.folder)]
                if self.isolation is Isolation.REDUCED:
                    from autograder.sandbox.walls.landlock import confined

                    command = confined(command, self.folder, self._scratch.folder)
                self._launcher = subprocess.Popen(
                    command, env=self._environment(), start_new_session=True, pass_fds=(theirs.fileno(),),
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._said, cwd=self._scratch.folder,
                )  # fmt: skip
            self._channel = ours
        except BaseException:
            ours.close()
            os.close(self._said)
            raise
        finally:
            theirs.close()

    def _end_launcher(self) -> None:
        launcher, channel = self._launcher, self._channel
        if launcher is None or channel is None:
            return
        self._launcher = self._channel = None
        for group in self._groups:
            with contextlib.suppress(KitError):
                group.end()
        channel.close()
        if self._scratch is not None:
            # When its channel is closed, the launcher ends its descendants and itself.
            with contextlib.suppress(subprocess.TimeoutExpired):
                launcher.wait(_ENDED_WITHIN)
        launcher.kill()  # this ends everything in its PID namespace, if it has one
        launcher.wait()
        os.close(self._said)

    def _busy(self) -> bool:
        return any(group.running() for group in self._groups)

    def _look(self) -> None:
        for group in self._groups:
            group.watch()
