"""The first links of every chain: whether every program exists and is running, and whether it spins its nodes."""

from __future__ import annotations

import re
import signal

from autograder.arguments import params_file, remap_rules
from autograder.core.processes import no_threads
from autograder.diagnosis import callbacks
from autograder.diagnosis.callbacks import MESSAGE_FIELD
from autograder.diagnosis.inside import AFTER_SHUTDOWN, Inside
from autograder.diagnosis.scene import Scene
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
"""What the C code of an interface prints if a field has a value of a wrong type."""
_NO_THREAD = re.compile(r"Resource temporarily unavailable|can't start new thread|std::system_error")
"""What Python, or the middleware's C++ code, prints if the system refuses to start a thread."""
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
    """Return why a program has ended.

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
    """Return advice about how the program spins, if its own file contains a call that spins; otherwise empty."""
    names = ("spin", "spin_once", "spin_until_future_complete")
    spins = {name: number for name in names if (number := inside.source.calls(name))}
    if not spins or "spin" in spins:
        return "`spin()` runs until the program is stopped or shuts itself down." if spins else ""
    name, number = spins.popitem()
    line = f"Line {number} (`{inside.source.line(number)}`)"
    if name == "spin_once":
        once = "runs at most one callback and then returns"
        return f"{line} {once}. Use `spin()`, which runs until the program is stopped."
    return (
        f"{line} spins until its future is done and then returns. Look at what completes this future, and when. If "
        "nothing should end the program but a signal, use `spin()`."
    )


def shut_down_inside(scene: Scene) -> Reason | None:
    """Return why a program that called shutdown inside a callback did not end properly.

    Must have seen: that call, and an end that it can have caused: by a signal, or by an error of rclpy that says that
    something is shut down.
    """
    for inside in scene.insides:
        error = last_traceback(inside.program.output(), inside.name)
        if (inside.program.exit_status() or 0) >= 0 and not (error and AFTER_SHUTDOWN.search(error.because)):
            continue  # it ended for another reason
        for call in inside.calls:
            if call.what == "shutdown" and call.in_callback:
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


STUCK_IN_INIT = Kind(
    "stuck-in-init", "nothing was ever spun; the program is in one place of a node's __init__ each time", Group.SPINNING
)
NODE_NOT_ADDED = Kind("node-not-added", "an executor without nodes spins; the node was never spun", Group.SPINNING)
NOT_SPINNING = Kind(
    "not-spinning", "a node with callbacks was never spun, or the program ended without spinning", Group.SPINNING
)
EVENTS_EXECUTOR = Kind(
    "events-executor",
    "the main thread stays in a `spin()`, the code uses `EventsExecutor`, and no callback has run",
    Group.SPINNING,
)
SHUTDOWN_IN_CALLBACK = Kind(
    "shutdown-in-callback", "a callback called shutdown, and the program did not end as it should", Group.PROGRAM
)
THREAD_LEFT = Kind(
    "thread-left",
    "the main thread has come to its end and waits for another, which is in the student's code",
    Group.SPINNING,
)
SPINNING_ENDED = Kind(
    "spinning-ended", "the node was spun, and no spinning executor has held it for a while", Group.SPINNING
)

SHUT_DOWN_IN_MAIN = "Set a future or a flag in the callback. Then let `main` stop spinning and shut down."

ENDED_AFTER = 1.0
"""The seconds without spinning after which the spinning counts as ended, because a program may spin at intervals."""


def _unspun(inside: Inside) -> list[str]:
    """Return the nodes that no executor has ever spun; none if the probe does not watch the executor of some node."""
    if any(node.foreign for node in inside.nodes.values()):
        return []
    return [node.name for node in inside.nodes.values() if not node.spun and not node.destroyed]


def in_the_constructor(inside: Inside) -> Reason | None:
    """Must have seen: no node spun yet, and the program in the same place of a node's `__init__` at each look."""
    if not _unspun(inside) or any(executor.spins for executor in inside.executors):
        return None
    place, innermost = inside.constructor_place(), inside.main_place()
    if place is None:
        return None
    called = f", and there in {innermost}" if innermost not in (None, place) else ""
    return STUCK_IN_INIT(
        f"`{inside.name}` is still in `__init__`, in {place}{called}. It has not begun to spin, so no callback can "
        "run.",
        "A constructor has to return. Use a timer for work that repeats.",
    )


def not_added(inside: Inside) -> Reason | None:
    """Must have seen: an executor that spins without nodes, and a node that no executor has ever spun."""
    unspun = _unspun(inside)
    empty = [executor for executor in inside.executors if executor.spinning and not executor.nodes]
    if unspun and empty and not any(executor.nodes for executor in inside.executors):
        return NODE_NOT_ADDED(
            f"`{inside.name}` spins a {empty[0].type} that contains no node: `{unspun[0]}` was never added to it.",
            "Call `executor.add_node(node)` before `executor.spin()`.",
        )
    return None


def in_events_executor(inside: Inside) -> Reason | None:
    """Return that the program hangs in the `spin()` of an `EventsExecutor`.

    In rclpy 7.1.6, this `spin()` keeps the lock of its own queue. Therefore no callback runs, and DDS cannot go on
    either, so that often not even the node is known to others.

    Must have seen: a node in an executor that the probe does not watch, the name of this one in the code, the main
    thread in the same `spin()` at each look, and no callback that ever ran.
    """
    foreign = any(node.foreign and not node.destroyed for node in inside.nodes.values())
    if not foreign or not inside.source.uses("EventsExecutor") or any(thing.runs for thing in inside.callbacks):
        return None
    place = inside.main_place()
    if place is None or "spin()" not in place.code:
        return None
    return EVENTS_EXECUTOR(
        f"`{inside.name}` is in {place}, and no callback has run. `EventsExecutor` is experimental, and its `spin()`"
        " hangs with this version of rclpy.",
        "Use a `SingleThreadedExecutor` or a `MultiThreadedExecutor`.",
    )


def never_spun(inside: Inside) -> Reason | None:
    """Must have seen: a node with callbacks, and no executor that ever spun while it held that node."""
    with_callbacks = {thing.node for thing in inside.callbacks}
    return _never_spun(inside, [name for name in _unspun(inside) if name in with_callbacks])


def cannot_answer(inside: Inside) -> Reason | None:
    """Return why a service that every node has, such as those of its parameters, does not answer.

    Must have seen: the same as `never_spun`, but for any node, also one without callbacks.
    """
    return in_events_executor(inside) or _never_spun(inside, _unspun(inside))


def _never_spun(inside: Inside, names: list[str]) -> Reason | None:
    for name in names:
        others = [
            node.name
            for node in inside.nodes.values()
            if inside.spinning(node.name) or (node.spun and inside.now - node.spun <= ENDED_AFTER)
        ]
        place = inside.main_place() if not others else None
        return NOT_SPINNING(
            f"`{inside.name}` created the node `{name}`, but nothing spins it, so none of its callbacks can run."
            + (f" The program is in {place}." if place else "")
            + (f" Only {', '.join(f'`{other}`' for other in others)} is spun." if others else ""),
            "`spin` returns only at shutdown, so a second `spin` after it is not reached. Add all nodes to one "
            "executor and spin that."
            if others
            else "Call `rclpy.spin(node)`, or `spin()` of the executor that the node was added to. If this call is in "
            "the program already, the program has not come to it.",
        )
    return None


def pulled_down(inside: Inside) -> Reason | None:
    """Must have seen: a shutdown in a callback, and a program that spins none of its nodes and waits in rclpy."""
    spun = any(executor.spinning and executor.nodes for executor in inside.executors)
    for call in inside.calls:
        if call.what == "shutdown" and call.in_callback and not spun and inside.main_in_rclpy():
            return SHUTDOWN_IN_CALLBACK(
                f"`{inside.name}`, {call.line} (`{call.code}`) shuts down rclpy or the executor inside a callback, so "
                "nothing spins the node any more, but the program continues to run.",
                SHUT_DOWN_IN_MAIN,
            )
    return None


def thread_left(inside: Inside) -> Reason | None:
    """Must have seen: the main thread wait for others when Python ends, and one of them in the student's code."""
    mains = [next(reversed(stacks.values()), []) for stacks in inside.stacks]
    if not mains or not all(any(frame[2] == "_shutdown" for frame in frames) for frames in mains):
        return None
    for thread in inside.stacks[0]:
        place = inside.place(thread)
        if place:
            return THREAD_LEFT(
                f"`{inside.name}`: `main` has ended, but another thread of the program is still in "
                f"`{place.function}`, in {place}. Python waits until all threads have ended, except daemon threads.",
                "Tell the thread to end and `join` it, or create it with `daemon=True`.",
            )
    return None


def no_longer_spun(inside: Inside) -> Reason | None:
    """Must have seen: a node that was spun and is in no spinning executor now, while the program continues to run."""
    for node in inside.nodes.values():
        left = node.spun and not inside.spinning(node.name) and inside.now - node.spun > ENDED_AFTER
        if left and not node.destroyed and not node.foreign:
            busy = any(executor.spinning for executor in inside.executors)
            place = None if busy else inside.main_place()
            return SPINNING_ENDED(
                f"`{inside.name}`: the node `{node.name}` was spun at first, but nothing spins it any more."
                + (f" The program is in {place}." if place else ""),
                "The node's callbacks can run only while an executor spins the node.",
            )
    return None
