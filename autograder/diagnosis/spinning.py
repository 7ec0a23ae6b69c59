"""Whether the program came to spin its nodes at all."""

from __future__ import annotations

from autograder.diagnosis.inside import Inside
from autograder.reasons import Group, Kind, Reason

STUCK_IN_INIT = Kind(
    "stuck-in-init", "nothing was ever spun; the program is in one place of an __init__ each time", Group.SPINNING
)
NODE_NOT_ADDED = Kind("node-not-added", "an executor without nodes spins; the node was never spun", Group.SPINNING)
NOT_SPINNING = Kind(
    "not-spinning", "a node with callbacks was never spun, or the program ended without spinning", Group.SPINNING
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
"""Seconds without spinning after which it has ended: a program may spin once in a while."""


def _unspun(inside: Inside) -> list[str]:
    """Nodes that no executor has ever spun; none where one is in an executor that the probe does not watch."""
    if any(node.foreign for node in inside.nodes.values()):
        return []
    return [node.name for node in inside.nodes.values() if not node.spun and not node.destroyed]


def in_the_constructor(inside: Inside) -> Reason | None:
    """Must have seen: no node spun yet, and the program in one place of an `__init__` each time it is looked at."""
    if not _unspun(inside) or any(executor.spins for executor in inside.executors):
        return None
    place = inside.main_place()
    if place is None or place.function != "__init__":
        return None
    return STUCK_IN_INIT(
        f"`{inside.name}` is still in `__init__`, in {place}. It has not begun to spin, so no callback can run.",
        "A constructor has to return. Use a timer for work that repeats.",
    )


def not_added(inside: Inside) -> Reason | None:
    """Must have seen: an executor that spins without any node, and a node that no executor has ever spun."""
    unspun = _unspun(inside)
    empty = [executor for executor in inside.executors if executor.spinning and not executor.nodes]
    if unspun and empty and not any(executor.nodes for executor in inside.executors):
        return NODE_NOT_ADDED(
            f"`{inside.name}` spins a {empty[0].type} that contains no node: `{unspun[0]}` was never added to it.",
            "Call `executor.add_node(node)` before `executor.spin()`.",
        )
    return None


def never_spun(inside: Inside) -> Reason | None:
    """Must have seen: a node with callbacks, and no executor that ever spun while it held that node."""
    with_callbacks = {thing.node for thing in inside.callbacks}
    return _never_spun(inside, [name for name in _unspun(inside) if name in with_callbacks])


def cannot_answer(inside: Inside) -> Reason | None:
    """For a service of every node's, such as those of its parameters. Must have seen: what `never_spun` must, but
    of any node.
    """
    return _never_spun(inside, _unspun(inside))


def _never_spun(inside: Inside, names: list[str]) -> Reason | None:
    for name in names:
        others = [node.name for node in inside.nodes.values() if node.spun]
        place = inside.main_place() if not others else None
        return NOT_SPINNING(
            f"`{inside.name}` created the node `{name}`, but nothing spins it, so none of its callbacks can run."
            + (f" The program is in {place}." if place else "")
            + (f" Only {', '.join(f'`{other}`' for other in others)} is spun." if others else ""),
            "Call `rclpy.spin(node)`, or `spin()` of the executor that the node was added to.",
        )
    return None


def pulled_down(inside: Inside) -> Reason | None:
    """Must have seen: a shutdown in a callback, and a program that runs on while none of its nodes is spun."""
    spun = any(executor.spinning and executor.nodes for executor in inside.executors)
    for call in inside.calls:
        if call.what == "shutdown" and call.in_callback and not spun:
            return SHUTDOWN_IN_CALLBACK(
                f"`{inside.name}`, {call.line} (`{call.code}`) shuts down rclpy or the executor inside a callback, so "
                "nothing spins the node any more, but the program continues to run.",
                SHUT_DOWN_IN_MAIN,
            )
    return None


def thread_left(inside: Inside) -> Reason | None:
    """Must have seen: the main thread wait for others at the end of Python, and one of them in the student's code."""
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
    """Must have seen: a node that was spun, and that no spinning executor holds now, while the program lives on."""
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
