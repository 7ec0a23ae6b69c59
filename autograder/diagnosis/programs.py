"""Link one of every chain: is every program there, and alive?"""

from __future__ import annotations

import re
import signal

from autograder.arguments import params_file, remap_rules
from autograder.core.processes import no_threads
from autograder.diagnosis import callbacks
from autograder.diagnosis.callbacks import MESSAGE_FIELD
from autograder.diagnosis.inside import Inside
from autograder.diagnosis.scene import Scene
from autograder.diagnosis.spinning import NOT_SPINNING, SHUT_DOWN_IN_MAIN, SHUTDOWN_IN_CALLBACK
from autograder.diagnosis.traces import CRASHED, last_traceback
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.limits import MIB, Limits

EXITED = Kind("exited", "the program ended by itself, and printed no error", Group.PROGRAM)
PROGRAM_MISSING = Kind("program-missing", "no cell defines a program of the launch", Group.PROGRAM)
MEMORY_LIMIT = Kind("memory-limit", "the programs of a launch held more memory than they may together", Group.LIMITS)
PROCESS_LIMIT = Kind(
    "process-limit", "the programs of a launch had more processes and threads than they may together", Group.LIMITS
)

_WRONG_FIELD = re.compile(
    r"(\w{1,100}?)__(?:msg|srv|action)__\w{1,100}convert_from_py.{0,200}Assertion `Py(\w{1,9})_Check"
)
"""What the C code of an interface prints when a field does not hold what it should."""
_NO_THREAD = re.compile(r"Resource temporarily unavailable|can't start new thread|std::system_error")
"""What Python, or the middleware's C++, prints when the system starts no thread for it."""
_LIMITS = {"memory limit": MEMORY_LIMIT, "process limit": PROCESS_LIMIT}
_KINDS = {"Long": "int", "Float": "float", "Bool": "bool", "Unicode": "str"}


def program_trouble(scene: Scene) -> Reason | None:
    """Must have seen: a program that no cell defines, that could not be started, or that has ended."""
    for name in scene.missing:
        return PROGRAM_MISSING(
            f"There is no program `{name}`: no cell that begins with `%%node {name}` was found.",
            f"Check the first line of the cell: it must be exactly `%%node {name}`. In a notebook, run this cell "
            "before the check.",
        )
    for trouble in scene.trouble:
        return trouble
    for number, program in enumerate(scene.programs):
        if program.running() or program in scene.stopped:
            continue
        refused = remap_rules.refused(scene.rules[number]) if number < len(scene.rules) else None
        if refused and ("arse remap rule" in program.output() or "invalid node namespace" in program.output()):
            return refused
        unread = params_file.why_refused(program.output(), scene.folder)
        return unread or _death(scene.inside(program))
    return None


def _death(inside: Inside) -> Reason:
    """Why a program has ended.

    Raises:
        KitError: the machine is the reason.
    """
    program = inside.program
    limit = program.stopped_by()
    if limit:
        return _LIMITS[limit](
            f"`{program.name}` was stopped because it exceeded the {limit}.",
            "Look for a loop that never ends, or for data that grows without a limit.",
        )
    if _NO_THREAD.search(program.output()[-10_000:]) and (trouble := no_threads(f"`{program.name}`")):
        raise trouble
    found = callbacks.failed(inside) or last_traceback(program.output(), program.name)
    if found:
        return found
    status = program.exit_status()
    wrong = _WRONG_FIELD.search(program.output()[-10_000:])
    if wrong and wrong[2] in _KINDS:
        return MESSAGE_FIELD(
            f"`{program.name}` sent data of an interface in the package `{wrong[1]}`. In this data, a field of type "
            f"`{_KINDS[wrong[2]]}` holds a value of another type. This ended the program without an error message from "
            "Python.",
        )
    if status == -signal.SIGBUS:
        return CRASHED(
            f"`{program.name}` was ended by signal 7 (SIGBUS), because it used a part of a memory-mapped file that"
            " does not exist or for which there was no space. During grading, the program's files in /tmp may use"
            f" {Limits().disk // MIB} MiB in total, and its files in /dev/shm may use as much.",
            "Map a smaller part of the file, or make the file at least as long as the part that you map.",
        )
    if status is not None and status < 0:
        return CRASHED(
            f"`{program.name}` was ended by signal {-status}.",
            "The log says what came before.",
        )
    if inside.attached and not any(executor.spins for executor in inside.executors):
        foreign = any(node.foreign for node in inside.nodes.values())
        if not foreign:
            return NOT_SPINNING(
                f"`{program.name}` ended by itself without spinning: no callback ever ran.",
                "`main` must spin the node (`rclpy.spin(node)` or an executor's `spin()`), and must be called.",
            )
    last = next((line for line in reversed(program.output().splitlines()) if line.strip()), "")
    return EXITED(
        f"`{program.name}` ended by itself with exit status {status}"
        + (f"; the last line it printed is `{last.strip()[:200]}`." if last else ", and it printed nothing."),
        _why_over(inside),
    )


def _why_over(inside: Inside) -> str:
    """What is to be said of how the program spins, if it does so in its own file."""
    names = ("spin", "spin_once", "spin_until_future_complete")
    spins = {name: number for name in names if (number := inside.source.calls(name))}
    if not spins or "spin" in spins:
        return "`spin()` runs until the program is stopped or shuts itself down." if spins else ""
    name, number = spins.popitem()
    returns = "runs at most one callback" if name == "spin_once" else "spins until its future is done"
    return (
        f"Line {number} (`{inside.source.line(number)}`) {returns} and then returns. Use `spin()`, which runs until "
        "the program is stopped."
    )


def shut_down_inside(scene: Scene) -> Reason | None:
    """Why a program that shut down inside a callback did not end well. Must have seen: that call."""
    for inside in scene.insides:
        for call in inside.calls:
            if call.what == "shutdown" and call.in_callback:
                error = last_traceback(inside.program.output(), inside.name)
                return SHUTDOWN_IN_CALLBACK(
                    f"`{inside.name}`, {call.line} (`{call.code}`) shuts down rclpy or the executor inside a callback"
                    + (
                        f". Code that ran later failed because of this: {error.because}"
                        if error
                        else ", while the executor is still spinning the node."
                    ),
                    SHUT_DOWN_IN_MAIN,
                )
    return None
