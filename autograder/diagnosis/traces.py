"""Finds the error that a program printed, with the student's own line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from autograder.reasons import Group, Kind, Reason

CRASHED = Kind("crashed", "the program ended with an error that it printed, or by a signal", Group.PROGRAM)
SYNTAX_ERROR = Kind(
    "syntax-error", "Python printed a SyntaxError, IndentationError or TabError and the program ended", Group.PROGRAM
)
PARAMETER_NOT_DECLARED = Kind("parameter-not-declared", "the error is a ParameterNotDeclaredException", Group.PROGRAM)
PARAMETER_TYPE = Kind("parameter-type", "the error is an InvalidParameterTypeException", Group.PROGRAM)
REFUSED_CALL = Kind("refused-call", "the error is the system's refusal of a call", Group.PROGRAM)
BUILTIN_CALLBACK = Kind(
    "builtin-callback", "rclpy found no signature of a callback, which is a function written in C", Group.PROGRAM
)
NOT_COPIED = Kind(
    "not-copied",
    "the error says that an object of rclpy cannot be pickled, which is how deepcopy copies",
    Group.PROGRAM,
)
USED_AFTER_DESTROY = Kind("used-after-destroy", "the error says that something destroyed was used", Group.PROGRAM)

_WITHOUT_SETTER = (
    "clients",
    "context",
    "default_callback_group",
    "guards",
    "publishers",
    "services",
    "subscriptions",
    "timers",
    "waitables",
)
"""The properties of rclpy's `Node` that cannot be set (`node.py` of rclpy 7.1)."""

KNOWN_ERRORS = (
    (
        "add_entity() missing 1 required positional argument",
        CRASHED,
        "A callback group is an object: it is made with brackets, `ReentrantCallbackGroup()`, and then handed over.",
    ),
    (
        "handle cannot be modified after node creation",
        CRASHED,
        "`handle` is an attribute of rclpy's own `Node`: give yours another name, such as `self.goal_handle`.",
    ),
    (
        "'method' object does not support the context manager protocol",
        CRASHED,
        "If the line of rclpy's own is `with self.handle:`, a method of yours is called `handle`. That is an attribute "
        "of rclpy's own `Node`: give yours another name.",
    ),
    *(
        (
            f"property '{name}' of '",  # the name of the class follows, which can be any
            CRASHED,
            f"rclpy's own `Node` has a property `{name}`, which cannot be set. In a class that inherits from `Node`, "
            f"an attribute needs another name, such as `self.my_{name}`.",
        )
        for name in _WITHOUT_SETTER
    ),
    (
        "property 'status' of 'ServerGoalHandle' object has no setter",
        CRASHED,
        "A call in the execute callback sets the status of the goal: `goal_handle.succeed()`, `goal_handle.abort()` "
        "or `goal_handle.canceled()`.",
    ),
    (
        "ModuleNotFoundError",
        CRASHED,
        "Python finds no module of this name. Is the name right? The code of a package of yours is only installed if "
        "`packages` in its setup.py names the folder.",
    ),
    (
        "EOF when reading a line",
        CRASHED,
        "A node that a launch starts has no keyboard, so `input()` finds nothing to read. Give it values as "
        "parameters, or by a topic or a service.",
    ),
    (
        "'NoneType' object does not support the context manager protocol",
        CRASHED,
        "`with` was given None. In ROS 2 Jazzy, `rclpy.init()` returns None: call it in a line of its own, and "
        "`rclpy.try_shutdown()` at the end.",
    ),
    (
        "Logger severity cannot be changed between calls",
        CRASHED,
        "rclpy allows only one log level for each place in the code. Use `if` and `else`, with a separate call of "
        "`info` and of `warning`.",
    ),
    (
        "generator already executing",
        CRASHED,
        "If a `spin` raised it: two threads spin one executor. Every `rclpy.spin(node)` uses the same one of the "
        "process. Add all nodes to one executor and spin that, or make an executor for each thread.",
    ),
    (
        "coroutine raised StopIteration",
        CRASHED,
        "A callback raised StopIteration, itself or through a `next()` that found no further element. rclpy runs "
        "callbacks in a coroutine, in which Python turns StopIteration into a RuntimeError. Raise another error, or "
        "catch this one.",
    ),
    *(
        (
            f"'{number}' object has no attribute 'add_node'",
            CRASHED,
            "In this place rclpy expects an executor. A time is given by its name: `timeout_sec=…`.",
        )
        for number in ("float", "int")
    ),
    (
        "ParameterNotDeclaredException",
        PARAMETER_NOT_DECLARED,
        "A parameter exists from `declare_parameter` on: declare it before you read it, even if a value was given.",
    ),
    (
        "expecting type 'BYTE_ARRAY'",
        PARAMETER_TYPE,
        "An empty list as the default is a list of bytes for rclpy. Give the type in its place, as in "
        '`declare_parameter("names", rclpy.Parameter.Type.STRING_ARRAY)`, or a list that is not empty.',
    ),
    (
        "InvalidParameterTypeException",
        PARAMETER_TYPE,
        "The given value and the declared default must have one type: 40 is an integer, 40.0 a double, '40' a string. "
        "If the value that is given is right, declare a default of its type.",
    ),
    (
        "PermissionError: [Errno 1]",
        REFUSED_CALL,
        "The sandbox does not allow this system call. For example, a program may not start new processes (`fork`, "
        "`subprocess`, `multiprocessing`). Use threads, or another program in the launch.",
    ),
    (
        "no signature found for builtin",
        BUILTIN_CALLBACK,
        "rclpy looks at the parameters of a callback. Some of Python's own functions, such as the `append` of a deque, "
        "do not tell theirs: put the call into a `def` or a `lambda` of your own.",
    ),
    (
        "'NoneType' object is not callable",
        CRASHED,
        "This line calls None. Pass a callback without brackets: with brackets it is called immediately, and its "
        "return value, which is often None, is passed.",
    ),
    (
        "cannot pickle 'rclpy.",
        NOT_COPIED,
        "`deepcopy` cannot copy what rclpy keeps in C++, such as the durations in a QoS profile. `copy.copy(profile)` "
        "makes a second profile whose policies can be set without a change to the first.",
    ),
    (
        "InvalidHandle",
        USED_AFTER_DESTROY,
        "The program used an object that had been destroyed. Let the node destroy what it created, for example with "
        "`self.destroy_publisher(…)`. If you call the object's own `destroy()`, it stays in the node's list, and "
        "`spin` still uses it. A MultiThreadedExecutor sometimes uses an object while a callback destroys it (rclpy "
        "issue 1355), so spin such a node with a SingleThreadedExecutor.",
    ),
    (
        "timer argument is null",
        USED_AFTER_DESTROY,
        "A MultiThreadedExecutor asked a timer that a callback had just destroyed (rclpy issue 1355): spin a node that "
        "destroys its timers with a SingleThreadedExecutor, or use `cancel()` and `reset()`.",
    ),
)

_KIND = re.compile(r"[A-Za-z_][\w.]*(Error|Exception|Interrupt|Exit|Warning|Shutdown\w*)\b")
"""The beginning of a line that reports an error, according to the usual names of errors."""


def quoted(code: str, error: str) -> str:
    """Return the student's line in brackets, or an empty text if the line contains the name of the error anyway."""
    kind = error.partition(":")[0].rpartition(".")[2]
    return f" (`{code}`)" if code and kind not in code else ""


def last_traceback(output: str, program: str) -> Reason | None:
    """Return the last error that a Python program printed.

    Must have seen: a line that is an error because of its name or because of the frames above it.
    """
    lines = output.splitlines()
    error_at = None
    for number in range(len(lines) - 1, -1, -1):
        if _KIND.match(lines[number]) or _under_frames(lines, number):
            error_at = number
            break
    if error_at is None:
        return None
    error = lines[error_at].strip()
    if error.endswith(":") and lines[error_at + 1 :]:  # rclpy prints an invalid name in a line of its own
        error += f" {lines[error_at + 1].strip()}"
    where, code = _own_line(lines[:error_at], program)
    said = f"{where}{quoted(code, error)}: {error}"
    for exception, kind, hint in KNOWN_ERRORS:
        if exception in error:
            return kind(f"`{program}` ended with an error{said}", hint)
    if error.startswith(("SyntaxError", "IndentationError", "TabError")):
        return SYNTAX_ERROR(
            f"`{program}` is not a Python program{said}",
            "Python stops reading at this line or before.",
        )
    return CRASHED(
        f"`{program}` ended with an error{said}",
        "The lines above it in the log say how it got there.",
    )


def _own_line(lines: Sequence[str], program: str) -> tuple[str, str]:
    """Return the last line of the student's file in the frames above an error: where it is, and its code."""
    for number in range(len(lines) - 1, -1, -1):
        match = re.match(rf'\s+File "[^"]*\b{re.escape(program)}\.py", line (\d+)', lines[number])
        if match:
            code = lines[number + 1].strip() if number + 1 < len(lines) else ""
            return f" in line {match[1]}", code
        if lines[number].startswith("Traceback"):
            break
    return "", ""


def _under_frames(lines: Sequence[str], number: int) -> bool:
    """Whether this line is an error with any name, because it is below the frames of a traceback."""
    if not re.match(r"[A-Za-z_][\w.]*(: |$)", lines[number]):
        return False
    while number > 0 and lines[number - 1].startswith("    "):
        number -= 1
    return number > 0 and lines[number - 1].startswith('  File "')
