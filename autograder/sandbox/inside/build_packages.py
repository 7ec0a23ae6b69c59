"""Builds ROS packages with colcon. It writes the installed files to stdout as a tar, and all messages to stderr.

The setup.py and CMake files are the student's, and they must not be able to write the tar themselves. Therefore its
descriptor is not inherited, and no process can open it in /proc, because this process is not dumpable. In its sandbox,
this is the first process, so no other process has the descriptor either.

Usage: `python build_packages.py SRC WORK PREFIX PACKAGE…`. SRC is the folder that contains the packages' sources, WORK
is an empty folder, and PREFIX is the environment whose `share` contains ament's CMake files. Like everything in this
folder, the module does not depend on the rest of the kit.
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
"""The limits of each process. A compiler of the generated code takes 300 MiB and two seconds."""
_AT_ONCE = "2"
_ENTRIES = 30_000
"""The number of files and folders that a build may create, because each takes memory of the kernel. Interfaces create
about 2,500."""
_LOOK = 0.1
"""The seconds between two looks at how many there are."""
_PR_SET_DUMPABLE = 4

_FIX_UPS = """\
# The wheels were built in /opt/python, and their exported targets still name folders there.
function(_finish_targets)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(folders)
      list(FILTER folders EXCLUDE REGEX "^/opt/python/")
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${folders}")
    endif()
  endforeach()
  # Nearly all of the time goes into reading Fast CDR's headers, so up to eight files are compiled as one.
  if(TARGET ${PROJECT_NAME}__rosidl_typesupport_fastrtps_c)
    set_target_properties(${PROJECT_NAME}__rosidl_typesupport_fastrtps_c PROPERTIES UNITY_BUILD ON)
  endif()
endfunction()
cmake_language(DEFER CALL _finish_targets)
set_property(GLOBAL PROPERTY RULE_MESSAGES OFF)  # each takes a process
set_property(GLOBAL PROPERTY TARGET_MESSAGES OFF)

# Nothing here uses C++, which takes a third of a build's time. The generators are called one after the other from a
# list, in which those of C++ are not left. The type support for introspection has to stay, because Fast DDS's RMW
# registers types with it. Of the modules that connect Python with each type support, rclpy imports only the one that
# finds the right type support.
macro(_leave_out_unused variable access)
  if("${access}" STREQUAL "MODIFIED_ACCESS" AND NOT _leaving_out)
    set(_leaving_out ON)
    list(FILTER ${variable} EXCLUDE REGEX "^rosidl_(generator|typesupport|typesupport_[a-z]+)_cpp:")
    macro(rosidl_generator_py_get_typesupports found)
      set(${found} rosidl_typesupport_c)
    endmacro()
    set(_leaving_out OFF)
  endif()
endmacro()
variable_watch(AMENT_EXTENSIONS_rosidl_generate_idl_interfaces _leave_out_unused)
"""


def _keep_output() -> BinaryIO:
    """Return stdout as a file that no other process gets, and redirect everything else that prints there to stderr."""
    ctypes.CDLL(None).prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)
    out = os.fdopen(os.dup(1), "wb")  # descriptors that Python duplicates are not inherited by other programs
    os.dup2(2, 1)
    return out


def _end_all_if_too_many(work: str, over: threading.Event) -> None:
    """End everything in this sandbox if there are too many files; return when `over` is set."""
    before = os.statvfs(work)
    while not over.wait(_LOOK):
        now = os.statvfs(work)
        if (now.f_files - now.f_ffree) - (before.f_files - before.f_ffree) > _ENTRIES:
            print(
                f"The build was ended: it made more than {_ENTRIES:,} files and folders.", file=sys.stderr, flush=True
            )
            os.kill(-1, signal.SIGKILL)  # all processes except this one, which is the first
            os._exit(1)


def _others() -> int:
    """Return how many processes and threads this user has already, because the kernel's limit counts all of them."""
    count = 0
    for pid in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):  # the process has ended
            if os.stat(f"/proc/{pid}").st_uid == os.getuid():
                count += len(os.listdir(f"/proc/{pid}/task"))
    return count


def main() -> int:
    """Build the packages, and return the exit status of colcon."""
    out = _keep_output()
    source, work, prefix, *packages = sys.argv[1:]
    for name, value in _LIMITS.items():
        hard = resource.getrlimit(name)[1]
        value += _others() if name == resource.RLIMIT_NPROC else 0
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(name, (value, value))
    for package in packages:
        # The sources are copied, because a setup.py with setuptools writes files beside itself.
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
        "--cmake-args", "-DBUILD_TESTING=OFF", "-DCMAKE_SKIP_INSTALL_ALL_DEPENDENCY=ON", "-Wno-dev",
        "-DCMAKE_PROJECT_INCLUDE=" + fix_ups, "-DPython3_EXECUTABLE=" + sys.executable,
    ]  # fmt: skip
    over = threading.Event()
    if os.getpid() == 1:  # otherwise the build runs on a student's own computer, with other processes and files
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
