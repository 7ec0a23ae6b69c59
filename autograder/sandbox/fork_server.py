"""Forks the processes of the grading sandbox: one for each submission, with the kit and rclpy loaded already.

Loading takes longer than many checks do. Only the kit's own code is loaded, which is the same for every submission.
This process reads no submission, and is only told that it should fork. Each fork gets its own namespaces before it
reads anything, as if it had been newly started: users, processes, network, IPC, and mounts with an empty /tmp and
/dev/shm.

Usage: python -m autograder.sandbox.fork_server FD IDLE. FD is one end of a SOCK_SEQPACKET pair. After IDLE seconds
without a request or a running fork, the server ends. A request is JSON that contains the module and its arguments, and
is sent with descriptors: a socket, and the standard input, output and error of the fork. That socket is the fork's
lifeline: when its other end is closed, the fork and everything that it started are ended. On this socket, the fork
reports that it has begun, and its parent, which is the server's child, its exit status after everything has ended.
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

from autograder.core import cpu_use
from autograder.sandbox import spare_launcher
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
"""The bytes that may be stored in a fork's /tmp, and as many in its /dev/shm."""
_SET_FLAGS, _UP_AND_RUNNING = 0x8914, 0x41  # netdevice(7)


def main() -> int:
    """Serve requests until the channel is closed. In a fork, run the requested module."""
    module, arguments = _serve(socket.socket(fileno=int(sys.argv[1])), float(sys.argv[2]))
    # This code runs in a fork. It ends with `_exit`, because the ROS libraries' tracer has no threads in a fork and
    # would crash in the C library's exit handlers.
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
    """Run a module as `python -m` does, and return the exit status."""
    sys.argv = [module, *arguments]
    prctl(PR_SET_NAME, module.rpartition(".")[2].encode())  # the command line is still that of the server
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
    """Fork for every request. This returns only in a fork, with the module to run and its arguments."""
    launchers = spare_launcher.start_server()
    poll = select.poll()
    poll.register(channel, select.POLLIN)
    forks: set[int] = set()
    while True:
        asked = poll.poll(1000 * idle)
        with contextlib.suppress(ChildProcessError):
            while ended := os.waitpid(-1, os.WNOHANG)[0]:
                forks.discard(ended)
        if not asked and not forks:
            channel.shutdown(socket.SHUT_RD)  # earlier requests are still served
        if not asked:
            continue
        packet, descriptors, _, _ = socket.recv_fds(channel, 1 << 16, 4)
        if not packet:
            launchers.close()
            _end()
        module, *arguments = json.loads(packet)
        _load(module)
        fork = os.fork()
        if fork == 0:
            channel.close()
            _become_first_process(socket.socket(fileno=descriptors[0]), descriptors[1:], launchers)
            return module, arguments
        forks.add(fork)
        for descriptor in descriptors:
            os.close(descriptor)


def _end() -> NoReturn:
    """End this process after all forks have ended. Forks that nobody waits for are ended by their lifelines."""
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    os._exit(0)


def _load(module: str) -> None:
    """Load a module of the kit once, before the fork, and call its `prepare` function to load what it needs."""
    if module in sys.modules or not module.startswith("autograder."):
        return
    gc.disable()  # nothing that is loaded here is garbage
    with contextlib.suppress(Exception):  # the fork will report the error
        prepare = getattr(importlib.import_module(module), "prepare", None)
        if prepare is not None:
            prepare()
    keep_shared()


def _become_first_process(life_line: socket.socket, streams: list[int], launchers: socket.socket) -> None:
    """Return only in a new process with its own namespaces.

    This process waits for its end and reports its exit status.
    """
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
        with contextlib.suppress(OSError):
            life_line.send(BEGUN)  # not by its parent, which may be later than what the module writes
        life_line.close()
        _furnish()
        spare_launcher.ask(launchers)
        _fork_main_process()
        return
    launchers.close()
    handle = os.pidfd_open(first)
    for number in range(3):
        os.close(number)
    poll = select.poll()
    poll.register(life_line, select.POLLIN)
    poll.register(handle, select.POLLIN)
    poll.poll()
    os.kill(first, signal.SIGKILL)  # it has ended, or nobody waits for it any more; this ends all its descendants, too
    _, status = os.waitpid(first, 0)
    with contextlib.suppress(OSError):
        life_line.send(str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _furnish() -> None:
    """Set up the new namespaces, and give up the privileges that this needs."""
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
    """Return only in a new process. This process, the first of its namespace, only reaps orphaned processes."""
    main_process = os.fork()
    if main_process == 0:
        os.setsid()
        cpu_use.count_all_below(os.getppid())  # the spare launcher is no descendant of this process
        return
    while True:
        pid, status = os.wait()
        if pid == main_process:
            code = os.waitstatus_to_exitcode(status)
            os._exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    main()
