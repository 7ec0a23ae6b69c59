"""Callbacks that do not return: what they wait for, and why that cannot happen."""

from __future__ import annotations

import re

from autograder.diagnosis.inside import Inside, called
from autograder.diagnosis.sources import Place
from autograder.graph.names import nearest
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import Call, Thing

WAITS_FOR_SERVICE = Kind(
    "waits-for-service",
    "a call, or a request that was sent, waits for a service that is not on the graph",
    Group.BLOCKED,
)
AWAIT_SAME_GROUP = Kind(
    "await-same-group", "a callback awaits a client's response; both are in one exclusive group", Group.BLOCKED
)
STUCK_CALLBACK = Kind(
    "stuck-callback",
    "a callback has not returned, and each look found its thread in the same line or loop",
    Group.BLOCKED,
)
CALL_SAME_GROUP = Kind(
    "call-same-group",
    "call() in a callback has not returned; client and callback share an exclusive group",
    Group.BLOCKED,
)
CALL_IN_CALLBACK = Kind(
    "call-in-callback", "call() in a callback has not returned; every thread of the executor is occupied", Group.BLOCKED
)
NESTED_SPIN = Kind(
    "nested-spin",
    "a callback spins, and has not returned since, or its node is in no spinning executor now",
    Group.BLOCKED,
)
RATE_IN_CALLBACK = Kind(
    "rate-in-callback",
    "rate.sleep() in a callback has not returned; every thread of the executor is occupied",
    Group.BLOCKED,
)
RATE_UNSPUN = Kind("rate-unspun", "rate.sleep() has not returned; no executor spins", Group.BLOCKED)
BUSY_WAIT = Kind(
    "busy-wait",
    "a callback stays in a loop that checks a future; meanwhile the response cannot be processed",
    Group.BLOCKED,
)
WRONG_TYPE = Kind("wrong-type", "the end, or the service that is asked, is there with another type", Group.NAMES)
WAITS_FOR_LOCK = Kind(
    "waits-for-lock",
    "a callback has not returned; its thread waits for a lock or a semaphore; or two callbacks take the same lock",
    Group.BLOCKED,
)

STUCK_AFTER = 1.5
"""The seconds that a run must have taken to count as one that does not end."""

ONE_LOCK = "Callbacks that take the same lock run one after another, no matter which groups and threads they have."

_WITH_A_LIMIT = "Wait with a time limit, and check whether the server is available."
_LIMITED = re.compile(r"wait_for_service\(\s*[^)\s]")
_OWN_GROUP = "Give the client, or the callback that waits, a callback group of its own."


def _blocked(inside: Inside, what: str) -> list[Call]:
    """Return the calls of this kind that were made in a callback and have not returned."""
    return [call for call in inside.calls if call.what == what and call.in_callback and call.blocks]


def _at(inside: Inside, call: Call) -> str:
    return f"`{inside.name}`, {call.line} (`{call.code}`): "


def call_same_group(inside: Inside) -> Reason | None:
    """Must have seen: `call()` in a callback that has not returned, and client and callback in one exclusive group."""
    for call in _blocked(inside, "client.call"):
        client, callback = inside.things.get(call.target), inside.things.get(call.callback)
        executor = inside.executor_of(callback.node) if callback else None
        if not client or not callback or not client.exclusive or client.group_id != callback.group_id:
            continue
        if executor and executor.size > 1:
            return CALL_SAME_GROUP(
                f"{_at(inside, call)}`call()` blocks this callback until the response is processed. The client is in "
                "the same mutually exclusive group as the callback, so the response is processed only after the "
                "callback has ended: a deadlock. More threads do not help.",
                _OWN_GROUP,
            )
    return None


def call_in_callback(inside: Inside) -> Reason | None:
    """Must have seen: `call()` in a callback that has not returned, and every thread of the executor occupied."""
    for call in _blocked(inside, "client.call"):
        callback = inside.things.get(call.callback)
        executor = inside.executor_of(callback.node) if callback else None
        if executor and executor.busy >= executor.size:
            threads = "the only thread" if executor.size == 1 else f"the last of {executor.size} threads"
            return CALL_IN_CALLBACK(
                f"{_at(inside, call)}`call()` blocks this callback until the response is processed, but no thread is "
                f"free to process it: this callback occupies {threads}, so it waits for itself.",
                "Use `call_async` with a done callback. Or keep `call()`, with a MultiThreadedExecutor, and with the "
                "client in another group than the callback.",
            )
    return None


def waits_for_a_service(inside: Inside) -> Reason | None:
    """Must have seen: a call that waits for a service, and no service of that name on the graph."""
    for call in inside.calls:
        client = inside.things.get(call.target)
        if call.what not in ("wait_for_service", "client.call") or not call.begun or not client:
            continue
        lasting = call.blocks or (call.what == "wait_for_service" and call.begun > 1)
        services = inside.observer.services()
        if lasting and client.name and client.name not in services:
            said = f"{_at(inside, call)}this call waits for "
            return _nobody_offers(client, services, said, *_without_waiting(call))
    return None


def _without_waiting(call: Call) -> tuple[str, str]:
    """Return what to do if a service is missing: in addition to another name, and if no name is similar."""
    if call.in_callback:
        held = "A callback that waits holds up the others: ask `service_is_ready()`, and go on if it says no."
        return f" {held}", held
    if _LIMITED.search(call.code):
        return "", "The call has a time limit: look how long it is, and how often the program makes such a call."
    if call.what == "wait_for_service":
        return " If the service may be missing, wait with `timeout_sec`.", _WITH_A_LIMIT
    return "", _WITH_A_LIMIT


def asks_nobody(inside: Inside) -> Reason | None:
    """Must have seen: an unanswered request, sent a while ago to a service that is not on the graph."""
    for client in inside.things.values():
        waited = client.runs > client.done and inside.now - client.last > STUCK_AFTER
        if client.kind == "client" and waited and not client.destroyed:
            services = inside.observer.services()
            if client.name not in services:
                return _nobody_offers(client, services, f"`{inside.name}` sent a request to ")
    return None


def asks_another_type(inside: Inside) -> Reason | None:
    """Must have seen: an unanswered request, sent a while ago, and the service on the graph with another type only."""
    for client in inside.things.values():
        waited = client.runs > client.done and inside.now - client.last > STUCK_AFTER
        if client.kind == "client" and waited and not client.destroyed:
            offered = inside.observer.services().get(client.name, [])
            asked = inside.observer.clients(client.node).get(client.name, [])
            if offered and asked and not set(asked) & set(offered):
                return WRONG_TYPE(
                    f"`{inside.name}` calls the service `{client.name}` with the type {asked[0]}, but the service has "
                    f"the type {offered[0]}. Therefore its requests do not arrive.",
                    "A client reaches a server only if both use the same name and the same type.",
                )
    return None


def _nobody_offers(
    client: Thing, services: dict[str, list[str]], said: str, else_do: str = "", alone: str = _WITH_A_LIMIT
) -> Reason:
    own = ("rcl_interfaces/", "type_description")  # the services that every node offers by default
    close = nearest(client.name, [n for n, types in services.items() if not types[0].startswith(own)])
    given = f" (`{client.given}` in the code)" if client.given and client.given != client.name else ""
    return WAITS_FOR_SERVICE(
        f"{said}the service `{client.name}`{given}, but no node offers this service"
        + (f"; the nearest name is `{close}`." if close else "."),
        alone
        if not close
        else "The name in the code begins with a slash, so the namespace does not apply to it. Remove the slash."
        if client.given.startswith("/") and close.endswith(client.given)
        else f"Compare the names, namespace included.{else_do}",
    )


def nested_spin(inside: Inside) -> Reason | None:
    """Must have seen: a callback that spins, and one of three consequences.

    Either the callback has not returned since, or its node is in no spinning executor now, or the spinning ended before
    its future was done.
    """
    for call in inside.calls:
        if call.what == "spin" and call.in_callback and (harm := _harm_of_spinning(inside, call)):
            return NESTED_SPIN(
                f"{_at(inside, call)}this call spins inside a callback: {harm}",
                "Never spin inside a callback: use `call_async` and a done callback, or `await`.",
            )
    return None


def _harm_of_spinning(inside: Inside, call: Call) -> str:
    callback = inside.things.get(call.callback)
    within = bool(callback and callback.running)
    lost = bool(callback and callback.node and not inside.spinning(callback.node))
    if call.blocks or (within and not lost):
        return (
            "the callback has not returned since then. The event for which it spins cannot happen while the callback "
            "occupies its thread and its group."
        )
    if lost:
        return "this removes the node from the executor that runs it, so the node's other callbacks no longer run."
    if call.vain:
        times = "once" if call.vain == 1 else f"{call.vain} times"
        return (
            f"the call returned {times} before its future was done. If the callback for the response is in the same "
            "group as the callback that spins, each waits for the other."
        )
    return ""


def rate_in_callback(inside: Inside) -> Reason | None:
    """Must have seen: `rate.sleep()` in a callback that has not returned, and every thread of the executor occupied."""
    for call in _blocked(inside, "rate.sleep"):
        callback = inside.things.get(call.callback)
        executor = inside.executor_of(callback.node) if callback else None
        if executor and executor.busy >= executor.size:
            return RATE_IN_CALLBACK(
                f"{_at(inside, call)}`rate.sleep()` inside a callback waits for a timer that only the executor can "
                "run, and no thread of the executor is free while the callback waits: a deadlock.",
                "Use a timer for what must happen periodically.",
            )
    return None


def rate_unspun(inside: Inside) -> Reason | None:
    """Must have seen: `rate.sleep()` outside a callback that has not returned, and no executor that spins."""
    for call in inside.calls:
        spun = any(executor.spinning for executor in inside.executors)
        if call.what == "rate.sleep" and not call.in_callback and call.blocks and not spun and not _foreign(inside):
            return RATE_UNSPUN(
                f"{_at(inside, call)}`rate.sleep()` waits for a timer of the node, but nothing spins the node "
                "meanwhile.",
                "Spin the node in another thread, or better: use a timer and `rclpy.spin`.",
            )
    return None


def _foreign(inside: Inside) -> bool:
    return any(node.foreign for node in inside.nodes.values())


def await_same_group(inside: Inside) -> Reason | None:
    """Must have seen: a callback that awaits a client's response now, and both in one mutually exclusive group."""
    for thing in inside.things.values():
        client = inside.things.get(thing.awaits.client)
        if not thing.running or not client or not thing.exclusive or client.group_id != thing.group_id:
            continue
        where = thing.awaits
        return AWAIT_SAME_GROUP(
            f"`{inside.name}`, {where.line} (`{where.code}`): the client is in the same mutually exclusive group as "
            "the callback that awaits its response. The group is occupied until the callback ends, so the response is "
            "never processed.",
            _OWN_GROUP,
        )
    return None


def busy_wait(inside: Inside) -> Reason | None:
    """Must have seen: a callback in the same loop all the time, which checks a future, and a response not processed."""
    for thing, since, place in _stuck(inside):
        asked = [client for client in inside.things.values() if client.kind == "client" and client.runs > client.done]
        if not place.loop or ".done()" not in place.loop or not asked:
            continue
        executor = inside.executor_of(thing.node)
        same = asked[0].exclusive and asked[0].group_id == thing.group_id
        if same or (executor and executor.busy >= executor.size):
            why = "the client is in the same exclusive group" if same else "no thread is free for it"
            return BUSY_WAIT(
                f"`{inside.name}`: a callback has been waiting for a future in {place} for {since:.1f} s. While this "
                f"callback runs, its response cannot be processed, because {why}. So the future is never done.",
                "Let the callback return. Use `future.add_done_callback(...)` for what has to happen after the "
                "response has arrived, or `await` with the client in another group.",
            )
    return None


def takes_turn(inside: Inside) -> Reason | None:
    """Must have seen: one long run of a callback, and its thread waiting for a lock at each look."""
    for thing, since, _ in _stuck(inside):
        for _, thread in thing.running:
            place = inside.turn(thread)
            if not place:
                continue
            what = inside.source.taken(place.first)
            noun = inside.source.noun(what)
            waits = f"`{inside.name}`: {called(thing)} has been waiting in {place} for {since:.1f} s, because "
            if line := inside.held_since(thread, what):
                return WAITS_FOR_LOCK(
                    f"{waits}it already holds this {noun}, which it took in line {line}: it waits for itself.",
                    "Take it only once, or use a `threading.RLock`, which one thread may take again.",
                )
            hint = ONE_LOCK if noun == "lock" else "Whoever takes it has to release it, also after an error."
            if inside.source.by_hand(what):
                hint = (
                    "Whoever takes it has to release it, on every path and also after an error: "
                    f"`with {what}:` does so."
                )
            return WAITS_FOR_LOCK(
                f"{waits}{f'the {noun} that it needs' if noun else 'what it takes there'} is not free.", hint
            )
    return None


def stuck(inside: Inside) -> Reason | None:
    """Must have seen: one long run of a callback, and its thread in the same line or loop of the student's code."""
    for thing, since, place in _stuck(inside):
        return STUCK_CALLBACK(
            f"`{inside.name}`: {called(thing)} has been running one callback for {since:.1f} s. It is in {place}.",
            "A callback has to return. Until then it occupies its thread, and also its group if the group is mutually "
            "exclusive.",
        )
    return None


def _stuck(inside: Inside) -> list[tuple[Thing, float, Place]]:
    """Return the long runs, each with its age and its place. An execute callback is left out: it may take long."""
    found = []
    for thing in inside.things.values():
        if thing.kind == "execute":
            continue
        for began, thread in thing.running:
            age = inside.now - began
            if age < STUCK_AFTER or thing.awaits.line:
                continue
            place = inside.place(thread)
            if place is not None:
                found.append((thing, age, place))
    return found
