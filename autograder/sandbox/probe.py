"""Notes what a program does with rclpy, as JSON lines: for hints only, never for points; a program can forge them.

It runs inside the student's process and must never change what the program does, or end it. So every note is made in
a `_quiet` block, the wrapped function is called with its own arguments, and what it returns or raises goes on as it is.
Wrappers are installed once, in the launcher; a forked program only says where to write.
"""

import contextlib
import functools
import inspect
import json
import linecache
import os
import sys
import threading
import weakref
from collections.abc import Callable
from typing import Any

_MOST = 500
"""Notes of one program; what it repeats is noted once."""


class _Here(threading.local):
    """What this thread is doing."""

    in_callback = False
    depth = 0
    """How many noted calls of rclpy are on the stack since the innermost callback began: rclpy calls itself."""
    building = False
    """Inside `Node.__init__`: what is made there is rclpy's own."""


class _State:
    fd = -1
    folder = "\0"
    left = _MOST
    spinning = 0
    spun: set[str] = set()  # noqa: RUF012
    once: set[tuple[str, ...]] = set()  # noqa: RUF012
    kinds: dict[Any, Any] = {}  # noqa: RUF012
    """Callback -> what kind of callback it is, and of which node."""
    owners: "weakref.WeakKeyDictionary[Any, Any]" = weakref.WeakKeyDictionary()  # noqa: RUF012
    """Lifecycle publisher -> node."""


_here = _Here()
_quiet = functools.partial(contextlib.suppress, Exception)


def emit(event: dict[str, Any]) -> None:
    """Write one event, or drop it: a full pipe must not hold up the program."""
    if _State.fd < 0 or _State.left <= 0:
        return
    _State.left -= 1
    with _quiet():
        for key, value in event.items():
            if isinstance(value, str):
                event[key] = value[:500]
        os.write(_State.fd, json.dumps(event).encode()[:4000] + b"\n")


def _emit_once(event: dict[str, Any]) -> None:
    key = tuple(str(value) for value in event.values())
    if key not in _State.once:
        _State.once.add(key)
        emit(event)


def install(fd: int, folder: str) -> None:
    """Begin to write to `fd`; the program's own lines are those of files in `folder`."""
    _State.fd, _State.folder = fd, folder.rstrip("/") + "/"


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


# Callbacks.


def _know(callback: Any, kind: str, node: Any) -> None:
    with _quiet():
        if callback is not None:
            _State.kinds[callback] = (kind, _node_name(node))


def _node_name(node: Any) -> str:
    with _quiet():
        return str(node.get_fully_qualified_name())
    return ""


class _Callback:
    """While a callback runs; an error that leaves it is noted."""

    def __init__(self, kind: str, node: str) -> None:
        self.kind, self.node = kind, node
        self.before = (False, 0)

    def __enter__(self) -> None:
        self.before = _here.in_callback, _here.depth
        _here.in_callback, _here.depth = True, 0

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        _here.in_callback, _here.depth = self.before
        if not isinstance(error, Exception) or isinstance(error, StopIteration):
            return
        with _quiet():
            if type(error).__name__ != "ExternalShutdownException":
                emit(
                    {"e": "callback_error", "node": self.node, "kind": self.kind, "type": type(error).__name__}
                    | {"text": str(error)}
                    | _error_line(error)
                )


class _Steps:
    """Awaits a coroutine callback; between its steps the thread is not inside the callback."""

    def __init__(self, coroutine: Any, kind: str, node: str) -> None:
        self.steps, self.kind, self.node = coroutine.__await__(), kind, node

    def __await__(self) -> Any:
        sent = None
        while True:
            try:
                with _Callback(self.kind, self.node):
                    wanted = self.steps.send(sent)
            except StopIteration as end:
                return end.value
            sent = yield wanted


async def _await_or_execute(callback: Any, *args: Any) -> Any:
    """As rclpy's own function of this name, with a note of what goes wrong."""
    kind, node = "", ""
    with _quiet():
        kind, node = _State.kinds.get(callback, ("", ""))
    if inspect.iscoroutinefunction(callback):
        result = await _Steps(callback(*args), kind, node)
    else:
        with _Callback(kind, node):
            result = callback(*args)
    with _quiet():
        _check_return(callback, kind, args, result)
    return result


def _check_return(callback: Any, kind: str, args: tuple[Any, ...], result: Any) -> None:
    if kind == "service" and len(args) == 2:
        expected: Any = type(args[1])
    elif kind == "action":
        expected = _State.kinds.get(("result", callback))
    else:
        return
    if isinstance(expected, type) and not isinstance(result, expected):
        _bad_return(kind, callback, result, expected)


def _bad_return(kind: str, callback: Any, result: Any, expected: type) -> None:
    text = f"{type(result).__name__} instead of {expected.__name__}"
    _emit_once({"e": "bad_return", "kind": kind, "text": text.replace("NoneType", "None"), **_callback_line(callback)})


def _checked(kind: str, callback: Callable[..., Any], node: str, expected: type) -> Callable[..., Any]:
    @functools.wraps(callback)
    def call(*args: Any, **kwargs: Any) -> Any:
        with _Callback(kind, node):
            result = callback(*args, **kwargs)
        with _quiet():
            if not isinstance(result, expected):
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


def _wrap_spin(owner: Any, name: str, what: str, executor_of: Callable[..., str], long: bool) -> None:
    """As `_wrap`, for what spins. `long`: it goes on until the end, so that its begin and end are each noted."""
    original = getattr(owner, name)

    @functools.wraps(original)
    def call(*args: Any, **kwargs: Any) -> Any:
        outermost = _here.depth == 0
        noted = False
        if outermost:
            with _quiet():
                if _here.in_callback:
                    _emit_once({"e": "in_callback", "what": what, **_own_line()})
                executor = executor_of(*args, **kwargs)
                if long or executor not in _State.spun:
                    _State.spun.add(executor)
                    emit({"e": "spin", "executor": executor})
                    noted = long
        _here.depth += 1
        _State.spinning += 1
        try:
            return original(*args, **kwargs)
        finally:
            _State.spinning -= 1
            _here.depth -= 1
            if noted:
                emit({"e": "spin_end"})

    setattr(owner, name, call)


def _in_callback(what: str) -> Callable[..., None]:
    def note(*_args: Any, **_kwargs: Any) -> None:
        if _here.in_callback:
            _emit_once({"e": "in_callback", "what": what, **_own_line()})

    return note


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
    import rclpy.timer

    for part in (_prepare_node, _prepare_executors, _prepare_blocking, _prepare_callbacks, _prepare_lifecycle):
        with _quiet():
            part(rclpy)


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
            emit({"e": "node", "name": self.get_name(), "namespace": self.get_namespace()})

    node_class.__init__ = build
    for method, kind, name_of in (
        ("create_timer", "timer", lambda entity, node: ""),
        ("create_subscription", "subscription", lambda entity, node: entity.topic_name),
        ("create_publisher", "publisher", lambda entity, node: entity.topic_name),
        ("create_service", "service", lambda entity, node: node.resolve_service_name(entity.srv_name)),
        ("create_client", "client", lambda entity, node: node.resolve_service_name(entity.srv_name)),
    ):
        _wrap(node_class, method, after=_entity_note(kind, name_of))


def _entity_note(kind: str, name_of: Callable[[Any, Any], str]) -> Callable[..., None]:
    def note(entity: Any, node: Any, *_args: Any, **_kwargs: Any) -> None:
        if _here.building:
            return
        group = getattr(entity, "callback_group", None)
        if group is not None and group is getattr(node, "_rate_group", None):
            return  # the timer below a Rate
        event: dict[str, Any] = {"e": "entity", "kind": kind, "name": "", "node": _node_name(node)}
        with _quiet():
            event["name"] = name_of(entity, node)
        if group is not None and kind != "publisher":
            event |= {
                "group": type(group).__name__,
                "group_id": id(group),
                "default_group": group is node.default_callback_group,
            }
        if kind == "timer":
            event["period"] = entity.timer_period_ns / 1e9
        emit(event)
        _know(getattr(entity, "callback", None), kind, node)

    return note


def _prepare_executors(rclpy: Any) -> None:
    def made(_result: None, executor: Any, num_threads: int | None = None, **_kwargs: Any) -> None:
        threads = getattr(getattr(executor, "_executor", None), "_max_workers", None)
        emit(
            {"e": "executor", "type": type(executor).__name__, "threads": threads}
            | {"threads_given": num_threads is not None}
        )

    def kind(executor: Any, *_args: Any, **_kwargs: Any) -> str:
        return type(executor).__name__

    def kind_given(_node: Any, *args: Any, **kwargs: Any) -> str:
        given = kwargs.get("executor")
        for value in args:
            given = value if isinstance(value, rclpy.executors.Executor) else given
        return "SingleThreadedExecutor" if given is None else type(given).__name__

    for name in ("SingleThreadedExecutor", "MultiThreadedExecutor"):
        executor = getattr(rclpy.executors, name)
        _wrap(executor, "__init__", after=made)
        _wrap_spin(executor, "spin_once", "spin_once", kind, long=False)
    _wrap_spin(rclpy.executors.Executor, "spin", "spin", kind, long=True)
    _wrap_spin(rclpy.executors.Executor, "spin_until_future_complete", "spin_until_future_complete", kind, long=False)
    _wrap_spin(rclpy, "spin", "spin", kind_given, long=True)
    _wrap_spin(rclpy, "spin_once", "spin_once", kind_given, long=False)
    _wrap_spin(rclpy, "spin_until_future_complete", "spin_until_future_complete", kind_given, long=False)


def _prepare_blocking(rclpy: Any) -> None:
    _wrap(rclpy.client.Client, "call", before=_in_callback("client.call"))
    _wrap(rclpy.action.ActionClient, "send_goal", before=_in_callback("action_client.send_goal"))
    _wrap(rclpy, "shutdown", before=_in_callback("rclpy.shutdown"))
    _wrap(rclpy, "try_shutdown", before=_in_callback("rclpy.shutdown"))
    _wrap(rclpy.executors.Executor, "shutdown", before=_in_callback("executor.shutdown"))
    _wrap(rclpy.timer.Rate, "sleep", before=_note_sleep)


def _note_sleep(*_args: Any, **_kwargs: Any) -> None:
    where = _own_line()
    if _here.in_callback:
        _emit_once({"e": "in_callback", "what": "rate.sleep", **where})
        return

    def note() -> None:
        if not _State.spinning:
            _emit_once({"e": "rate_sleep_unspun", **where})

    if _State.spinning or ("rate_sleep_unspun", where["line"]) in _State.once:
        return
    _State.once.add(("rate_sleep_unspun", where["line"]))
    if threading.active_count() == 1:
        note()
    else:  # a thread that was just started to spin may not have come to it yet
        later = threading.Timer(0.5, note)
        later.daemon = True
        later.start()


def _prepare_callbacks(rclpy: Any) -> None:
    for module in (rclpy.executors, rclpy.action.server, rclpy.action.client):
        module.await_or_execute = _await_or_execute

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

    def action_server_made(_: None, server: Any, node: Any, action_type: Any, *args: Any, **_kwargs: Any) -> None:
        emit({"e": "entity", "kind": "action_server", "name": str(args[0]) if args else "", "node": _node_name(node)})
        for callback, expected in (
            (server._execute_callback, action_type.Result),
            (server._goal_callback, rclpy.action.GoalResponse),
            (server._cancel_callback, rclpy.action.CancelResponse),
        ):
            _know(callback, "action", node)
            _State.kinds[("result", callback)] = expected

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
