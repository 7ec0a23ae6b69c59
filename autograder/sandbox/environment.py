"""What the observer and every program of a student's find in their environment, and what they must be able to read."""

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
"""What the launcher consists of, which stands alone: a sandbox shows it and nothing else of the kit."""
FASTDDS_PROFILE = INSIDE / "fastdds.xml"
GROUP = "AUTOGRADER_GROUP"
"""The variable from which the profile takes the multicast group in which participants find each other."""


def profile_environment() -> dict[str, str]:
    """Return the variables that an observer and a program must share to see each other, and nothing else.

    `ROS_DOMAIN_ID` is not among them: each launch has its own.
    """
    return {
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        **group_environment(_group()),
        "ROS_LOG_DIR": str(_log_folder()),
        "RCUTILS_COLORIZED_OUTPUT": "0",
    }


def group_environment(group: str) -> dict[str, str]:
    """Return the variables with which a program takes part in a multicast group, and in no other.

    Args:
        group: its address.
    """
    return {"FASTRTPS_DEFAULT_PROFILES_FILE": str(FASTDDS_PROFILE), GROUP: group}


@functools.cache
def _group() -> str:
    """The multicast group of this process, drawn by lot: whoever takes the same domain id does not hear it.

    It is one of those that are for private use (RFC 2365). ROS itself uses 239.255.0.1.
    """
    return f"239.{'.'.join(str(random.SystemRandom().randrange(1, 255)) for _ in range(3))}"


@functools.cache
def _log_folder() -> Path:
    """Where ROS writes its logs: a folder that nobody but its owner can read, even if another user made it first."""
    folder = Path(tempfile.gettempdir()) / f"autograder-log-{os.getuid()}"
    with contextlib.suppress(OSError):  # where nothing can be written, ROS says so
        with contextlib.suppress(FileExistsError):  # whatever it is
            folder.mkdir(mode=0o700)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
            return _own_log_folder(f"{folder.name}-")
        folder.chmod(0o700)
    return folder


def _own_log_folder(prefix: str) -> Path:
    """A new folder for the logs of this process alone, which takes it away at its end."""
    folder, made_by = Path(tempfile.mkdtemp(prefix=prefix)), os.getpid()

    def remove() -> None:
        if os.getpid() == made_by:  # a fork of it ends earlier
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder


def remove_logs() -> None:
    """Remove the log files of this process and of those that have ended: ROS begins one each time it is initialized."""
    for path in _log_folder().glob("*_*_*.log"):
        pid = path.stem.split("_")[-2]
        if pid == str(os.getpid()) or not Path(f"/proc/{pid}").exists():
            with contextlib.suppress(OSError):
                path.unlink()


def python_environment() -> dict[str, str]:
    """Return the whole environment of a process of this virtual environment, whatever the caller's own looks like."""
    bin_folder = str(Path(sys.prefix) / "bin")
    return {
        "PATH": os.pathsep.join((bin_folder, "/usr/local/bin", "/usr/bin", "/bin")),
        "LANG": "C.UTF-8",
        "TZ": "UTC",
        "USER": "student",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUNBUFFERED": "1",
        # The wheels find their libraries by starting Python a second time, unless these two are set.
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        "LD_LIBRARY_PATH": os.pathsep.join(_library_folders()),
        # Messages load numpy; the threads of its linear algebra, which nobody here uses, take as long as all the rest.
        "OPENBLAS_NUM_THREADS": "1",
        # Fewer arenas: sixty threads would otherwise reserve gigabytes of address space.
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
    """What of the disk this virtual environment and the Python below it consist of, and nothing beside them."""

    paths: list[Path]
    """Folders and files, without links on the way to them; none inside another."""
    links: dict[Path, str]
    """The links that lead to them, and what each says; those inside of `paths` left out."""


def python_places() -> PythonPlaces:
    """Return what a sandbox must show for this Python to start as it does here.

    A virtual environment's interpreter is a chain of links, often through a version manager's folders or a home. What
    lies beside a link is none of a program's business: the links are made anew, and only their ends are shown.
    """
    prefix, base = Path(sys.prefix), Path(sys.base_prefix)
    wanted = [prefix / name for name in ("pyvenv.cfg", "bin", "include", "lib", "lib64", "share") if prefix != base]
    wanted += [Path(sys.executable), Path(sysconfig.get_path("stdlib")), Path(sysconfig.get_path("platstdlib"))]
    wanted += [Path(sysconfig.get_path("include"))]  # of Python itself: generated interfaces are extension modules
    wanted += sorted(library for folder in ("lib", "lib64") for library in (base / folder).glob("*.so*"))
    links: dict[Path, str] = {}
    found = {_real(path, links) for path in wanted if path.exists()}
    paths = [path for path in sorted(found) if not _is_system(path) and not found & set(path.parents)]
    shown = set(paths)
    outside = {link: target for link, target in links.items() if not _is_system(link) and not shown & set(link.parents)}
    return PythonPlaces(paths, outside)


def _real(path: Path, links: dict[Path, str]) -> Path:
    """Follow a path name by name to where it really is, and note every link on the way."""
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
"""Where libraries are, and which compiler is `cc`. Time zone and user are told by the environment."""
