"""Builds ROS packages with colcon; what is installed goes to standard output as a tar, what was said to standard error.

setup.py and CMake files are the student's and must not be able to write the tar themselves: its descriptor is not
handed on, and no process can open it in /proc, as this one is not dumpable. In its sandbox it is the first process, so
nobody else has it either.

Usage: `python build_packages.py SRC WORK PREFIX PACKAGE…`. SRC is the folder that holds the packages' sources, WORK an
empty folder, PREFIX the environment whose `share` holds ament's CMake files. It stands alone, as all in this folder.
"""

import contextlib
import ctypes
import os
import resource
import shutil
import signal
import subprocess
import sys
import tarfile
import threading
from typing import BinaryIO

MIB = 1024 * 1024
_LIMITS = {
    resource.RLIMIT_AS: 1024 * MIB,
    resource.RLIMIT_FSIZE: 16 * MIB,
    resource.RLIMIT_NPROC: 256,
    resource.RLIMIT_CORE: 0,
}
"""Of each process: a compiler of the generated code takes 300 MiB and two seconds."""
_AT_ONCE = "2"
_ENTRIES = 30_000
"""Files and folders that a build may make: each is memory of the kernel's. Interfaces make about 2,500."""
_LOOK = 0.1
"""Seconds between two looks at how many there are."""
_PR_SET_DUMPABLE = 4

_FIX_UPS = """\
# The wheels were built in /opt/python, and their exported targets still name folders there.
function(_drop_folders_of_the_wheels_build)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(folders)
      list(FILTER folders EXCLUDE REGEX "^/opt/python/")
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${folders}")
    endif()
  endforeach()
endfunction()
cmake_language(DEFER CALL _drop_folders_of_the_wheels_build)

# Nothing here uses C++, which takes a third of a build's time. The generators are called one after the other from a
# list, in which those of C++ are not left.
macro(_leave_out_unused variable access)
  if("${access}" STREQUAL "MODIFIED_ACCESS" AND NOT _leaving_out)
    set(_leaving_out ON)
    list(FILTER ${variable} EXCLUDE REGEX "^rosidl_(generator|typesupport|typesupport_[a-z]+)_cpp:")
    set(_leaving_out OFF)
  endif()
endmacro()
variable_watch(AMENT_EXTENSIONS_rosidl_generate_idl_interfaces _leave_out_unused)
"""


def _keep_output() -> BinaryIO:
    """Return standard output as a file that nothing else gets, and lead what prints there to standard error."""
    ctypes.CDLL(None).prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)
    out = os.fdopen(os.dup(1), "wb")  # Python's own duplicates are closed in whatever it starts
    os.dup2(2, 1)
    return out


def _end_all_if_too_many(work: str, over: threading.Event) -> None:
    """End everything in this sandbox once there are too many files, until it is over."""
    before = os.statvfs(work)
    while not over.wait(_LOOK):
        now = os.statvfs(work)
        if (now.f_files - now.f_ffree) - (before.f_files - before.f_ffree) > _ENTRIES:
            print(
                f"The build was ended: it made more than {_ENTRIES:,} files and folders.", file=sys.stderr, flush=True
            )
            os.kill(-1, signal.SIGKILL)  # all but this one, the first
            os._exit(1)


def _others() -> int:
    """How many processes and threads this user has already: the kernel's limit counts them, whatever they are."""
    count = 0
    for pid in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):  # it has ended
            if os.stat(f"/proc/{pid}").st_uid == os.getuid():
                count += len(os.listdir(f"/proc/{pid}/task"))
    return count


def main() -> int:
    """Build; the status is colcon's."""
    out = _keep_output()
    source, work, prefix, *packages = sys.argv[1:]
    for name, value in _LIMITS.items():
        hard = resource.getrlimit(name)[1]
        value += _others() if name == resource.RLIMIT_NPROC else 0
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(name, (value, value))
    for package in packages:
        # Copied: setup.py of setuptools writes beside itself.
        shutil.copytree(os.path.join(source, package), os.path.join(work, "src", package), symlinks=True)
    fix_ups = os.path.join(work, "fix_ups.cmake")
    with open(fix_ups, "w", encoding="utf-8") as file:
        file.write(_FIX_UPS)
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": prefix,
        "CMAKE_PREFIX_PATH": prefix,
        "CMAKE_GENERATOR": "Unix Makefiles",
        "CMAKE_BUILD_PARALLEL_LEVEL": _AT_ONCE,
        "MAKEFLAGS": "-j" + _AT_ONCE,
        "CFLAGS": "-O0",
        "CXXFLAGS": "-O0",
        "COLCON_HOME": os.path.join(work, "colcon"),
        "HOME": work,
    }
    command = [
        sys.executable, "-m", "colcon", "--log-base", "log", "build", "--base-paths", "src", "--executor", "sequential",
        "--event-handlers", "console_direct+", "console_stderr-", "desktop_notification-", "status-", "terminal_title-",
        "--cmake-args", "-DBUILD_TESTING=OFF", "-Wno-dev", "-DCMAKE_PROJECT_INCLUDE=" + fix_ups,
        "-DPython3_EXECUTABLE=" + sys.executable,
    ]  # fmt: skip
    over = threading.Event()
    if os.getpid() == 1:  # else it is somebody's own computer, and their own files
        threading.Thread(target=_end_all_if_too_many, args=(work, over), daemon=True).start()
    built = subprocess.run(command, cwd=work, env=environment, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=False)
    over.set()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    install = os.path.join(work, "install")
    with out, tarfile.open(fileobj=out, mode="w|") as archive:
        for package in packages:
            if os.path.isdir(os.path.join(install, package)):
                archive.add(os.path.join(install, package), arcname=package)
    return built.returncode


if __name__ == "__main__":
    sys.exit(main())
