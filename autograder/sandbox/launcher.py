"""Starts a student's programs by forking itself, with Python, rclpy and the usual messages already loaded.

Three kinds of process come of this file, each a fork of the one before:

- the launcher, which loads everything once and starts nothing of a student's;
- for each launch a *first process*, with a process list, a /tmp and a /dev/shm of its own where the kernel gives them
  (`"namespaces"`), without privileges, and with the limits of a launch. When it ends, all its programs have ended;
- the programs. They can neither see the launcher nor read, write, stop or end the first process, nor read or write
  each other's memory.

It stands alone: apart from `probe.py` in its folder it imports nothing of the kit.

Usage: launcher.py FD [SCRATCH]. FD is one end of a SOCK_SEQPACKET pair. Requests to the launcher are JSON, each with
one end of a further such pair, on which the first process of the new launch then answers:
    {"namespaces", "disk", "inodes", "limits", "filter", "program_filter"}
Requests to a first process:
    {"id", "path", "args", "env", "cpus", "cores"} with descriptors (output, events, stacks)
Its answers: {"first": true} with its pidfd, {"ready": true} or {"broken": why}, {"started": id} with a pidfd,
    {"failed": id, "why"}, {"ended": id, "status"}.
At the end of its socket each of them ends, and takes what is below it along. The launcher
removes the folder SCRATCH, unless the process that started it still lives.
"""

import contextlib
import ctypes
import faulthandler
import gc
import importlib
import importlib.util
import json
import linecache
import os
import re
import resource
import select
import shutil
import signal
import socket
import struct
import sys
import traceback
import types
from typing import Any

STACK_SIGNAL = signal.SIGRTMIN + 10
PR_SET_PDEATHSIG, PR_SET_DUMPABLE, PR_SET_SECCOMP, PR_SET_CHILD_SUBREAPER, PR_SET_NO_NEW_PRIVS = 1, 4, 22, 36, 38
PR_CAPBSET_DROP, PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL = 24, 47, 4
CLONE_NEWNS, CLONE_NEWPID = 0x20000, 0x20000000
MS_RDONLY, MS_NOSUID, MS_NODEV, MS_NOEXEC = 1, 2, 4, 8
MS_REMOUNT, MS_BIND, MS_REC, MS_PRIVATE = 0x20, 0x1000, 0x4000, 1 << 18
EVENTS_FD, STACKS_FD = 3, 4

WARM = (
    "rclpy",
    "rclpy.action",
    "rclpy.callback_groups",
    "rclpy.executors",
    "rclpy.lifecycle",
    "rclpy.node",
    "rclpy.parameter",
    "rclpy.qos",
    "builtin_interfaces.msg",
    "geometry_msgs.msg",
    "lifecycle_msgs.srv",
    "rcl_interfaces.srv",
    "sensor_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
)
WARM_TYPES = ("std_msgs.msg:String", "std_msgs.msg:Int32", "std_srvs.srv:Trigger", "std_srvs.srv:SetBool")

_libc = ctypes.CDLL(None, use_errno=True)
_prctl = _libc.prctl
_PARENT = os.getppid()


def _load_probe() -> Any:
    """Load `probe.py` by its path, under a name that no program of a student's has."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "probe.py")
    spec = importlib.util.spec_from_file_location("_autograder_probe", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


probe = _load_probe()


class Start:
    """A request to start one program, and the descriptors that came with it."""

    def __init__(self, request: dict[str, Any], descriptors: list[int], launch: dict[str, Any]) -> None:
        """Keep what the request says, and what holds for the whole launch."""
        self.id: int = request["id"]
        self.path: str = request["path"]
        self.args: list[str] = request["args"]
        self.env: dict[str, str] = request["env"]
        self.cpus: list[int] = request["cpus"]
        self.cores: int = request["cores"]
        self.limits: dict[str, int] = launch["limits"]
        self.filter = bytes.fromhex(launch["program_filter"])
        # From the other programs of the launch: its memory and its settings. Without namespaces the limits of memory
        # could not be held: who counts it is no more than its equal there.
        self.hidden: bool = launch["namespaces"]
        self.output, self.events, self.stacks = descriptors


def warm_up() -> None:
    """Load what programs need, without joining a ROS domain."""
    # The ROS libraries' tracer (LTTng) starts threads when it is loaded, and ends them when the process exits. A fork
    # has not got them, and crashes at its very end. Handlers run last in first out: this one, from before anything
    # was loaded, runs after every destructor of C++ objects and before the libraries' own finish.
    _libc.on_exit(_libc._exit, None)
    for name in WARM:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    with contextlib.suppress(Exception):
        import rclpy

        rclpy.get_rmw_implementation_identifier()  # loads the middleware
        for name in WARM_TYPES:
            module, kind = name.split(":")
            getattr(importlib.import_module(module), kind).__class__.__import_type_support__()
    with contextlib.suppress(Exception):
        probe.prepare()
    gc.collect()
    gc.freeze()  # the collector would write to every object, and so unshare every page


def launch(channel: socket.socket, scratch: str) -> tuple[socket.socket, dict[str, Any]]:
    """Start the first process of each launch that is asked for. Returns only in such a process."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody asks how a first process ended
    while True:
        packet, passed, _, _ = socket.recv_fds(channel, 1 << 20, 1)
        if not packet:
            end_everything(scratch)
        request = json.loads(packet)
        between = os.fork()
        if between == 0:
            channel.close()
            answers = socket.socket(fileno=passed[0])
            _fork_first(answers, request)
            return answers, request
        os.close(passed[0])
        with contextlib.suppress(ChildProcessError):
            os.waitpid(between, 0)


def _fork_first(answers: socket.socket, request: dict[str, Any]) -> None:
    """Become the first process of a launch: by one more fork, since a process never changes its own PID namespace."""
    try:
        if request["namespaces"]:
            _checked(_libc.unshare(CLONE_NEWPID | CLONE_NEWNS))
        first = os.fork()
    except OSError as error:
        _send(answers, {"broken": str(error)})
        os._exit(1)
    if first != 0:
        handle = os.pidfd_open(first)
        with contextlib.suppress(OSError):
            socket.send_fds(answers, [b'{"first": true}'], [handle])
        os._exit(0)
    try:
        _prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        if request["namespaces"]:
            _fresh_places(request["disk"], request["inodes"])
            _give_up_privileges()
        for name, value in request["limits"].items():
            if name != "RLIMIT_CPU":
                _limit(getattr(resource, name), value)
        if request["filter"]:
            _filter_calls(bytes.fromhex(request["filter"]))
    except OSError as error:
        _send(answers, {"broken": str(error)})
        os._exit(1)


def _fresh_places(disk: int, inodes: int) -> None:
    """An empty /tmp and /dev/shm of limited size and number of files, and a /proc that shows this launch alone."""
    _checked(_libc.mount(None, b"/", None, MS_REC | MS_PRIVATE, None))
    options = f"size={disk},nr_inodes={inodes},mode=1777".encode()
    python = _python_below("/tmp")
    for place in (b"/tmp", b"/dev/shm"):
        _checked(_libc.mount(b"tmpfs", place, b"tmpfs", MS_NOSUID | MS_NODEV, options))
    _put_back(*python)
    _checked(_libc.mount(b"proc", b"/proc", b"proc", MS_NOSUID | MS_NODEV | MS_NOEXEC, None))
    # Settings of the namespaces, some of which would be the programs' own.
    _checked(_libc.mount(b"/proc/sys", b"/proc/sys", None, MS_BIND, None))
    read_only = MS_BIND | MS_REMOUNT | MS_RDONLY | MS_NOSUID | MS_NODEV | MS_NOEXEC
    _checked(_libc.mount(None, b"/proc/sys", None, read_only, None))


def _python_below(place: str) -> tuple[list[str], list[tuple[str, str]], list[tuple[str, bool, int]]]:
    """Folders, links and mounts below a place: where the environment itself lies there, Python must stay in sight."""
    with open("/proc/self/mountinfo", encoding="utf-8", errors="surrogateescape") as table:
        lines = [line.split(" ")[4] for line in table]
    mounts = {re.sub(r"\\([0-7]{3})", lambda code: chr(int(code[1], 8)), line) for line in lines}
    folders: list[str] = []
    links: list[tuple[str, str]] = []
    held: list[tuple[str, bool, int]] = []
    waiting = [place]
    while waiting:
        for entry in os.scandir(waiting.pop()):
            if entry.path in mounts:
                held.append((entry.path, entry.is_dir(), os.open(entry.path, os.O_PATH | os.O_CLOEXEC)))
            elif entry.is_symlink():
                links.append((os.readlink(entry.path), entry.path))
            elif entry.is_dir():
                folders.append(entry.path)
                waiting.append(entry.path)
    return folders, links, held


def _put_back(folders: list[str], links: list[tuple[str, str]], held: list[tuple[str, bool, int]]) -> None:
    """Make what `_python_below` found once more, read-only as it was."""
    for folder in folders:
        os.mkdir(folder, 0o755)
    for target, link in links:
        os.symlink(target, link)
    for path, is_folder, handle in held:
        if is_folder:
            os.mkdir(path, 0o755)
        else:
            os.close(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_CLOEXEC, 0o644))
        where = os.fsencode(path)
        _checked(_libc.mount(f"/proc/self/fd/{handle}".encode(), where, None, MS_BIND | MS_REC, None))
        os.close(handle)
        if not os.statvfs(path).f_flag & os.ST_RDONLY:
            flags = MS_BIND | MS_REMOUNT | MS_RDONLY | MS_NOSUID | MS_NODEV
            _checked(_libc.mount(None, where, None, flags, None))


def _give_up_privileges() -> None:
    """Give up every capability, in this process and in all that it ever starts, and make sure of it."""
    number = 0
    while _prctl(PR_CAPBSET_DROP, number, 0, 0, 0) == 0:
        number += 1  # fails after the last that the kernel knows
    _checked(_prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0))
    header = struct.pack("II", 0x20080522, 0)  # capset(2), version 3
    _checked(_libc.capset(header, bytes(24)))
    _checked(_prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
    with open("/proc/self/status") as status:
        left = [line for line in status if line.startswith("Cap") and int(line.split()[1], 16) != 0]
    if left:
        raise OSError(f"privileges are left: {' '.join(left)}")


def _checked(result: int) -> None:
    if result != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def serve(channel: socket.socket, request: dict[str, Any]) -> Start:
    """Answer, as the first process of a launch, until its end. Returns only in a program's process."""
    children: dict[int, int] = {}
    wake_read, wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of what a program may send it, the only one that would end it
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
    poll = select.poll()
    poll.register(channel, select.POLLIN)
    poll.register(wake_read, select.POLLIN)
    _send(channel, {"ready": True})
    while True:
        for descriptor, _ in poll.poll():
            if descriptor == wake_read:
                with contextlib.suppress(BlockingIOError):
                    os.read(wake_read, 4096)
                continue
            packet, passed, _, _ = socket.recv_fds(channel, 1 << 20, 3)
            if not packet:
                for child in children:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(child, signal.SIGKILL)
                os._exit(0)
            start = Start(json.loads(packet), passed, request)
            if _fork(channel, start, children) == 0:
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                os.close(wake_read)
                os.close(wake_write)
                channel.close()
                return start
        _reap(channel, children)


def _fork(channel: socket.socket, start: Start, children: dict[int, int]) -> int:
    parent = os.getpid()
    try:
        child = os.fork()
    except OSError as error:
        _send(channel, {"failed": start.id, "why": str(error)})
        child = -1
    if child == 0:
        _prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
        return 0
    for descriptor in (start.output, start.events, start.stacks):
        os.close(descriptor)
    if child > 0:
        children[child] = start.id
        handle = os.pidfd_open(child)
        with contextlib.suppress(OSError):
            socket.send_fds(channel, [json.dumps({"started": start.id}).encode()], [handle])
        os.close(handle)
    return child


def _reap(channel: socket.socket, children: dict[int, int]) -> None:
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if pid == 0:
            return
        if pid in children:
            _send(channel, {"ended": children.pop(pid), "status": os.waitstatus_to_exitcode(status)})


def _send(channel: socket.socket, answer: dict[str, Any]) -> None:
    try:
        channel.send(json.dumps(answer).encode())
    except OSError:
        os._exit(0)  # nobody is left to answer to


def end_everything(scratch: str) -> None:
    """End every program and then this process. Where no PID namespace does it, descendants are found one by one."""
    me = os.getpid()
    while me != 1:
        parents: dict[int, int] = {}
        for entry in os.listdir("/proc"):
            with contextlib.suppress(OSError, ValueError, IndexError):
                with open(f"/proc/{int(entry)}/stat") as stat:
                    fields = stat.read().rpartition(")")[2].split()
                if fields[0] != "Z":
                    parents[int(entry)] = int(fields[1])
        family = {me}
        while grown := {pid for pid, parent in parents.items() if parent in family} - family:
            family |= grown
        if family == {me}:
            break
        for pid in family - {me}:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
    if scratch and os.getppid() != _PARENT:  # whoever lives looks after its own folder
        shutil.rmtree(scratch, ignore_errors=True)
    os._exit(0)


def become(start: Start) -> None:
    """Turn this forked child into the process that the program expects: descriptors, limits, environment."""
    os.setsid()
    if not start.hidden:
        _prctl(PR_SET_DUMPABLE, 1)
    spare = [os.dup(descriptor) for descriptor in (start.output, start.events, start.stacks)]
    nothing = os.open(os.devnull, os.O_RDONLY)
    moved = [_above(descriptor) for descriptor in (nothing, *spare)]
    os.dup2(moved[0], 0)
    os.dup2(moved[1], 1)
    os.dup2(moved[1], 2)
    os.dup2(moved[2], EVENTS_FD, inheritable=False)
    os.dup2(moved[3], STACKS_FD, inheritable=False)
    os.closerange(STACKS_FD + 1, 4096)
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, start.cpus)
    if len(start.cpus) < start.cores:  # rclpy takes as many threads as this says: the same number on every machine
        pretended = set(range(start.cores))
        os.sched_getaffinity = lambda _pid: pretended
    os.environ.clear()
    os.environ.update(start.env)
    os.chdir(os.path.dirname(start.path))
    for name, value in start.limits.items():
        _limit(getattr(resource, name), value)
    sys.stdin = open(0, closefd=False)
    sys.stdout = open(1, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)
    vars(sys).update(__stdin__=sys.stdin, __stdout__=sys.stdout, __stderr__=sys.stderr)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    faulthandler.register(STACK_SIGNAL, file=STACKS_FD, all_threads=True, chain=False)
    _filter_calls(start.filter)


class _FilterProgram(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_char_p))


def _filter_calls(content: bytes) -> None:
    """Put this process under a filter of system calls, an array of `struct sock_filter`."""
    program = _FilterProgram(len(content) // 8, content)
    _prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    if _prctl(PR_SET_SECCOMP, 2, ctypes.byref(program), 0, 0) != 0:
        raise OSError("the filter of system calls was refused")


def _above(descriptor: int) -> int:
    import fcntl

    return fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 64)


def _limit(which: int, value: int) -> None:
    _, hard = resource.getrlimit(which)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    # Of CPU time one second more: at the soft limit comes a signal that says so, at the hard one the end.
    most = value + 1 if which == resource.RLIMIT_CPU and hard == resource.RLIM_INFINITY else value
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(which, (value, most))


def run(start: Start) -> None:
    """Run the program as `python NAME.py` would: its own `__main__`, its own frames in a traceback."""
    folder = os.path.dirname(start.path)
    sys.argv = [start.path, *start.args]
    sys.orig_argv = [sys.executable, *sys.argv]
    sys.path[0] = folder
    linecache.clearcache()
    importlib.invalidate_caches()
    sys.excepthook = _print_own_frames
    main = types.ModuleType("__main__")
    main.__file__ = start.path
    main.__builtins__ = __builtins__  # type: ignore[attr-defined]
    sys.modules["__main__"] = main
    with contextlib.suppress(Exception):
        probe.install(EVENTS_FD, folder)
    with open(start.path, "rb") as file:
        source = file.read()
    exec(compile(source, start.path, "exec", dont_inherit=True), main.__dict__)


def _print_own_frames(kind: type[BaseException], error: BaseException, trace: types.TracebackType | None) -> None:
    if isinstance(error, MemoryError):
        probe.emit({"e": "memory_error"})
    seen: set[int] = set()
    link: BaseException | None = error
    while link is not None and id(link) not in seen:
        seen.add(id(link))
        link.__traceback__ = _without_own(link.__traceback__)
        link = link.__cause__ or link.__context__
    traceback.print_exception(kind, error, error.__traceback__)


def _without_own(trace: types.TracebackType | None) -> types.TracebackType | None:
    own = (__file__, probe.__file__)
    kept: list[types.TracebackType] = []
    while trace is not None:
        if trace.tb_frame.f_code.co_filename not in own:
            kept.append(trace)
        trace = trace.tb_next
    result: types.TracebackType | None = None
    for entry in reversed(kept):
        result = types.TracebackType(result, entry.tb_frame, entry.tb_lasti, entry.tb_lineno)
    return result


if __name__ == "__main__":
    _prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    sys.path.insert(0, "")  # the place of the program's folder
    warm_up()
    # After the imports: no program can trace a process of these, or open their memory or descriptors, from here on.
    _prctl(PR_SET_DUMPABLE, 0)
    wanted = serve(*launch(socket.socket(fileno=int(sys.argv[1])), "".join(sys.argv[2:])))
    become(wanted)
    run(wanted)
