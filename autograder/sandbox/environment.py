"""The environment of the observer and of students' programs, and the files that they must be able to read."""

from __future__ import annotations

import atexit
import contextlib
import functools
import os
import random
import shutil
import stat
import sys
import sysconfig
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
INSIDE = HERE / "inside"
"""The folder of the launcher, which does not depend on the rest of the kit. A sandbox shows only this part of the
kit."""
FASTDDS_PROFILE = INSIDE / "fastdds.xml"
GROUP = "AUTOGRADER_GROUP"
"""The variable from which the profile takes the multicast group in which participants discover each other."""


def profile_environment() -> dict[str, str]:
    """Return only the variables that an observer and a program must share to discover each other.

    `ROS_DOMAIN_ID` is not among them, because each launch has its own.
    """
    return {
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        **group_environment(_group()),
        "ROS_LOG_DIR": str(_log_folder()),
        "RCUTILS_COLORIZED_OUTPUT": "0",
    }


def group_environment(group: str) -> dict[str, str]:
    """Return the variables with which a program takes part in one multicast group, and in no other.

    Args:
        group: the address of the group.
    """
    return {"FASTRTPS_DEFAULT_PROFILES_FILE": str(FASTDDS_PROFILE), GROUP: group}


@functools.cache
def _group() -> str:
    """Return the multicast group of this process.

    It is chosen at random, so that other processes with the same domain ID do not hear this one.

    It is in the range for private use (RFC 2365). ROS itself uses 239.255.0.1.
    """
    return f"239.{'.'.join(str(random.SystemRandom().randrange(1, 255)) for _ in range(3))}"


@functools.cache
def _log_folder() -> Path:
    """Return the folder in which ROS writes its logs.

    Only its owner can read it. If another user has created a folder with this name, a new folder is created.
    """
    folder = Path(tempfile.gettempdir()) / f"autograder-log-{os.getuid()}"
    with contextlib.suppress(OSError):  # if nothing can be written, ROS reports it
        with contextlib.suppress(FileExistsError):  # no matter whether it is a folder
            folder.mkdir(mode=0o700)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
            return _own_log_folder(f"{folder.name}-")
        folder.chmod(0o700)
    return folder


def _own_log_folder(prefix: str) -> Path:
    """Create a folder for the logs of this process only. The process removes it when it ends."""
    folder, made_by = Path(tempfile.mkdtemp(prefix=prefix)), os.getpid()

    def remove() -> None:
        if os.getpid() == made_by:  # a fork of this process may end earlier
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder


def remove_logs() -> None:
    """Remove the log files of this process and of ended processes, because ROS creates one at each initialization."""
    for path in _log_folder().glob("*_*_*.log"):
        pid = path.stem.split("_")[-2]
        if pid == str(os.getpid()) or not Path(f"/proc/{pid}").exists():
            with contextlib.suppress(OSError):
                path.unlink()


def python_environment() -> dict[str, str]:
    """Return the whole environment of a process of this virtual environment, whatever the caller's environment is."""
    bin_folder = str(Path(sys.prefix) / "bin")
    return {
        "PATH": os.pathsep.join((bin_folder, "/usr/local/bin", "/usr/bin", "/bin")),
        "LANG": "C.UTF-8",
        "TZ": "UTC",
        "USER": "student",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUNBUFFERED": "1",
        # Unless these two are set, the wheels start Python a second time to find their libraries.
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        "LD_LIBRARY_PATH": os.pathsep.join(_library_folders()),
        # Messages load numpy. To start the threads of its linear algebra, which is not used here, would take as long as
        # to load everything else.
        "OPENBLAS_NUM_THREADS": "1",
        # Without this limit, sixty threads would reserve gigabytes of address space.
        "MALLOC_ARENA_MAX": "2",
        **profile_environment(),
    }


def _library_folders() -> list[str]:
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    packages = Path(sys.prefix) / "lib" / version / "site-packages"
    found = [Path(sys.prefix) / "lib", *sorted(packages.glob("ros_*.libs"))]
    inherited = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    return list(dict.fromkeys([str(path) for path in found] + [path for path in inherited if path]))


@dataclass(frozen=True)
class PythonPlaces:
    """Exactly the files and folders that make up this virtual environment and the Python on which it is based."""

    paths: list[Path]
    """The real paths of the folders and files. None of them is inside another one."""
    links: dict[Path, str]
    """The links that lead to `paths`, with the target of each. Links inside `paths` are left out."""


def python_places() -> PythonPlaces:
    """Return the places that a sandbox must show so that this Python starts as it does here.

    A virtual environment's interpreter is a chain of links, often through a version manager's folders or a home folder.
    A student's program must not see the other files beside a link. Therefore the links are created anew in the sandbox,
    and only their final targets are shown.
    """
    prefix, base = Path(sys.prefix), Path(sys.base_prefix)
    wanted = [prefix / name for name in ("pyvenv.cfg", "bin", "include", "lib", "lib64", "share") if prefix != base]
    wanted += [Path(sys.executable), Path(sysconfig.get_path("stdlib")), Path(sysconfig.get_path("platstdlib"))]
    wanted += [Path(sysconfig.get_path("include"))]  # Python's headers, because generated interfaces are extensions
    wanted += sorted(library for folder in ("lib", "lib64") for library in (base / folder).glob("*.so*"))
    links: dict[Path, str] = {}
    found = {_real(path, links) for path in wanted if path.exists()}
    paths = [path for path in sorted(found) if not _is_system(path) and not found & set(path.parents)]
    shown = set(paths)
    outside = {link: target for link, target in links.items() if not _is_system(link) and not shown & set(link.parents)}
    return PythonPlaces(paths, outside)


def _real(path: Path, links: dict[Path, str]) -> Path:
    """Resolve a path name by name, and add every link on the way to `links`."""
    done, names = Path("/"), list(path.parts[1:])
    while names:
        name = names.pop(0)
        here = done.parent if name == ".." else done / name
        if not here.is_symlink():
            done = here
            continue
        links[here] = str(here.readlink())
        target = here.readlink()
        names = [*target.parts[1 if target.is_absolute() else 0 :], *names]
        done = Path("/") if target.is_absolute() else done
    return done


def _is_system(path: Path) -> bool:
    return any(path.is_relative_to(folder) for folder in SYSTEM_FOLDERS)


SYSTEM_FOLDERS = ("/usr", "/bin", "/sbin", "/lib", "/lib64", "/lib32")
SYSTEM_FILES = ("/etc/ld.so.cache", "/etc/alternatives")
"""The cache of library paths, and the links that say which compiler is `cc`. Files about the time zone and the user are
not needed, because the environment sets both."""
