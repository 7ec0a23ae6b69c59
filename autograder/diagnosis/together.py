"""Says why callbacks did not run at the same time, or some hardly ran at all.

The cause may be the executor, its number of threads, the callback groups or a lock.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence

from autograder.diagnosis.blocked import ONE_LOCK, WAITS_FOR_LOCK
from autograder.diagnosis.inside import Inside, called, listed
from autograder.diagnosis.scene import Scene
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import ExecutorSeen, Ran, Thing

ONE_GROUP = Kind(
    "one-group", "all timers and all callbacks that ran are in one exclusive group", Group.TOGETHER, "timeline"
)
SINGLE_THREADED_EXECUTOR = Kind(
    "single-threaded-executor", "all callbacks ran on one single-threaded executor", Group.TOGETHER, "timeline"
)
FEW_THREADS = Kind("few-threads", "fewer threads than callbacks that must run at once", Group.TOGETHER, "timeline")
GROUP_LIMIT = Kind(
    "group-limit",
    "the groups of all timers and all callbacks that ran let fewer run at once than must",
    Group.TOGETHER,
    "timeline",
)
EXCLUSIVE_GROUP = Kind(
    "exclusive-group",
    "all callbacks that ran are in exclusive groups, where one was to overlap itself",
    Group.TOGETHER,
    "timeline",
)
NO_CALLBACK_GROUPS = Kind(
    "no-callback-groups",
    "all timers and all callbacks that ran are in the node's default group",
    Group.TOGETHER,
    "timeline",
)
STARVED = Kind(
    "starved",
    "a timer ran far less often than due; others of its exclusive group took most of the time",
    Group.TOGETHER,
    "timeline",
)
MACHINE_THREADS = Kind(
    "machine-threads",
    "fewer threads than callbacks that must run at once, and no number given",
    Group.TOGETHER,
    "timeline",
)
TIMER_SAME_GROUP = Kind(
    "timer-same-group",
    "a callback waits for a response, and all timers of its node are in its exclusive group",
    Group.TOGETHER,
    "timeline",
)
RAN_AND_SENT_NOTHING = Kind(
    "ran-and-sent-nothing",
    "while messages had to come, the timer that publishes them ran, and published none",
    Group.TOGETHER,
    "timeline",
)
CANCELLED_MEANWHILE = Kind(
    "cancelled-meanwhile",
    "while messages had to come, the program cancelled the timer that publishes them, and it did not run",
    Group.TOGETHER,
    "timeline",
)

MOST_OF_THE_TIME = 0.6
"""The share of the time that other callbacks must have taken before a callback counts as kept waiting by them."""

CANCELLED_BEFORE = 0.1
"""A timer that was cancelled at most so many seconds before the time in question counts as cancelled because of it."""

FAR_FEWER = 0.6
"""A timer with less than this share of its due runs counts as kept waiting."""


def _used(inside: Inside) -> list[ExecutorSeen]:
    """Return the executors that have run a callback."""
    return [executor for executor in inside.executors if executor.most]


def _active(inside: Inside) -> list[Thing]:
    return [thing for thing in inside.callbacks if thing.runs]


def single_threaded(inside: Inside) -> Reason | None:
    """Must have seen: callbacks run, one of which takes time, all of them in one executor that is not a
    MultiThreadedExecutor.
    """
    used = _used(inside)
    if not any(thing.takes_time for thing in _active(inside)):
        return None  # no callback occupies the thread for long, so the single thread is not the cause
    if not used or len(used) > 1 or used[0].threads is not None:
        return None
    unused = [e for e in inside.executors if e.threads is not None and not e.most]
    if any(e.spinning and not e.nodes for e in inside.executors):
        because = (
            "The program spins several executors, but a node belongs only to the executor to which it was added last. "
            f"All callbacks ran on the single thread of a {used[0].type}."
        )
    elif unused:
        because = "The program creates a MultiThreadedExecutor, but spins the node with another, single-threaded one."
    elif any(thing.group == "ReentrantCallbackGroup" for thing in _active(inside)):
        because = (
            f"A {used[0].type} spins the node and runs one callback at a time. A reentrant group does not change this."
        )
    else:
        because = f"A {used[0].type} spins the node (`rclpy.spin` uses one, too), and it runs one callback at a time."
    return SINGLE_THREADED_EXECUTOR(
        f"`{inside.name}`: {because}",
        "Add the node to a MultiThreadedExecutor(num_threads=...) and spin that.",
    )


def few_threads(inside: Inside, at_once: int) -> Reason | None:
    """Must have seen: an executor that ran callbacks and has fewer threads than callbacks that must run at once."""
    for executor in _used(inside):
        if executor.threads is None or executor.threads >= at_once:
            continue
        have = f"{executor.threads} thread{'s' * (executor.threads != 1)}"
        if not executor.threads_given:
            return MACHINE_THREADS(
                f"`{inside.name}` does not set the number of threads. On this machine, MultiThreadedExecutor() uses "
                f"{have}, one for each CPU, but {at_once} callbacks have to run at the same time.",
                "Pass the number of threads that the task needs: MultiThreadedExecutor(num_threads=...).",
            )
        return FEW_THREADS(
            f"`{inside.name}`: its MultiThreadedExecutor has {have}, but {at_once} callbacks have to run at the same "
            "time.",
            "Each running callback needs its own thread. Count the callbacks that have to run at the same time.",
        )
    return None


def one_group(inside: Inside) -> Reason | None:
    """Must have seen: several callbacks, and all timers and all callbacks that ran in the same exclusive group."""
    active = [thing for thing in inside.callbacks if thing.runs or thing.kind == "timer"]
    groups = {thing.group_id for thing in active}
    if len(active) < 2 or len(groups) != 1 or not all(thing.exclusive for thing in active):
        return None
    if active[0].default_group:
        threads = " has a MultiThreadedExecutor, but" if any(one.threads for one in _used(inside)) else ":"
        return NO_CALLBACK_GROUPS(
            f"`{inside.name}`{threads} all its callbacks are in the node's default group, which is mutually exclusive: "
            "they run one after another.",
            "Give the callbacks that may overlap a callback group of their own.",
        )
    return ONE_GROUP(
        f"`{inside.name}` has all its callbacks in one mutually exclusive group ({listed(active)}): they run one after "
        "another.",
        "Callbacks that may overlap need different groups.",
    )


def groups_allow_fewer(inside: Inside, at_once: int) -> Reason | None:
    """Must have seen: the groups of all timers and of all callbacks that ran, which allow fewer to run at once.

    There is no reason if a reentrant callback overlapped itself, because then it can run any number of times at once.
    """
    active = [thing for thing in inside.callbacks if thing.runs or thing.kind == "timer"]
    groups = _by_group(active)
    limit = sum(1 if members[0].exclusive else len(members) for members in groups)
    if len(active) < at_once or limit >= at_once or any(thing.most > 1 for thing in active):
        return None
    return GROUP_LIMIT(
        f"`{inside.name}`: its groups allow at most {limit} callback{'s' * (limit != 1)} to run at the same time, but "
        f"{at_once} have to: {_kinds(groups)}.",
        "Only one callback of a mutually exclusive group runs at a time. Put callbacks that may overlap the others "
        "into another group.",
    )


def _by_group(things: Sequence[Thing]) -> list[list[Thing]]:
    groups: dict[int, list[Thing]] = {}
    for thing in things:
        groups.setdefault(thing.group_id, []).append(thing)
    return list(groups.values())


def _kinds(groups: Sequence[Sequence[Thing]]) -> str:
    """Describe in words which callbacks are in these groups."""
    return "; ".join(
        f"{'an exclusive' if members[0].exclusive else 'a reentrant'} group has {listed(members)}" for members in groups
    )


def exclusive_itself(inside: Inside) -> Reason | None:
    """Must have seen: callbacks run, and none of them in a reentrant group.

    This is a reason only if a callback should have overlapped itself.
    """
    active = _active(inside)
    if not active or any(not thing.exclusive for thing in active):
        return None
    return EXCLUSIVE_GROUP(
        f"`{inside.name}`: every callback is in a mutually exclusive group ({listed(active)}). In such a group, a "
        "callback never overlaps itself, no matter how many threads there are.",
        "A callback may overlap itself only in a ReentrantCallbackGroup.",
    )


def _publishing(scene: Scene, topic: str) -> list[Inside]:
    """Return the programs that publish on a topic according to their probes; all programs if no probe knows one."""
    publishing = [
        inside
        for inside in scene.insides
        if any(thing.kind == "publisher" and thing.name == topic for thing in inside.things.values())
    ]
    return publishing or scene.insides


def why_not_together(scene: Scene, topic: str, at_once: int = 2, itself: bool = False) -> Reason | None:
    """Return why callbacks did not overlap; None if nothing was seen that prevents them from overlapping.

    Must have seen: callbacks whose runs take time, because short runs keep no other callback waiting.

    Args:
        scene: the launch.
        topic: the topic on which the callbacks publish when they begin and end.
        at_once: how many of them should have run at the same time.
        itself: whether one callback should have overlapped itself.
    """
    for inside in _publishing(scene, topic):
        if not inside.attached or not _used(inside) or not any(thing.takes_time for thing in _active(inside)):
            continue
        found = single_threaded(inside) or few_threads(inside, 2)
        found = found or (exclusive_itself(inside) if itself else one_group(inside)) or few_threads(inside, at_once)
        if not itself:
            found = found or groups_allow_fewer(inside, at_once) or one_lock(inside, at_once)
        if found:
            return found
    return None


def waits_for_its_group(scene: Scene) -> Reason | None:
    """Return why timers do not run while a service is called.

    Must have seen: a callback that waits for a response, and every timer of its node in the mutually exclusive group of
    that callback.
    """
    for inside in scene.insides:
        if not inside.attached:
            continue
        waiting = {call.callback for call in inside.calls if call.what == "client.call" and call.in_callback}
        for thing in inside.callbacks:
            if not thing.exclusive or (thing.id not in waiting and not thing.awaited):
                continue
            timers = [other for other in inside.callbacks if other.kind == "timer" and other.node == thing.node]
            if timers and all(timer.group_id == thing.group_id and timer.id != thing.id for timer in timers):
                group = " (the node's default group)" * thing.default_group
                return TIMER_SAME_GROUP(
                    f"`{inside.name}`: {called(thing)} occupies its group while it waits for the response, and "
                    f"{listed(timers)} {'is' if len(timers) == 1 else 'are'} in the same mutually exclusive "
                    f"group{group}. Therefore no timer of the node runs until the response has arrived.",
                    "Give the timer a callback group of its own.",
                )
    return None


def why_starved(scene: Scene) -> Reason | None:
    """Return why some timers ran far less often than they were due.

    Must have seen: such a timer, and others of its exclusive group, or of its executor, take most of the time.
    """
    for inside in scene.insides:
        if not inside.attached:
            continue
        for thing in inside.callbacks:
            found = _starved(inside, thing) if thing.kind == "timer" and not thing.cancelled else None
            if found:
                return found
    return None


def _starved(inside: Inside, timer: Thing) -> Reason | None:
    node, executor = inside.nodes.get(timer.node), inside.executor_of(timer.node)
    if not node or not node.spun or not executor or not timer.period:
        return None
    lasted = inside.now - node.made
    if timer.runs >= FAR_FEWER * lasted / timer.period:
        return None
    others = [other for other in inside.group(timer) if other.id != timer.id and other.has_callback and other.runs]
    if timer.exclusive and _taken(inside, others) > MOST_OF_THE_TIME * lasted:
        group = "the node's default group" if timer.default_group else "a mutually exclusive group"
        return STARVED(
            f"`{inside.name}`: {called(timer)} {_ran(timer.runs)}. It shares {group} with {listed(others)}, "
            "which ran most of the time. While one callback of a mutually exclusive group runs, the others wait.",
            "Callbacks that must not wait for each other need different groups.",
        )
    others = [other for other in _active(inside) if other.id != timer.id]
    if _taken(inside, others) > MOST_OF_THE_TIME * lasted * executor.size and executor.most >= executor.size:
        threads = "the only thread" if executor.size == 1 else f"all {executor.size} threads"
        kind = SINGLE_THREADED_EXECUTOR if executor.threads is None else FEW_THREADS
        return kind(
            f"`{inside.name}`: {called(timer)} {_ran(timer.runs)}: {listed(others)} kept {threads} of the "
            f"{executor.type} busy most of the time.",
            "Callbacks that must not wait for each other need threads of their own."
            if executor.threads is not None
            else "Spin the node with a MultiThreadedExecutor(num_threads=...), and give each of them its own group.",
        )
    return None


def _taken(inside: Inside, things: Sequence[Thing]) -> float:
    """Return for how many seconds in total these callbacks ran."""
    now = inside.now
    return sum(thing.spent + sum(now - began for began, _ in thing.running) for thing in things)


def _ran(number: int) -> str:
    return {0: "did not run", 1: "ran only once"}.get(number, f"ran only {number} times")


def sent_nothing(scene: Scene, topic: str, spans: Sequence[tuple[float, float]]) -> Reason | None:
    """Must have seen: a timer that has published on the topic, but that in one of these spans either ran and published
    nothing, or was cancelled and did not run.

    Args:
        scene: the launch.
        topic: the topic on which no message came in these spans.
        spans: the begin and end of each, in seconds on the system clock.
    """
    ahead = time.time() - time.monotonic()
    for inside in _publishing(scene, topic):
        ran = [run for event in inside.all(Ran) for run in event.runs]
        senders = {thing.id for thing in inside.things.values() if (thing.kind, thing.name) == ("publisher", topic)}
        sent = [run for run in ran if run[0] in senders]
        for timer in (thing for thing in inside.callbacks if thing.kind == "timer"):
            runs = [run for run in ran if run[0] == timer.id]
            if not any(run[1] <= at <= run[2] and run[3] == thread for _, at, _, thread in sent for run in runs):
                continue
            for begin, end in ((begin - ahead, end - ahead) for begin, end in spans):
                during = sum(begin < run[1] and run[2] < end for run in runs)
                if not during and begin - CANCELLED_BEFORE < timer.cancelled_at < end:
                    return CANCELLED_MEANWHILE(
                        f"`{inside.name}`: {timer.cancelled_in} cancelled {called(timer)}. It did not run meanwhile.",
                        "A timer that is cancelled does not run until `reset()` is called. Other callbacks need not "
                        "stop it in order to wait.",
                    )
                if during > 1 and not any(begin < at < end for _, at, _, _ in sent):
                    return RAN_AND_SENT_NOTHING(
                        f"`{inside.name}`: meanwhile {called(timer)} ran {during} times, and published nothing on "
                        f"`{topic}`. So it was not kept waiting.",
                        "Look for what decides in the callback whether it publishes, such as a condition or a flag.",
                    )
    return None


def layout(scene: Scene, topic: str) -> str:
    """Describe the executors and groups of the programs that publish on a topic, for when no reason is established."""
    said = []
    for inside in _publishing(scene, topic):
        if not inside.attached or not _used(inside):
            continue
        executor = _used(inside)[0]
        said.append(
            f"`{inside.name}` runs on {executor.size} thread{'s' * (executor.size != 1)}, of which at most "
            f"{executor.most} were busy at once; {_kinds(_by_group(_active(inside)))}."
        )
    return " ".join(said)


def why_kept_waiting(scene: Scene, service: str) -> Reason | None:
    """Return why a service answers only after another callback of its program has ended.

    Must have seen: another callback whose runs take time, and the service's callback in the exclusive group of that
    callback, or on the only thread of the same executor; or runs of the service's callback that take time themselves,
    and in the source a lock that both callbacks take.
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
        f"`{inside.name}`: {called(answers)} and {called(works)} are in {group}, which is mutually exclusive, so "
        "the response waits until the other callback has ended.",
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
                f"`{inside.name}`: {called(answers)} takes `{lock}` in line {line}, but {called(works)} holds this "
                f"lock while it works (from line {others[lock]} on), so the response is delayed.",
                ONE_LOCK,
            )
    return None


def one_lock(inside: Inside, at_once: int) -> Reason | None:
    """Return why callbacks that had threads at the same time still worked one after another.

    Must have seen: at least `at_once` callbacks on the threads of an executor at once, and in the source a lock that
    two callbacks take, of which at least one has runs that take time.
    """
    most = max((executor.most for executor in inside.executors), default=0)
    ran = [thing for thing in inside.callbacks if thing.runs] if most >= at_once else []
    taken = [(thing, inside.source.locks(int(thing.line.rpartition(":")[2] or 0))) for thing in ran]
    for (one, mine), (other, others) in itertools.combinations(taken, 2):
        for lock in [lock for lock in mine if lock in others and (one.takes_time or other.takes_time)]:
            lines = f"line {mine[lock]}" if mine[lock] == others[lock] else f"lines {mine[lock]} and {others[lock]}"
            return WAITS_FOR_LOCK(
                f"`{inside.name}`: up to {most} callbacks had a thread at the same time, but {called(one)} "
                f"and {called(other)} take the same `{lock}` ({lines}): one waits while the other holds it.",
                f"{ONE_LOCK} A callback that waits for a lock occupies its thread.",
            )
    return None
