"""Why one callback waits for the end of another: their group, their thread, or a lock that both take."""

from __future__ import annotations

import itertools

from autograder.diagnosis.blocked import ONE_LOCK, WAITS_FOR_LOCK
from autograder.diagnosis.events import Thing
from autograder.diagnosis.inside import Inside, called
from autograder.diagnosis.scene import Scene
from autograder.reasons import Group, Kind, Reason

ONE_GROUP = Kind(
    "one-group", "all timers and all callbacks that ran are in one exclusive group", Group.TOGETHER, "timeline"
)
SINGLE_THREADED_EXECUTOR = Kind(
    "single-threaded-executor", "all callbacks ran on one single-threaded executor", Group.TOGETHER, "timeline"
)
FEW_THREADS = Kind("few-threads", "fewer threads than callbacks that must run at once", Group.TOGETHER, "timeline")


def why_kept_waiting(scene: Scene, service: str) -> Reason | None:
    """Why a service answers only when another callback of its program has ended.

    Must have seen: another callback whose runs take time, and the service's in its exclusive group, or on its only
    thread; or runs of the service's callback that take time themselves, and a lock that the source of both takes.
    """
    for inside in scene.insides:
        asked = [thing for thing in inside.callbacks if (thing.kind, thing.name) == ("service", service)]
        slow = [thing for thing in inside.callbacks if thing.takes_time and thing.name != service]
        for answers in asked:
            for works in slow:
                found = _group(inside, answers, works) or _thread(inside, answers, works)
                found = found or _lock(inside, answers, works)
                if found:
                    return found
    return None


def _group(inside: Inside, answers: Thing, works: Thing) -> Reason | None:
    if not works.exclusive or works.group_id != answers.group_id:
        return None
    group = "the node's default group" if works.default_group else "one group"
    return ONE_GROUP(
        f"`{inside.name}`: {called(answers)} and {called(works)} are in {group}, which is mutually exclusive: the "
        "answer waits until the other callback has ended.",
        "Callbacks that may overlap need different groups.",
    )


def _thread(inside: Inside, answers: Thing, works: Thing) -> Reason | None:
    executor = inside.executor_of(works.node)
    if not executor or executor.size != 1 or executor is not inside.executor_of(answers.node):
        return None
    kind = SINGLE_THREADED_EXECUTOR if executor.threads is None else FEW_THREADS
    return kind(
        f"`{inside.name}`: its {executor.type} has one thread, so {called(answers)} waits until {called(works)} has "
        "ended.",
        "Callbacks that must not wait for each other need threads of their own.",
    )


def _lock(inside: Inside, answers: Thing, works: Thing) -> Reason | None:
    if not answers.takes_time:
        return None
    mine, others = (inside.source.locks(int(t.line.rpartition(":")[2] or 0)) for t in (answers, works))
    for lock, line in mine.items():
        if lock in others:
            return WAITS_FOR_LOCK(
                f"`{inside.name}`: {called(answers)} takes `{lock}` in line {line}, and {called(works)} holds that "
                f"while it works (from line {others[lock]} on): the answer waits for it.",
                ONE_LOCK,
            )
    return None


def one_lock(inside: Inside, at_once: int) -> Reason | None:
    """Why callbacks that were on threads at once worked one after another.

    Must have seen: so many callbacks on the threads of an executor at once, and a lock that the source of two takes;
    runs of one of these take time.
    """
    most = max((executor.most for executor in inside.executors), default=0)
    ran = [thing for thing in inside.callbacks if thing.runs] if most >= at_once else []
    taken = [(thing, inside.source.locks(int(thing.line.rpartition(":")[2] or 0))) for thing in ran]
    for (one, mine), (other, others) in itertools.combinations(taken, 2):
        for lock in [lock for lock in mine if lock in others and (one.takes_time or other.takes_time)]:
            lines = f"line {mine[lock]}" if mine[lock] == others[lock] else f"lines {mine[lock]} and {others[lock]}"
            return WAITS_FOR_LOCK(
                f"`{inside.name}`: up to {most} callbacks were on threads at once, but {called(one)} and "
                f"{called(other)} take the same `{lock}` ({lines}): one waits while the other holds it.",
                f"{ONE_LOCK} One that waits keeps its thread.",
            )
    return None
