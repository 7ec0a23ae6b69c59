"""What the observer and every program of a student's find in their environment, and what they must be able to read."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
FASTDDS_PROFILE = HERE / "fastdds.xml"


def profile_environment() -> dict[str, str]:
    """Return the variables that an observer and a program must share to see each other, and nothing else.

    `ROS_DOMAIN_ID` is not among them: each launch has its own.
    """
    return {
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(FASTDDS_PROFILE),
        "ROS_LOG_DIR": str(Path(tempfile.gettempdir()) / f"autograder-log-{os.getuid()}"),
        "RCUTILS_COLORIZED_OUTPUT": "0",
    }


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


def python_folders() -> list[Path]:
    """Return the folders that hold this virtual environment and the Python below it, outermost first.

    A virtual environment's interpreter is a chain of links, often through a version manager's folders: each hop is
    a path of its own that must exist in a sandbox.
    """
    folders = {Path(sys.prefix), Path(sys.base_prefix), Path(sys.base_prefix).resolve()}
    hop = Path(sys.executable)
    folders.add(hop.parent.parent)
    while hop.is_symlink():
        hop = hop.parent / hop.readlink()
        folders.add(Path(os.path.normpath(hop)).parent.parent)
    outside = {folder for folder in folders if not _is_system(folder)}
    return sorted(outside, key=lambda folder: len(folder.parts))


def _is_system(folder: Path) -> bool:
    return folder == Path("/") or folder.is_relative_to("/usr")


SYSTEM_FOLDERS = ("/usr", "/bin", "/sbin", "/lib", "/lib64", "/lib32")
SYSTEM_FILES = ("/etc/ld.so.cache", "/etc/localtime", "/etc/nsswitch.conf", "/etc/alternatives")
