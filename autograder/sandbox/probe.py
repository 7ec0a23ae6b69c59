"""Notes what a program does with rclpy, as JSON lines: for hints only, never for points; a program can forge them.

It runs inside the student's process and must never change what the program does, or end it. So every note is made in
a `_quiet` block, the wrapped function is called with its own arguments, and what it returns or raises goes on as it is.
Wrappers are installed once, in the launcher; a forked program only says where to write. What cannot be wrapped in some
version of rclpy is said by a `probe_failed` event, and then nothing is concluded from what the others say.

There are two kinds of lines. *Events* happen: an error in a callback, a wrong return value. *Records* stand for things
(a node, an executor, a timer, a call that may block) with what has become of them so far: how often, on how many
threads, since when. A record has a `key` and is written again when it has changed, soon but not at once; only its last
line counts. `autograder/diagnosis/events.py` reads both.
"""

import _thread
import atexit
import contextlib
import functools
import inspect
import itertools
import json
import linecache
import os
import sys
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

_MOST = 500
"""Events of one program; what it repeats is noted once. Records of things: no more either."""

_MOST_EXECUTORS = 8
"""Those that are written whenever anything is."""

_PAUSE = 0.25
"""Seconds between two writings of the records that have changed."""

_WRITE = 4000
"""Bytes that a pipe takes whole or not at all."""


class _Here(threading.local):
    """What this thread is doing."""

    callback: "_Thing | None" = None
    """The callback that it runs."""
    taken: Any = None
    """(thing, executor) of the callback that rclpy is about to run."""
    depth = 0
    """How many noted calls of rclpy are on the stack since the innermost callback began: rclpy calls itself."""
    building = False
    """Inside `Node.__init__`: what is made there is rclpy's own."""


class _State:
    fd = -1
    folder = "\0"
    left = _MOST
    failed: list[str] = []  # noqa: RUF012
    once: set[tuple[str, ...]] = set()  # noqa: RUF012
    expected: dict[Any, type] = {}  # noqa: RUF012
    """Callback of an action server -> what it must return."""
    owners: "weakref.WeakKeyDictionary[Any, Any]" = weakref.WeakKeyDictionary()  # noqa: RUF012
    """Lifecycle publisher -> node."""
    asked: "weakref.WeakKeyDictionary[Any, int]" = weakref.WeakKeyDictionary()  # noqa: RUF012
    """Future of a service call -> number of the client."""


_here = _Here()
_quiet = functools.partial(contextlib.suppress, Exception)


def _line_of(event: dict[str, Any]) -> bytes:
    short = {key: value[:500] if isinstance(value, str) else value for key, value in event.items()}
    return json.dumps(short).encode()[: _WRITE - 1] + b"\n"


def emit(event: dict[str, Any]) -> None:
    """Write one event, or drop it: a full pipe must not hold up the program."""
    if _State.fd < 0 or _State.left <= 0:
        return
    _State.left -= 1
    with _quiet():
        os.write(_State.fd, _line_of(event))


def _emit_once(event: dict[str, Any]) -> None:
    key = tuple(str(value) for value in event.values())
    if key not in _State.once:
        _State.once.add(key)
        emit(event)


def install(fd: int, folder: str) -> None:
    """Begin to write to `fd`; the program's own lines are those of files in `folder`."""
    _State.fd, _State.folder = fd, folder.rstrip("/") + "/"
    for what in _State.failed:
        emit({"e": "probe_failed", "what": what})
    emit({"e": "attached"})
    with _quiet():
        _note_thread_errors()
        atexit.register(_ledger.write)


# Records.


class _Ledger:
    """The things that are known, and the thread that writes down what has changed.

    The thread sleeps until something changes. It is none of `threading`'s, so that a program counts only its own.
    """

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.changed: dict[str, Any] = {}
        self.numbers = itertools.count(1)
        self.known: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        self.things: list[Any] = []
        self.calls: dict[tuple[Any, ...], _Call] = {}
        self.by_line: dict[tuple[str, ...], _Thing] = {}
        self.executors: list[_Executor] = []
        """They change with every callback, and are written whenever anything is."""
        self.wake = _thread.allocate_lock()
        self.wake.acquire()
        self.started = False

    def add(self, thing: Any, of: Any = None) -> None:
        """Take up a thing; `of` is the object of rclpy that it stands for."""
        if len(self.things) < _MOST:
            self.things.append(thing)
            if of is not None:
                self.known[of] = thing
            # At once: what the graph shows of a thing must find it known here.
            try:
                os.write(_State.fd, _line_of({"key": thing.key, **thing.event()}))
            except OSError:
                self.touch(thing)

    def touch(self, thing: Any) -> None:
        """Say that a thing has changed."""
        if thing.dirty or _State.fd < 0:
            return
        thing.dirty = True
        with self.lock:
            self.changed[thing.key] = thing
            start, self.started = not self.started, True
        if start:
            _thread.start_new_thread(self._keep_writing, ())
        if self.wake.locked():
            with contextlib.suppress(RuntimeError):  # another thread was faster
                self.wake.release()

    def _keep_writing(self) -> None:
        while True:
            self.wake.acquire()
            self.write()
            time.sleep(_PAUSE)

    def write(self) -> None:
        """Write what has changed, in pieces that the pipe takes whole."""
        with self.lock:
            changed, self.changed = self.changed, {}
        changed.update({executor.key: executor for executor in self.executors})
        piece = b""
        for thing in changed.values():
            with _quiet():
                thing.dirty = False  # before it is read: what changes from here on is written the next time
                line = _line_of({"key": thing.key, **thing.event()})
                if len(piece) + len(line) > _WRITE:
                    os.write(_State.fd, piece)
                    piece = b""
                piece += line
        if piece:
            with _quiet():
                os.write(_State.fd, piece)


class _Thing:
    """A timer, subscription, service, client, publisher or action server, or another kind of callback."""

    dirty = False

    def __init__(self, about: dict[str, Any]) -> None:
        self.number = next(_ledger.numbers)
        self.key = f"thing{self.number}"
        self.about = about
        self.runs = self.done = self.raised = self.most = 0
        self.last = 0.0
        self.running: dict[int, tuple[float, int]] = {}
        """Run -> since when, and on which thread it began."""
        self.threads: set[int] = set()
        self.awaits: dict[str, Any] = {}
        self.awaited = ""
        self.spent = 0.0

    def event(self) -> dict[str, Any]:
        return {
            "e": "thing",
            "id": self.number,
            **self.about,
            "runs": self.runs,
            "done": self.done,
            "raised": self.raised,
            "most": self.most,
            "last": self.last,
            "running": list(self.running.values())[:16],
            "threads": len(self.threads),
            "awaits": self.awaits,
            "awaited": self.awaited,
            "spent": self.spent,
        }

    def begin(self) -> int:
        with _ledger.lock:
            self.runs += 1
            run = self.runs
            self.last = time.monotonic()
            self.running[run] = (self.last, _thread.get_ident())
            self.most = max(self.most, len(self.running))
            self.threads.add(_thread.get_ident())
        _ledger.touch(self)
        return run

    def end(self, run: int, raised: bool) -> None:
        with _ledger.lock:
            self.spent += time.monotonic() - self.running.pop(run)[0]
            self.done += 1
            self.raised += raised
        _ledger.touch(self)

    def count(self) -> None:
        """One more message published, or request sent."""
        with _ledger.lock:
            self.runs += 1
            self.last = time.monotonic()
            self.threads.add(_thread.get_ident())
        _ledger.touch(self)


class _Call:
    """A call that may block, by its line: how often it was begun and how often it came back."""

    dirty = False

    def __init__(self, what: str, target: int, where: dict[str, str], callback: "_Thing | None") -> None:
        self.key = f"call{next(_ledger.numbers)}"
        self.what, self.target, self.where, self.callback = what, target, where, callback
        self.begun = self.ended = 0
        self.since = 0.0
        self.thread = 0

    def event(self) -> dict[str, Any]:
        return {
            "e": "call",
            "what": self.what,
            "in_callback": self.callback is not None,
            "callback": self.callback.number if self.callback else 0,
            "target": self.target,
            "begun": self.begun,
            "ended": self.ended,
            "since": self.since,
            "thread": self.thread,
            **self.where,
        }

    def begin(self) -> None:
        with _ledger.lock:
            self.begun += 1
            self.since, self.thread = time.monotonic(), _thread.get_ident()
        _ledger.touch(self)

    def end(self) -> None:
        with _ledger.lock:
            self.ended += 1
        _ledger.touch(self)


class _Executor:
    """An executor: which nodes it holds, whether it is spun, how many callbacks it ran at once."""

    dirty = False

    def __init__(self, executor: Any) -> None:
        self.number = next(_ledger.numbers)
        self.key = f"executor{self.number}"
        self.executor = weakref.ref(executor)
        self.threads_given: bool | None = None
        self.spins = self.spinning = self.main = self.busy = self.most = 0

    def nodes(self) -> list[Any]:
        executor = self.executor()
        return [] if executor is None else list(executor._nodes)

    def event(self) -> dict[str, Any]:
        executor = self.executor()
        return {
            "e": "executor",
            "id": self.number,
            "type": type(executor).__name__ if executor is not None else "",
            "threads": getattr(getattr(executor, "_executor", None), "_max_workers", None),
            "threads_given": self.threads_given,
            "nodes": sorted(_ledger.known[node].name for node in self.nodes() if node in _ledger.known),
            "spins": self.spins,
            "spinning": self.spinning > 0,
            "main": self.main > 0,
            "busy": self.busy,
            "most": self.most,
        }

    def _mark(self, node: Any) -> None:
        known = _ledger.known.get(node)
        if self.spinning and known is not None:
            known.spun = time.monotonic()
            _ledger.touch(known)

    def step(self, change: int) -> None:
        """A callback came onto a thread of it (1), or left it (-1)."""
        with _ledger.lock:
            self.busy += change
            if self.busy > self.most:
                self.most = self.busy

    def spin(self, change: int, long: bool = False) -> None:
        """Something began to spin it (1), or ended that (-1), or its nodes have changed (0)."""
        with _ledger.lock:
            if long and threading.current_thread() is threading.main_thread():
                self.main += change
            self.spinning += max(change, 0)
            self.spins += change > 0
        for node in self.nodes():
            self._mark(node)
        with _ledger.lock:
            self.spinning += min(change, 0)
        _ledger.touch(self)


class _Node:
    """A node, from the end of `Node.__init__` on."""

    dirty = False

    def __init__(self, node: Any) -> None:
        self.key = f"node{next(_ledger.numbers)}"
        self.node = weakref.ref(node)
        self.name = _node_name(node)
        self.made = time.monotonic()
        self.spun = 0.0
        self.destroyed = False

    def event(self) -> dict[str, Any]:
        node = self.node()
        executor = getattr(node, "executor", None)
        known = executor is None or executor in _ledger.known
        return {
            "e": "node",
            "name": self.name,
            "made": self.made,
            "spun": self.spun,
            "destroyed": self.destroyed,
            "foreign": not known,
        }


class _Parameter:
    """A parameter of a node: declared, read and set how often, and what came last."""

    dirty = False

    def __init__(self, node: str, name: str) -> None:
        self.key = f"parameter{next(_ledger.numbers)}"
        self.node, self.name = node, name
        self.declared = False
        self.gets = self.sets = 0
        self.last_get = self.last_set = 0.0

    def event(self) -> dict[str, Any]:
        return {
            "e": "parameter",
            "node": self.node,
            "name": self.name,
            "declared": self.declared,
            "gets": self.gets,
            "sets": self.sets,
            "last_get": self.last_get,
            "last_set": self.last_set,
        }


_ledger = _Ledger()


def _executor(executor: Any) -> _Executor:
    known: _Executor | None = _ledger.known.get(executor)
    if known is None:
        known = _Executor(executor)
        _ledger.add(known, executor)
        if len(_ledger.executors) < _MOST_EXECUTORS:
            _ledger.executors.append(known)
    return known


# Lines of the student's own files.


def _own_line() -> dict[str, str]:
    """Where in the student's own files this thread is."""
    frame: Any = sys._getframe(1)
    while frame is not None:
        if frame.f_code.co_filename.startswith(_State.folder):
            return _line(frame.f_code.co_filename, frame.f_lineno)
        frame = frame.f_back
    return {"line": "", "code": ""}


def _error_line(error: BaseException) -> dict[str, str]:
    found = {"line": "", "code": ""}
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename.startswith(_State.folder):
            found = _line(trace.tb_frame.f_code.co_filename, trace.tb_lineno)
        trace = trace.tb_next
    return found


def _callback_line(callback: Any) -> dict[str, str]:
    function = inspect.unwrap(getattr(callback, "__func__", callback))
    code = getattr(function, "__code__", None)
    if code is None or not code.co_filename.startswith(_State.folder):
        return {"line": "", "code": ""}
    return _line(code.co_filename, code.co_firstlineno)


def _line(path: str, number: int) -> dict[str, str]:
    return {"line": f"{os.path.basename(path)}:{number}", "code": linecache.getline(path, number).strip()}


def _node_name(node: Any) -> str:
    with _quiet():
        return str(node.get_fully_qualified_name())
    return ""


# Callbacks.


class _Callback:
    """While a callback is on a thread; an error that leaves it is noted."""

    def __init__(self, thing: _Thing, executor: _Executor | None) -> None:
        self.thing, self.executor = thing, executor
        self.before: tuple[_Thing | None, int] = (None, 0)

    def __enter__(self) -> None:
        self.before = _here.callback, _here.depth
        _here.callback, _here.depth = self.thing, 0
        if self.executor is not None:
            self.executor.step(1)

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        _here.callback, _here.depth = self.before
        if self.executor is not None:
            self.executor.step(-1)
        if not isinstance(error, Exception) or isinstance(error, StopIteration):
            return
        with _quiet():
            if type(error).__name__ != "ExternalShutdownException":
                about = self.thing.about
                emit(
                    {"e": "callback_error", "node": about.get("node", ""), "kind": about.get("kind", "")}
                    | {"type": type(error).__name__, "text": str(error), "callback": self.thing.number}
                    | _error_line(error)
                )


class _Steps:
    """Awaits a coroutine callback; between its steps the thread is not inside the callback."""

    def __init__(self, coroutine: Any, run: int, thing: _Thing, executor: _Executor | None) -> None:
        self.coroutine, self.run, self.thing, self.executor = coroutine, run, thing, executor

    def __await__(self) -> Any:
        # rclpy asks a coroutine that awaits again and again, without a pause, so most of these steps must cost little.
        steps, sent, thing, look = self.coroutine.__await__(), None, self.thing, 0.0
        while True:
            try:
                with _Callback(thing, self.executor):
                    wanted = steps.send(sent)
            except StopIteration as end:
                return end.value
            now = time.monotonic()
            if now >= look:
                look = now + _PAUSE
                with _quiet():
                    self._note(now)
            sent = yield wanted

    def _note(self, now: float) -> None:
        thing, found = self.thing, _awaited(self.coroutine)
        if found["line"] != thing.awaits.get("line"):
            thing.awaits = found | {"since": now}
            thing.awaited = found["line"]
            _ledger.touch(thing)


def _awaited(coroutine: Any) -> dict[str, Any]:
    """The student's line that awaits, and the client whose answer it awaits if that is what it awaits."""
    found: dict[str, Any] = {"line": "", "code": "", "client": 0}
    inner = coroutine
    while inner is not None:
        frame = getattr(inner, "cr_frame", None) or getattr(inner, "gi_frame", None)
        if frame is not None and frame.f_code.co_filename.startswith(_State.folder):
            found |= _line(frame.f_code.co_filename, frame.f_lineno)
        following = getattr(inner, "cr_await", None) or getattr(inner, "gi_yieldfrom", None)
        if following is None and frame is not None:
            found["client"] = _State.asked.get(frame.f_locals.get("self"), 0)
        inner = following
    return found


async def _await_or_execute(callback: Any, *args: Any) -> Any:
    """As rclpy's own function of this name, with a note of what goes on."""
    taken, _here.taken = _here.taken, None
    thing, executor = taken or (_other(callback), None)
    run = thing.begin()
    raised = True
    try:
        if inspect.iscoroutinefunction(callback):
            result = await _Steps(callback(*args), run, thing, executor)
        else:
            with _Callback(thing, executor):
                result = callback(*args)
        raised = False
    finally:
        with _quiet():
            thing.awaits = {}
            thing.end(run, raised)
    with _quiet():
        _check_return(callback, thing.about.get("kind", ""), args, result)
    return result


def _other(callback: Any) -> _Thing:
    """A callback of something that rclpy does not let us see: it is not written down, only used on this thread."""
    with _quiet():
        return _Thing({"kind": "action" if callback in _State.expected else "", **_callback_line(callback)})
    return _Thing({"kind": ""})


def _check_return(callback: Any, kind: str, args: tuple[Any, ...], result: Any) -> None:
    if kind == "service" and len(args) == 2:
        expected: Any = type(args[1])
    elif kind == "action":
        expected = _State.expected.get(callback)
    else:
        return
    if isinstance(expected, type) and not isinstance(result, expected):
        _bad_return(kind, callback, result, expected)


def _bad_return(kind: str, callback: Any, result: Any, expected: type) -> None:
    text = f"{type(result).__name__} instead of {expected.__name__}"
    _emit_once({"e": "bad_return", "kind": kind, "text": text.replace("NoneType", "None"), **_callback_line(callback)})


def _checked(kind: str, callback: Callable[..., Any], node: str, expected: type | None) -> Callable[..., Any]:
    """The callback with notes; `expected` is the type that it must return."""
    about = {"kind": kind, "node": node, "name": "", **_callback_line(callback)}
    key = (kind, node, about["line"])
    thing = _ledger.by_line.get(key)
    if thing is None:
        thing = _ledger.by_line[key] = _Thing(about)
        _ledger.add(thing)

    @functools.wraps(callback)
    def call(*args: Any, **kwargs: Any) -> Any:
        run = thing.begin()
        raised = True
        try:
            with _Callback(thing, None):
                result = callback(*args, **kwargs)
            raised = False
        finally:
            with _quiet():
                thing.end(run, raised)
        with _quiet():
            if expected is not None and not isinstance(result, expected):
                _bad_return(kind, callback, result, expected)
        return result

    return call


# Wrapping.


def _wrap(
    owner: Any, name: str, before: Callable[..., Any] | None = None, after: Callable[..., Any] | None = None
) -> None:
    """Replace `owner.name` by itself with a note before it and one after it has returned (its result first)."""
    original = getattr(owner, name)

    @functools.wraps(original)
    def call(*args: Any, **kwargs: Any) -> Any:
        outermost = _here.depth == 0
        _here.depth += 1
        try:
            if before is not None and outermost:
                with _quiet():
                    before(*args, **kwargs)
            result = original(*args, **kwargs)
        finally:
            _here.depth -= 1
        if after is not None:
            with _quiet():
                after(result, *args, **kwargs)
        return result

    setattr(owner, name, call)


def _wrap_blocking(
    owner: Any,
    name: str,
    what: str,
    executor_of: Callable[..., Any] | None = None,
    seen: bool = False,
    long: bool = False,
) -> None:
    """As `_wrap`, for a call that may block.

    `executor_of`: it spins that one; `long`: until the end. `seen`: it is noted outside a callback as well.
    """
    original = getattr(owner, name)

    @functools.wraps(original)
    def call(*args: Any, **kwargs: Any) -> Any:
        noted: _Call | None = None
        spun: _Executor | None = None
        if _here.depth == 0:
            with _quiet():
                if executor_of is not None:
                    spun = _executor(executor_of(*args, **kwargs))
                if seen or _here.callback is not None:
                    noted = _call(what, args[0] if args and executor_of is None else None)
        _here.depth += 1
        try:
            with _quiet():
                if noted is not None:
                    noted.begin()
                if spun is not None:
                    spun.spin(1, long)
            return original(*args, **kwargs)
        finally:
            _here.depth -= 1
            with _quiet():
                if noted is not None:
                    noted.end()
                if spun is not None:
                    spun.spin(-1, long)

    setattr(owner, name, call)


def _call(what: str, target: Any) -> _Call:
    where, thing = _own_line(), None
    with _quiet():
        thing = _ledger.known.get(target)
    number = thing.number if isinstance(thing, _Thing) else 0
    key = (what, number, where["line"], _here.callback.number if _here.callback else 0)
    if key not in _ledger.calls:
        made = _Call(what, number, where, _here.callback)
        _ledger.calls[key] = made
        _ledger.add(made)
    return _ledger.calls[key]


def prepare() -> None:
    """Install the wrappers; done once, in the launcher."""
    import rclpy
    import rclpy.action
    import rclpy.action.client
    import rclpy.action.server
    import rclpy.client
    import rclpy.executors
    import rclpy.lifecycle
    import rclpy.node
    import rclpy.publisher
    import rclpy.service
    import rclpy.timer

    parts = (
        _prepare_node,
        _prepare_things,
        _prepare_executors,
        _prepare_blocking,
        _prepare_callbacks,
        _prepare_messages,
        _prepare_parameters,
        _prepare_actions,
        _prepare_lifecycle,
    )
    for part in parts:
        try:
            part(rclpy)
        except Exception as error:
            _State.failed.append(f"{part.__name__}: {type(error).__name__}: {error}")


def _prepare_node(rclpy: Any) -> None:
    node_class = rclpy.node.Node
    init = node_class.__init__

    @functools.wraps(init)
    def build(self: Any, *args: Any, **kwargs: Any) -> None:
        before, _here.building = _here.building, True
        try:
            init(self, *args, **kwargs)
        finally:
            _here.building = before
        with _quiet():
            _ledger.add(_Node(self), self)

    node_class.__init__ = build

    def destroyed(_result: Any, node: Any, *_args: Any) -> None:
        known = _ledger.known.get(node)
        if known is not None:
            known.destroyed = True
            _ledger.touch(known)

    _wrap(node_class, "destroy_node", after=destroyed)
    executor = node_class.executor

    def set_executor(self: Any, value: Any) -> None:
        executor.fset(self, value)
        with _quiet():
            _ledger.touch(_ledger.known[self])

    node_class.executor = executor.setter(set_executor)


def _prepare_things(rclpy: Any) -> None:
    node_class = rclpy.node.Node
    for method, kind, name_of in (
        ("create_timer", "timer", lambda entity, node: ""),
        ("create_subscription", "subscription", lambda entity, node: entity.topic_name),
        ("create_publisher", "publisher", lambda entity, node: entity.topic_name),
        ("create_service", "service", lambda entity, node: node.resolve_service_name(entity.srv_name)),
        ("create_client", "client", lambda entity, node: node.resolve_service_name(entity.srv_name)),
    ):
        _wrap(node_class, method, after=_thing_made(kind, name_of))

    def becomes(**values: Any) -> Callable[..., None]:
        def note(_result: Any, *args: Any) -> None:
            for entity in args:
                thing = _ledger.known.get(entity)
                if isinstance(thing, _Thing):
                    thing.about |= values
                    _ledger.touch(thing)

        return note

    for kind in ("timer", "subscription", "publisher", "service", "client"):
        _wrap(node_class, f"destroy_{kind}", after=becomes(destroyed=True))
    _wrap(rclpy.timer.Timer, "cancel", after=becomes(cancelled=True))
    _wrap(rclpy.timer.Timer, "reset", after=becomes(cancelled=False))


def _thing_made(kind: str, name_of: Callable[[Any, Any], str]) -> Callable[..., None]:
    given_as = "srv_name" if kind in ("service", "client") else "topic"

    def note(entity: Any, node: Any, *args: Any, **kwargs: Any) -> None:
        if _here.building:
            return
        group = getattr(entity, "callback_group", None)
        if group is not None and group is getattr(node, "_rate_group", None):
            return  # the timer below a Rate
        about: dict[str, Any] = {"kind": kind, "name": "", "given": "", "node": _node_name(node)}
        about |= {"made": _own_line()["line"], **_callback_line(getattr(entity, "callback", None))}
        with _quiet():
            about["name"] = name_of(entity, node)
        if kind != "timer":
            given = kwargs.get(given_as, args[1] if len(args) > 1 else "")
            about["given"] = given if isinstance(given, str) else ""
        if group is not None and kind != "publisher":
            about |= {
                "group": type(group).__name__,
                "group_id": id(group),
                "default_group": group is node.default_callback_group,
            }
        if kind == "timer":
            about["period"] = entity.timer_period_ns / 1e9
        _ledger.add(_Thing(about), entity)

    return note


def _prepare_executors(rclpy: Any) -> None:
    base = rclpy.executors.Executor

    def made(_result: None, executor: Any, *_args: Any, **_kwargs: Any) -> None:
        _executor(executor)

    def made_with_threads(_result: None, executor: Any, num_threads: int | None = None, **_kwargs: Any) -> None:
        _executor(executor).threads_given = num_threads is not None
        _ledger.touch(_executor(executor))

    def nodes_changed(_result: Any, executor: Any, *_args: Any) -> None:
        _executor(executor).spin(0)

    def itself(executor: Any, *_args: Any, **_kwargs: Any) -> Any:
        return executor

    def given(_node: Any, *args: Any, **kwargs: Any) -> Any:
        found = kwargs.get("executor")
        for value in args:
            found = value if isinstance(value, base) else found
        return rclpy.get_global_executor() if found is None else found

    _wrap(base, "__init__", after=made)
    _wrap(rclpy.executors.MultiThreadedExecutor, "__init__", after=made_with_threads)
    _wrap(base, "add_node", after=nodes_changed)
    _wrap(base, "remove_node", after=nodes_changed)
    for name in ("SingleThreadedExecutor", "MultiThreadedExecutor"):
        _wrap_blocking(getattr(rclpy.executors, name), "spin_once", "spin", itself)
    _wrap_blocking(base, "spin", "spin", itself, long=True)
    _wrap_blocking(base, "spin_until_future_complete", "spin", itself)
    for name in ("spin", "spin_once", "spin_until_future_complete"):
        _wrap_blocking(rclpy, name, "spin", given, long=name == "spin")
    for name in ("_take_timer", "_take_subscription", "_take_service"):
        _wrap_take(base, name)
    take_answer = base._take_client

    @functools.wraps(take_answer)
    def taken(self: Any, client: Any) -> Any:
        result = take_answer(self, client)
        with _quiet():
            thing = _ledger.known.get(client)
            if thing is not None and result is not None:
                thing.done += 1
                _ledger.touch(thing)
        return result

    base._take_client = taken


def _wrap_take(base: Any, name: str) -> None:
    """Let the callback that rclpy takes off its wait set be known by the thing it belongs to."""
    original = getattr(base, name)

    @functools.wraps(original)
    def take(self: Any, entity: Any) -> Any:
        execute = original(self, entity)
        thing = None
        with _quiet():
            thing = _ledger.known.get(entity)
        if execute is None or thing is None:
            return execute

        async def noted() -> None:
            _here.taken = (thing, _ledger.known.get(self))
            try:
                await execute()
            finally:
                _here.taken = None

        return noted

    setattr(base, name, take)


def _prepare_blocking(rclpy: Any) -> None:
    _wrap_blocking(rclpy.client.Client, "call", "client.call", seen=True)
    _wrap_blocking(rclpy.client.Client, "wait_for_service", "wait_for_service", seen=True)
    _wrap_blocking(rclpy.action.ActionClient, "send_goal", "action_client.send_goal", seen=True)
    _wrap_blocking(rclpy.timer.Rate, "sleep", "rate.sleep", seen=True)
    _wrap_blocking(rclpy, "shutdown", "shutdown")
    _wrap_blocking(rclpy, "try_shutdown", "shutdown")
    _wrap_blocking(rclpy.executors.Executor, "shutdown", "shutdown")

    def asked(future: Any, client: Any, *_args: Any) -> None:
        thing = _ledger.known.get(client)
        if thing is not None:
            _State.asked[future] = thing.number
            thing.count()

    _wrap(rclpy.client.Client, "call_async", after=asked)


def _prepare_callbacks(rclpy: Any) -> None:
    for module in (rclpy.executors, rclpy.action.server, rclpy.action.client):
        if not hasattr(module, "await_or_execute"):
            raise AttributeError(f"{module.__name__}.await_or_execute")
        module.await_or_execute = _await_or_execute

    create_task = rclpy.executors.Executor.create_task

    @functools.wraps(create_task)
    def create_noted(self: Any, callback: Any, *args: Any, **kwargs: Any) -> Any:
        with _quiet():
            if _callback_line(callback)["line"] and not inspect.iscoroutinefunction(callback):
                callback = _checked("task", callback, "", None)
        return create_task(self, callback, *args, **kwargs)

    rclpy.executors.Executor.create_task = create_noted


def _note_thread_errors() -> None:
    """Note what ends a thread of the program's own."""
    before = threading.excepthook

    def hook(args: Any) -> None:
        with _quiet():
            if args.exc_value is not None and type(args.exc_value).__name__ != "ExternalShutdownException":
                error = args.exc_value
                emit({"e": "thread_error", "type": type(error).__name__, "text": str(error)} | _error_line(error))
        before(args)

    threading.excepthook = hook


def _prepare_messages(rclpy: Any) -> None:
    """Count what is published; say which field is wrong when a message cannot be sent."""
    publish = rclpy.publisher.Publisher.publish

    @functools.wraps(publish)
    def publish_noted(self: Any, msg: Any) -> None:
        try:
            publish(self, msg)
        except Exception:
            with _quiet():
                _note_misfit("message", self.topic_name, msg, self.msg_type)
            raise
        with _quiet():
            thing = _ledger.known.get(self)
            if thing is not None:
                thing.count()

    rclpy.publisher.Publisher.publish = publish_noted

    respond = rclpy.service.Service.send_response

    @functools.wraps(respond)
    def respond_noted(self: Any, response: Any, header: Any) -> None:
        try:
            respond(self, response, header)
        except Exception:
            with _quiet():
                _note_misfit("response", self.srv_name, response, self.srv_type.Response)
            raise

    rclpy.service.Service.send_response = respond_noted

    ask = rclpy.client.Client.call_async

    @functools.wraps(ask)
    def ask_noted(self: Any, request: Any) -> Any:
        try:
            return ask(self, request)
        except Exception:
            with _quiet():
                _note_misfit("request", self.srv_name, request, self.srv_type.Request)
            raise

    rclpy.client.Client.call_async = ask_noted


def _note_misfit(kind: str, name: str, message: Any, expected: type) -> None:
    if isinstance(message, expected):
        found = _misfit(message, "")
    else:
        found = ("", f"{expected.__module__.split('.')[0]} {expected.__name__}", message)
    if found is not None:
        field, wanted, value = found
        _emit_once(
            {"e": "bad_message", "kind": kind, "name": name, "field": field, "expected": wanted}
            | {"given": type(value).__name__, "value": repr(value)[:80], **_own_line()}
        )


def _misfit(message: Any, path: str) -> tuple[str, str, Any] | None:
    """The first field whose value is not of its type: its path, the type, the value."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            found = _misfit(value, f"{path}{name}.")
            if found is not None:
                return found
        elif not _fits(value, kind):
            return f"{path}{name}", kind, value
    return None


_RANGES = {f"{sign}int{bits}": (bits, sign == "") for sign in ("", "u") for bits in (8, 16, 32, 64)}


def _fits(value: Any, kind: str) -> bool:
    if kind.startswith("sequence<") or "[" in kind:
        return hasattr(value, "__len__") and not isinstance(value, str)
    if kind in _RANGES:
        bits, signed = _RANGES[kind]
        low = -(1 << (bits - 1)) if signed else 0
        return isinstance(value, int) and low <= value < low + (1 << bits)
    if kind.startswith(("string", "wstring")):
        return isinstance(value, str)
    if kind in ("float", "double"):
        return isinstance(value, float)
    if kind == "boolean":
        return isinstance(value, bool)
    if kind == "octet":
        return isinstance(value, bytes)
    return "/" not in kind


def _prepare_parameters(rclpy: Any) -> None:
    node_class = rclpy.node.Node
    add, remove = node_class.add_on_set_parameters_callback, node_class.remove_on_set_parameters_callback
    wrapped: dict[Any, Any] = {}

    @functools.wraps(add)
    def add_noted(self: Any, callback: Any) -> None:
        with _quiet():
            from rcl_interfaces.msg import SetParametersResult

            if not _here.building and callable(callback):
                noted = _checked("parameter", callback, _node_name(self), SetParametersResult)
                wrapped[(id(self), callback)] = noted
                callback = noted
        add(self, callback)

    @functools.wraps(remove)
    def remove_noted(self: Any, callback: Any) -> None:
        with _quiet():
            callback = wrapped.pop((id(self), callback), callback)
        remove(self, callback)

    node_class.add_on_set_parameters_callback = add_noted
    node_class.remove_on_set_parameters_callback = remove_noted

    known: dict[tuple[int, str], _Parameter] = {}

    def parameter(node: Any, name: str) -> _Parameter:
        key = (id(node), name)
        if key not in known:
            known[key] = _Parameter(_node_name(node), name)
            _ledger.add(known[key])
        return known[key]

    def declared(_result: Any, node: Any, name: Any, *_args: Any, **_kwargs: Any) -> None:
        if not _here.building and isinstance(name, str):
            parameter(node, name).declared = True
            _ledger.touch(parameter(node, name))

    def got(_result: Any, node: Any, name: Any, *_args: Any) -> None:
        if not _here.building and isinstance(name, str):
            found = parameter(node, name)
            found.gets, found.last_get = found.gets + 1, time.monotonic()
            _ledger.touch(found)

    def was_set(result: Any, node: Any, parameters: Any, *_args: Any) -> None:
        if not _here.building and getattr(result, "successful", False):
            for one in parameters:
                found = parameter(node, one.name)
                found.sets, found.last_set = found.sets + 1, time.monotonic()
                _ledger.touch(found)

    _wrap(node_class, "declare_parameter", after=declared)
    _wrap(node_class, "get_parameter", after=got)
    _wrap(node_class, "_set_parameters_atomically", after=was_set)


def _prepare_actions(rclpy: Any) -> None:
    def action_server_made(_: None, server: Any, node: Any, action_type: Any, *args: Any, **_kwargs: Any) -> None:
        name = str(args[0]) if args else ""
        _ledger.add(_Thing({"kind": "action_server", "name": name, "given": name, "node": _node_name(node)}), server)
        for callback, expected in (
            (server._execute_callback, action_type.Result),
            (server._goal_callback, rclpy.action.GoalResponse),
            (server._cancel_callback, rclpy.action.CancelResponse),
        ):
            _State.expected[callback] = expected

    _wrap(rclpy.action.ActionServer, "__init__", after=action_server_made)


def _prepare_lifecycle(rclpy: Any) -> None:
    from rclpy.lifecycle import LifecycleNodeMixin, LifecyclePublisher, TransitionCallbackReturn

    register = LifecycleNodeMixin._LifecycleNodeMixin__register_callback

    @functools.wraps(register)
    def register_noted(self: Any, state_id: int, callback: Any) -> Any:
        with _quiet():
            callback = _checked("lifecycle", callback, _node_name(self), TransitionCallbackReturn)
        return register(self, state_id, callback)

    LifecycleNodeMixin._LifecycleNodeMixin__register_callback = register_noted

    def made(publisher: Any, node: Any, *_args: Any, **_kwargs: Any) -> None:
        _State.owners[publisher] = node

    def note_off(publisher: Any, *_args: Any, **_kwargs: Any) -> None:
        if not publisher.is_activated:
            node = _State.owners.get(publisher)
            state = node._state_machine.current_state[1] if node is not None else ""
            _emit_once({"e": "lifecycle_publish_off", "name": publisher.topic_name, "state": state, **_own_line()})

    _wrap(LifecycleNodeMixin, "create_lifecycle_publisher", after=made)
    _wrap(LifecyclePublisher, "publish", before=note_off)
