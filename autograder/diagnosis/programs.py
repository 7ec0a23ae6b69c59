"""Link one of every chain: is every program there, and alive?"""

from __future__ import annotations

import re
import signal

from autograder.arguments import params_file, remap_rules
from autograder.core.processes import no_threads
from autograder.diagnosis import callbacks
from autograder.diagnosis.inside import Inside
from autograder.diagnosis.reason import Diagnosis
from autograder.diagnosis.scene import Scene
from autograder.diagnosis.spinning import SHUT_DOWN_IN_MAIN
from autograder.diagnosis.traces import last_traceback
from autograder.sandbox.limits import MIB, Limits

_WRONG_FIELD = re.compile(
    r"(\w{1,100}?)__(?:msg|srv|action)__\w{1,100}convert_from_py.{0,200}Assertion `Py(\w{1,9})_Check"
)
"""What the C code of an interface prints when a field does not hold what it should."""
_NO_THREAD = re.compile(r"Resource temporarily unavailable|can't start new thread|std::system_error")
"""What Python, or the middleware's C++, prints when the system starts no thread for it."""
_KINDS = {"Long": "int", "Float": "float", "Bool": "bool", "Unicode": "str"}


def program_trouble(scene: Scene) -> Diagnosis | None:
    """Must have seen: a program that no cell defines, that could not be started, or that has ended."""
    for name in scene.missing:
        return Diagnosis(
            f"There is no program `{name}`: no cell that begins with `%%node {name}` was found.",
            "program-missing",
            "Check the first line of the cell, which must stand there unchanged; in a notebook, run the cell first.",
        )
    for trouble in scene.trouble:
        return trouble
    for number, program in enumerate(scene.programs):
        if program.running() or program in scene.stopped:
            continue
        refused = remap_rules.refused(scene.rules[number]) if number < len(scene.rules) else None
        if refused and ("arse remap rule" in program.output() or "invalid node namespace" in program.output()):
            return Diagnosis(*refused)
        unread = params_file.why_refused(program.output(), scene.folder)
        return Diagnosis(*unread) if unread else _death(scene.inside(program))
    return None


def _death(inside: Inside) -> Diagnosis:
    """Why a program has ended.

    Raises:
        KitError: the machine is the reason.
    """
    program = inside.program
    limit = program.stopped_by()
    if limit:
        return Diagnosis(
            f"`{program.name}` was ended because it went over the {limit}.",
            limit.replace(" ", "-"),
            "Look for a loop without an end, or for data that grows without a bound.",
        )
    if _NO_THREAD.search(program.output()[-10_000:]) and (trouble := no_threads(f"`{program.name}`")):
        raise trouble
    found = callbacks.failed(inside) or last_traceback(program.output(), program.name)
    if found:
        return found
    status = program.exit_status()
    wrong = _WRONG_FIELD.search(program.output()[-10_000:])
    if wrong and wrong[2] in _KINDS:
        return Diagnosis(
            f"`{program.name}` sent something of `{wrong[1]}` with a field that has to be `{_KINDS[wrong[2]]}`"
            " and holds a value of another type. That ended the program, without a word of Python's.",
            "crashed",
            "Lecture 7, section 'Python does not check what you assign'.",
        )
    if status == -signal.SIGBUS:
        return Diagnosis(
            f"`{program.name}` was ended by signal 7 (SIGBUS), because it used a part of a mapped file that does not"
            " exist, or for which there was no room. When a program is graded, its files in /tmp may have"
            f" {Limits().disk // MIB} MiB together, and so may those in /dev/shm.",
            "crashed",
            "Map less of the file, or make the file as long as what you map of it.",
        )
    if status is not None and status < 0:
        return Diagnosis(
            f"`{program.name}` was ended by signal {-status}.", "crashed", "The log says what came before."
        )
    if inside.attached and not any(executor.spins for executor in inside.executors):
        foreign = any(node.foreign for node in inside.nodes.values())
        if not foreign:
            return Diagnosis(
                f"`{program.name}` ended by itself without spinning: no callback ever ran.",
                "not-spinning",
                "`main` must spin the node (`rclpy.spin(node)` or an executor's `spin()`), and must be called.",
            )
    last = next((line for line in reversed(program.output().splitlines()) if line.strip()), "")
    return Diagnosis(
        f"`{program.name}` ended by itself with exit status {status}"
        + (f"; the last line it printed is `{last.strip()[:200]}`." if last else ", and it printed nothing."),
        "exited",
        _why_over(inside),
    )


def _why_over(inside: Inside) -> str:
    """What is to be said of how the program spins, if it does so in its own file."""
    names = ("spin", "spin_once", "spin_until_future_complete")
    spins = {name: number for name in names if (number := inside.source.calls(name))}
    if not spins or "spin" in spins:
        return "`spin()` goes on until the program is stopped, or until it shuts down itself." if spins else ""
    name, number = spins.popitem()
    returns = "runs one callback at the most" if name == "spin_once" else "spins until its future is done"
    return (
        f"Line {number} (`{inside.source.line(number)}`) {returns} and returns. `spin()` goes on until it is stopped."
    )


def shut_down_inside(scene: Scene) -> Diagnosis | None:
    """Why a program that shut down inside a callback did not end well. Must have seen: that call."""
    for inside in scene.insides:
        for call in inside.calls:
            if call.what == "shutdown" and call.in_callback:
                error = last_traceback(inside.program.output(), inside.name)
                return Diagnosis(
                    f"`{inside.name}`, {call.line} (`{call.code}`) shuts down inside a callback, "
                    + (
                        f"and what comes after finds it done already: {error.because}"
                        if error
                        else "so what spins the node is pulled away under it."
                    ),
                    "shutdown-in-callback",
                    SHUT_DOWN_IN_MAIN,
                )
    return None
