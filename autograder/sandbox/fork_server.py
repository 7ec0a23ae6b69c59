"""Forks the processes of the grading sandbox: one for each submission, with the kit and rclpy loaded already.

Loading takes longer than many a check. What is loaded is the kit's own, the same for every submission: this process
reads none of them, and hears of none but that one is to be forked. Each fork gets namespaces of its own before it reads
anything, as if it had been started anew: users, processes, network, IPC, and mounts with an empty /tmp and /dev/shm.

Usage: python -m autograder.sandbox.fork_server FD IDLE. FD is one end of a SOCK_SEQPACKET pair; after IDLE seconds
without a request or a fork the server ends. A request is JSON, the module and its arguments, with descriptors beside
it: a socket, and the standard input, output and error of the fork. That socket is its life line: when its other end is
closed, the fork and all that it started are ended. It says when the fork has begun, and, once all that has ended, the
exit status.
"""

from __future__ import annotations

import contextlib
import fcntl
import gc
import importlib
import json
import os
import runpy
import select
import signal
import socket
import struct
import sys
import traceback
from pathlib import Path
from typing import NoReturn

from autograder.sandbox.forks import BEGUN
from autograder.sandbox.inside import own_mounts
from autograder.sandbox.inside.kernel import (
    CLONE_NEWIPC,
    CLONE_NEWNET,
    CLONE_NEWNS,
    CLONE_NEWPID,
    CLONE_NEWUSER,
    CLONE_NEWUTS,
    PR_SET_NAME,
    PR_SET_PDEATHSIG,
    checked,
    give_up_privileges,
    libc,
    prctl,
)
from autograder.sandbox.inside.warm_up import keep_shared

DISK = 1 << 30
"""Bytes that may lie in a fork's /tmp, and again in its /dev/shm."""
_SET_FLAGS, _UP_AND_RUNNING = 0x8914, 0x41  # netdevice(7)


def main() -> int:
    """Serve until the end of the channel."""
    module, arguments = _serve(socket.socket(fileno=int(sys.argv[1])), float(sys.argv[2]))
    # In a fork. The ROS libraries' tracer would crash in the C library's end of the process: its threads are not here.
    status = 1
    try:
        status = _run(module, arguments)
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def _run(module: str, arguments: list[str]) -> int:
    """Run a module as `python -m` does; return the exit status."""
    sys.argv = [module, *arguments]
    prctl(PR_SET_NAME, module.rpartition(".")[2].encode())  # its command line is still that of the server
    try:
        if module in sys.modules:
            return int(sys.modules[module].main())
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def _serve(channel: socket.socket, idle: float) -> tuple[str, list[str]]:
    """Fork for every request. Returns only in a fork: the module to run, and its arguments."""
    poll = select.poll()
    poll.register(channel, select.POLLIN)
    forks = 0
    while True:
        asked = poll.poll(1000 * idle)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                forks -= 1
        if not asked and forks == 0:
            channel.shutdown(socket.SHUT_RD)  # what was asked for before this is still served
        if not asked:
            continue
        packet, descriptors, _, _ = socket.recv_fds(channel, 1 << 16, 4)
        if not packet:
            _end()
        module, *arguments = json.loads(packet)
        _load(module)
        if os.fork() == 0:
            channel.close()
            _become_first_process(socket.socket(fileno=descriptors[0]), descriptors[1:])
            return module, arguments
        forks += 1
        for descriptor in descriptors:
            os.close(descriptor)


def _end() -> NoReturn:
    """End once the forks have; if nobody waits for them any more, their life lines end them at once."""
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    os._exit(0)


def _load(module: str) -> None:
    """Load a module of the kit before the fork, and what it says that it needs, once."""
    if module in sys.modules or not module.startswith("autograder."):
        return
    gc.disable()  # of what is loaded here nothing is garbage
    with contextlib.suppress(Exception):  # the fork will say it
        prepare = getattr(importlib.import_module(module), "prepare", None)
        if prepare is not None:
            prepare()
    keep_shared()


def _become_first_process(life_line: socket.socket, streams: list[int]) -> None:
    """Return in a process that has all to itself; this one waits for its end, and says how it ended."""
    for number, descriptor in enumerate(streams):
        os.dup2(descriptor, number)
        os.close(descriptor)
    try:
        user, group = os.getuid(), os.getgid()
        alone = CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET | CLONE_NEWIPC | CLONE_NEWUTS | CLONE_NEWNS
        checked(libc.unshare(alone))
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"{user} {user} 1")
        Path("/proc/self/gid_map").write_text(f"{group} {group} 1")
        first = os.fork()
    except OSError as error:
        print(f"no namespaces for a submission: {error}", file=sys.stderr)
        os._exit(1)
    if first == 0:
        prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        life_line.close()
        _furnish()
        _fork_main_process()
        return
    with contextlib.suppress(OSError):
        life_line.send(BEGUN)
    handle = os.pidfd_open(first)
    for number in range(3):
        os.close(number)
    poll = select.poll()
    poll.register(life_line, select.POLLIN)
    poll.register(handle, select.POLLIN)
    poll.poll()
    os.kill(first, signal.SIGKILL)  # it has ended, or nobody waits for it any more; in the end all below it is gone
    _, status = os.waitpid(first, 0)
    with contextlib.suppress(OSError):
        life_line.send(str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _furnish() -> None:
    """Set up the new namespaces, and give up what that takes."""
    try:
        own_mounts.make(DISK, 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
            fcntl.ioctl(any_socket, _SET_FLAGS, struct.pack("16sH14x", b"lo", _UP_AND_RUNNING))
        give_up_privileges()
        os.chdir("/tmp")
    except OSError as error:
        print(f"a submission's sandbox cannot be set up: {error}", file=sys.stderr)
        os._exit(1)


def _fork_main_process() -> None:
    """Return in a further process; this one, the first of its namespace, only buries those whose parents are gone."""
    main_process = os.fork()
    if main_process == 0:
        os.setsid()
        return
    while True:
        pid, status = os.wait()
        if pid == main_process:
            code = os.waitstatus_to_exitcode(status)
            os._exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    main()
