"""Says why nothing, or too little, arrived on a topic, and why an existing service did not answer."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.qos import DurabilityPolicy, QoSProfile

from autograder.diagnosis import callbacks, programs
from autograder.diagnosis.chain import inside_reason
from autograder.diagnosis.inside import Inside, called, listed
from autograder.diagnosis.names import absolute_name, why_no_endpoint
from autograder.diagnosis.programs import program_trouble
from autograder.diagnosis.scene import Scene, first
from autograder.diagnosis.together import why_starved
from autograder.graph import qos
from autograder.graph.names import node_of, type_name
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import LifecyclePublishOff, Thing

QOS_RELIABILITY = Kind("qos-reliability", "offered and requested reliability do not match", Group.SILENCE, "qos")
QOS_DURABILITY = Kind("qos-durability", "offered and requested durability do not match", Group.SILENCE, "qos")
QOS_DEADLINE = Kind("qos-deadline", "offered and requested deadline do not match", Group.SILENCE, "qos")
QOS_LIVELINESS = Kind("qos-liveliness", "offered and requested liveliness do not match", Group.SILENCE, "qos")
QOS_LEASE = Kind("qos-lease", "offered and requested lease do not match", Group.SILENCE, "qos")

MISMATCH = {
    "reliability": QOS_RELIABILITY,
    "durability": QOS_DURABILITY,
    "deadline": QOS_DEADLINE,
    "liveliness": QOS_LIVELINESS,
    "lease": QOS_LEASE,
}
"""The kind of reason for each policy that can prevent two ends from matching."""


def why_not_matched(scene: Scene, topic: str, profile: QoSProfile, kind: str) -> Reason | None:
    """Must have seen: a student's `kind` on the topic whose QoS does not match an endpoint with `profile`.

    `kind` is "publisher" or "subscription".
    """
    ends = scene.observer.publishers(topic) if kind == "publisher" else scene.observer.subscriptions(topic)
    for end in ends:
        offered, requested = (end.qos_profile, profile) if kind == "publisher" else (profile, end.qos_profile)
        policy = qos.first_mismatch(offered, requested)
        if policy:
            words = policy.split()[0] if policy != "liveliness lease" else "lease"
            gives, wants = qos.describe(offered)[words], qos.describe(requested)[words]
            owner = node_of(end)
            return MISMATCH[words](
                f"The {policy} of the publisher on `{topic}` does not match that of the subscription: offered is "
                f"{qos.in_words(gives)}, requested is {qos.in_words(wants)}. The {kind} belongs to `{owner}`.",
                "A subscription must not request more than the publisher offers.",
            )
    return None


NO_ANSWER = Kind("no-answer", "no reason was established: what was seen is said", Group.SILENCE)
TIMER_PERIOD = Kind(
    "timer-period", "nothing published, and the node has only timers, none of which is due yet", Group.SILENCE
)
LIFECYCLE_INACTIVE = Kind(
    "lifecycle-inactive", "a lifecycle publisher that never sent a message dropped one in another state", Group.SILENCE
)
NO_SUPER_ON_ACTIVATE = Kind(
    "no-super-on-activate",
    "a lifecycle publisher that was not activated dropped a message in state active",
    Group.SILENCE,
)
LIFESPAN = Kind(
    "lifespan", "a transient local publisher's last message is older than its lifespan; nothing came", Group.SILENCE
)
SILENT = Kind("silent", "no reason was established: what was seen is said", Group.SILENCE)

_MILLISECONDS = 100
"""Seconds from which on a timer's period may have been meant in milliseconds."""

_EVERY_NODE = ("use_sim_time", "start_type_description_service")
"""The parameters that a node has without declaring them."""


def why_silent(scene: Scene, topic: str, msg_type: type, profile: QoSProfile) -> Reason:
    """Return why nothing (more) arrived on a topic: the first link that was seen to be broken, or what was seen."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    ends = [end for end in scene.observer.publishers(topic) if end.topic_type == type_name(msg_type)]
    if not ends:
        return why_no_endpoint(scene, topic, msg_type, "publisher")
    mismatch = why_not_matched(scene, topic, profile, "publisher")
    if mismatch:
        return mismatch
    node = node_of(ends[0])
    return (
        inside_reason(scene, node)
        or lifecycle_silence(scene, topic)
        or too_old(scene, topic, profile)
        or not_due(scene, topic)
        or listens_elsewhere(scene, topic)
        or why_starved(scene)
        or first((callbacks.never_awaited,), scene.inside_of(node))
        or SILENT(account(scene, topic))
    )


def lifecycle_silence(scene: Scene, topic: str = "") -> Reason | None:
    """Must have seen: a lifecycle publisher that dropped a message in state active, or has dropped all its messages.

    If `topic` is given, the publisher must be on this topic.
    """
    drops = [
        (inside, event)
        for inside in scene.insides
        for event in inside.all(LifecyclePublishOff)
        if topic in ("", event.name)
    ]
    # A timer may have published before the activation, too, so this is not the first drop of every such publisher.
    for inside, event in drops:
        if event.state == "active":
            return NO_SUPER_ON_ACTIVATE(
                f"`{inside.name}` publishes in {event.line} while it is active, but its lifecycle publisher was not "
                "switched on: `on_activate` does not call `super().on_activate(state)`, or the publisher was created "
                "after that call.",
                "Create the publisher first, best in `on_configure`, and end `on_activate` with "
                "`return super().on_activate(state)`.",
            )
    for inside, event in drops:
        sent = any(owner is inside and publisher.runs for owner, publisher in _publishers(scene, event.name))
        if not sent:
            return LIFECYCLE_INACTIVE(
                f"`{inside.name}` publishes in {event.line} while it is {event.state or 'not active'}: a lifecycle "
                "publisher drops such messages.",
                "It only sends between `on_activate` and `on_deactivate`.",
            )
    return None


def too_old(scene: Scene, topic: str, profile: QoSProfile) -> Reason | None:
    """Must have seen: a publisher that keeps messages for late joiners, all of which are older than its lifespan."""
    if profile.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        return None
    for end in scene.observer.publishers(topic):
        node, have = node_of(end), qos.describe(end.qos_profile)
        lifespan = have["lifespan"]
        for inside, publisher in _publishers(scene, topic):
            age = inside.now - publisher.last
            if have["durability"] != "transient_local" or publisher.node != node or not publisher.runs:
                continue
            if isinstance(lifespan, float) and lifespan < age:
                return LIFESPAN(
                    f"`{inside.name}` published {publisher.runs} message{'s' * (publisher.runs > 1)} on `{topic}`, "
                    f"{'the last one ' * (publisher.runs > 1)}{age:.1f} s ago. The publisher's lifespan is "
                    f"{qos.in_words(lifespan)}, so it keeps no message for a subscription that is created later than "
                    "that.",
                    "A publisher without a lifespan keeps its last messages for late joiners.",
                )
    return None


def not_due(scene: Scene, topic: str) -> Reason | None:
    """Must have seen: a node that has published nothing on a topic, and has only timers, of which none is due yet."""
    for inside, publisher in _publishers(scene, topic):
        found = None if publisher.runs else _no_timer_due(inside, publisher.node)
        if found:
            return found
    return None


def _no_timer_due(inside: Inside, node: str) -> Reason | None:
    """Must have seen: a running program, and a node of it that has only timers, of which none is due yet."""
    callbacks = [thing for thing in inside.callbacks if thing.node == node and not thing.cancelled]
    late = [thing for thing in callbacks if thing.kind == "timer" and not thing.runs and thing.period > inside.age]
    if not inside.alive or not late or len(late) < len(callbacks):
        return None
    period = late[0].period
    meant = f" For {period:g} milliseconds, write `{period / 1000:g}`." * (period >= _MILLISECONDS)
    return TIMER_PERIOD(
        f"`{inside.name}`: {called(late[0])} has not fired yet; the program has run for {inside.age:.0f} s.",
        f"`create_timer` takes its period in seconds.{meant}",
    )


def listens_elsewhere(scene: Scene, topic: str) -> Reason | None:
    """Must have seen: a node that has published nothing on a topic, and a subscription of it that got nothing: nobody
    publishes under its name, which is absolute, but somebody does under this name in the node's namespace.
    """
    for inside, publisher in _publishers(scene, topic):
        space = publisher.node.rpartition("/")[0]
        for thing in [] if publisher.runs else inside.callbacks:
            unheard = (thing.kind, thing.node, thing.runs) == ("subscription", publisher.node, 0)
            unsaid = unheard and thing.given.startswith("/") and not scene.observer.publishers(thing.name)
            if unsaid and scene.observer.publishers(space + thing.given):
                return absolute_name(scene, "subscription", thing.name)
    return None


def nothing_due(scene: Scene, node: str) -> Reason | None:
    """Must have seen: a running node that has only timers, of which none is due yet."""
    return first((lambda inside: _no_timer_due(inside, node),), scene.insides)


def paces(scene: Scene, topic: str) -> str:
    """Describe what determines how often messages come on a topic: timers, and given but undeclared parameters."""
    said = []
    for number, inside in enumerate(scene.insides):
        nodes = {thing.node for thing in inside.things.values() if thing.kind == "publisher" and thing.name == topic}
        timers = [t for t in inside.callbacks if t.kind == "timer" and t.node in nodes and not t.cancelled and t.runs]
        if not inside.attached or not timers:
            continue
        said.append(f"`{inside.name}` runs {listed(timers[:6])}.")
        declared = {parameter.name for parameter in inside.parameters if parameter.declared}
        given = scene.parameters[number] if number < len(scene.parameters) else ()
        lost = [name for name in given if name not in declared]
        own = sorted(name for name in declared if name not in _EVERY_NODE and "qos_overrides" not in name)
        if lost and inside.parameters:
            said.append(
                f"It was given {_quoted(lost)}, which it has not declared"
                + (f" (it has {_quoted(own)})." if own else " (it has declared none).")
            )
    return " ".join(said)


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _publishers(scene: Scene, topic: str) -> list[tuple[Inside, Thing]]:
    return [
        (inside, thing)
        for inside in scene.insides
        for thing in inside.things.values()
        if thing.kind == "publisher" and thing.name == topic and not thing.destroyed
    ]


def account(scene: Scene, topic: str) -> str:
    """Describe what was seen of a silent publisher, and thus ruled out, for when no reason is established."""
    found = _publishers(scene, topic)
    said = [f"The publisher on `{topic}` exists"]
    if not found or not all(inside.alive for inside, _ in found):
        # The probe does not see publishers that rcl creates, such as that of /rosout, so every node's runs are listed.
        said += [text for inside in scene.insides if inside.alive for text in _runs(inside)][:6]
        return f"{', '.join(said)}, but no (further) message arrived from it."
    inside, publisher = found[0]
    said += [f"its node `{publisher.node}` is spun", *_runs(inside, publisher.node)[:6]]
    sent = {0: "no message was published", 1: "one message was published"}.get(
        publisher.runs, f"{publisher.runs} messages were published"
    )
    if publisher.runs:
        sent += f", {'the last one ' * (publisher.runs > 1)}{inside.now - publisher.last:.1f} s ago"
    return f"{', '.join(said)}, {'and' if publisher.runs else 'but'} {sent}."


def _runs(inside: Inside, node: str = "") -> list[str]:
    """Describe how often each callback ran, of one node or of all nodes of the program."""
    stopped = " and is cancelled until `reset()` is called"
    return [
        f"{called(thing)} {_ran(thing.kind, thing.runs)}{stopped * thing.cancelled}"
        for thing in inside.callbacks
        if not node or thing.node == node
    ]


def _ran(kind: str, runs: int) -> str:
    """Say how often a callback of this kind ran, as the end of a sentence."""
    if kind == "timer":
        return {0: "has not fired", 1: "fired once"}.get(runs, f"fired {runs} times")
    came = "message" if kind == "subscription" else "request"
    return {0: f"got no {came}", 1: f"got one {came}"}.get(runs, f"got {runs} {came}s")


def why_no_answer(scene: Scene, name: str) -> Reason:
    """Return why an existing service did not answer."""
    owner = _owner(scene, name)
    trouble = program_trouble(scene)
    if trouble and trouble.kind is programs.EXITED and any(owner in one.nodes and one.alive for one in scene.insides):
        trouble = None  # another program has done its work and has ended
    found = trouble or inside_reason(scene, owner)
    if found:
        return found
    insides = [inside for inside in scene.inside_of(owner) if inside.alive]
    found = first((programs.cannot_answer,), insides) or why_starved(scene)
    if found:
        return found
    for inside in insides:
        for thing in inside.things.values():
            if thing.kind == "service" and thing.name == name:
                ran = {0: "has not run", 1: "ran once"}.get(thing.runs, f"ran {thing.runs} times")
                ended = "" if thing.done == thing.runs else f", and {thing.runs - thing.done} of these runs did not end"
                return NO_ANSWER(
                    f"The service `{name}` exists and its node is spun, but no response arrived. Its callback "
                    f"{ran}{' and did not end' if thing.runs == 1 and ended else ended}.",
                )
    return NO_ANSWER(f"The service `{name}` exists, but no response arrived.")


def _owner(scene: Scene, name: str) -> str:
    """Return the node that offers a service, according to a probe or else to the service's name.

    The name shows the node for the services that every node has.
    """
    for inside in scene.insides:
        for thing in inside.things.values():
            if thing.kind == "service" and thing.name == name:
                return thing.node
    return name.rpartition("/")[0]
