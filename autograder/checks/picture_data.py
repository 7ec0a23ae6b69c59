"""What a launch shows of itself, as the pictures want it, and the picture that explains a reason."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

from autograder import pictures
from autograder.diagnosis.inside import Inside
from autograder.graph.names import UNKNOWN_NODE, node_of
from autograder.graph.observer import Observer
from autograder.graph.qos import describe, mismatch_between
from autograder.pictures import Endpoint, Picture, Run, Runs, Traffic
from autograder.reasons import Reason
from autograder.sandbox.inside.probe.events import Ran, Thing

_OUTSIDE = "not in your code"
"""The name of a callback about which nothing else is known; short enough for the labels of a timeline."""
_GET_STATE = "/get_state"
"""The end of the name of the service that only a lifecycle node has."""
_UNKNOWN = "(node not known yet)"
"""The name of a node whose ends have already been discovered, but not the node itself."""
_OF_EVERY_NODE = ("/rosout", "/parameter_events")
_MOST = 60
"""Nodes, and ends of topics, of one picture."""


@dataclass(frozen=True)
class Graph:
    """Nodes and ends of topics at one moment."""

    nodes: Sequence[str]
    endpoints: Sequence[Endpoint]
    lifecycle: Set[str]
    """Those nodes that are lifecycle nodes."""


def graph(observer: Observer) -> Graph:
    """Look at the graph.

    What every node has by itself is left out, and so are hidden nodes: a command of `ros2` that looked at the graph is
    one, and stays on it for a while after its end. The topics of an action are one thing.
    """
    ends = []
    for topic in sorted(observer.topics()):
        if topic in _OF_EVERY_NODE or topic.endswith("/transition_event"):
            continue
        for publishes, found in ((True, observer.publishers(topic)), (False, observer.subscriptions(topic))):
            for end in found:
                node = node_of(end) if end.node_name != UNKNOWN_NODE else _UNKNOWN
                if not _hidden(node):
                    ends.append(_endpoint(node, topic, publishes, describe(end.qos_profile)))
    # An action has two topics, each of which has these ends. Several ends of one node on a topic are kept.
    actions = {(end.node, end.topic, end.publishes): end for end in ends if end.action}
    ends = [*(end for end in ends if not end.action), *actions.values()]
    nodes = [node for node in observer.nodes() if not _hidden(node)]
    states = {name.removesuffix(_GET_STATE) for name in observer.services() if name.endswith(_GET_STATE)}
    return Graph(nodes[:_MOST], ends[:_MOST], states)


def _hidden(node: str) -> bool:
    """Whether a name is hidden: the tools of ROS 2 list a node whose name begins with an underscore only with `-a`."""
    return node.rpartition("/")[2].startswith("_")


def _endpoint(node: str, topic: str, publishes: bool, policies: Mapping[str, str | float | None]) -> Endpoint:
    action, inner, _ = topic.partition("/_action/")
    # A server publishes the feedback and the status of its goals, and a client subscribes to them.
    return Endpoint(node, action, publishes, action=True) if inner else Endpoint(node, topic, publishes, policies)


def mismatch(offer: Endpoint, request: Endpoint) -> str | None:
    """Over which policy a publisher and a subscription do not match; None if they do."""
    return mismatch_between(offer.policies, request.policies)


def runs(insides: Iterable[Inside]) -> Runs:
    """What the callbacks of these programs did."""
    return Runs(run for inside in insides for run in _runs_of(inside))


def _runs_of(inside: Inside) -> list[Run]:
    names, groups = _names(inside), _groups(inside)
    told = sorted((run for event in inside.all(Ran) for run in event.runs), key=lambda run: run[1])
    last = inside.now if inside.program.running() else max((end for _, _, end, _ in told), default=0.0)
    under_way = [
        (thing.id, began, max(last, began), thread)
        for thing in inside.things.values()
        for began, thread in thing.running
    ]
    going_on = set(under_way)
    only = next(iter(inside.nodes)) if len(inside.nodes) == 1 else ""
    numbers: dict[int, int] = {}
    found = []
    for number, began, ended, thread in [*told, *under_way]:
        thing = inside.things.get(number)
        if thing is None or thing.kind in ("publisher", "client"):
            continue
        on = numbers.setdefault(thread, len(numbers) + 1)
        over = (number, began, ended, thread) not in going_on
        group = _OF_KIND.get(thing.kind) or groups.get(thing.group_id, "")
        known = bool(_name(thing))
        found.append(
            Run(names[number], began, ended, on, group, thing.node or only, over, inside.name, thing.period, known)
        )
    return found


def _names(inside: Inside) -> dict[int, str]:
    """A name for each callback: its function's, or what it belongs to; those of one name in one node are numbered."""
    plain = {thing.id: (thing.node, _name(thing) or _OUTSIDE) for thing in inside.things.values()}
    total, so_far = Counter(plain.values()), Counter[tuple[str, str]]()
    names = {}
    for number, name in plain.items():
        so_far[name] += 1
        names[number] = f"{name[1]} ({so_far[name]})" if total[name] > 1 else name[1]
    return names


_OF_KIND = {"execute": "outside of all groups", "task": "outside of all groups", "": "group not known"}
"""What stands for the group of a callback whose kind says it. rclpy runs the execute callback of an action as a task of
the executor, whatever the server's group is. The probe sees no group of a callback such as that for feedback."""


def _name(thing: Thing) -> str:
    """Return what a callback is called; empty if nothing is known about it."""
    function = re.match(r"(?:async )?def (\w+)", thing.code)
    if function:
        return function[1]
    if thing.kind == "timer":
        return f"timer {thing.period:g} s"
    if thing.kind == "action_server":  # each of its runs is one feedback message
        return f"feedback of {thing.name}"
    return f"{thing.kind} {thing.name}".strip() or (f"callback in {thing.line}" if thing.line else "")


def _groups(inside: Inside) -> dict[int, str]:
    """A name for each callback group."""
    found: dict[int, Thing] = {}
    for thing in inside.things.values():
        if thing.group_id and thing.kind != "client":
            found.setdefault(thing.group_id, thing)
    own: dict[str, list[int]] = {}
    for number, thing in found.items():
        if not thing.default_group:
            own.setdefault("exclusive group" if thing.exclusive else "reentrant group", []).append(number)
    names = {number: "default group (exclusive)" for number, thing in found.items() if thing.default_group}
    for kind, numbers in own.items():
        names |= {g: f"{kind} {n}" if len(numbers) > 1 else kind for n, g in enumerate(numbers, 1)}
    return names


def traffic(insides: Sequence[Inside], topic: str) -> list[Traffic]:
    """When messages of a topic were published, and when subscriptions' callbacks got them, publishers first.

    Several ends of one node are numbered, in the order in which they were made.
    """
    rows: dict[str, list[Traffic]] = {"publisher": [], "subscription": []}
    for inside in insides:
        began: dict[int, list[float]] = {number: [] for number in inside.things}
        for event in inside.all(Ran):
            for number, begin, _, _ in event.runs:
                if number in began:
                    began[number].append(begin)
        for thing in inside.things.values():
            if thing.kind in rows and thing.name == topic:
                verb = "publishes" if thing.kind == "publisher" else "takes"
                node = inside.nodes.get(thing.node)
                since = node.made if node and node.made else None
                rows[thing.kind].append(Traffic(f"{thing.node} {verb}", sorted(began[thing.id]), since, thing.runs))
    found = rows["publisher"] + rows["subscription"]
    total, so_far = Counter(row.who for row in found), Counter[str]()
    for number, row in enumerate(found):
        so_far[row.who] += 1
        if total[row.who] > 1:
            found[number] = replace(row, who=f"{row.who} ({so_far[row.who]})")
    return found


def explaining(reason: Reason, title: str, observer: Observer, insides: Sequence[Inside]) -> Picture | None:
    """The picture that shows why an expectation failed; None where none does.

    Args:
        reason: why; a topic's name in it is the one that is meant.
        title: the expectation in words, which may name the topic as well.
        observer: of the launch.
        insides: of its programs.
    """
    if reason.kind.picture == "timeline":
        found = runs(insides)
        return pictures.timeline(found) if found else None
    if reason.kind.picture == "qos":
        on_graph = graph(observer).endpoints
        for name in re.findall(r"`(/[^`\s]*)`", f"{title} {reason.because}"):
            ends = [end for end in on_graph if end.topic == name]
            pairs = [(one, other) for one in ends if one.publishes for other in ends if not other.publishes]
            if any(mismatch(*pair) for pair in pairs):  # the other end may be the check's own, which is not shown
                return pictures.qos(name, ends, mismatch)
    return None
