"""Draws the ROS graph, and whether the QoS profiles of publishers and subscriptions match."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, TEXT, WIDTH, Canvas, shortened, width_of


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription of a node."""

    node: str
    topic: str
    publishes: bool
    policies: Mapping[str, str | float | None] = field(default_factory=dict)
    """The QoS policies that the graph shows, as words or seconds; None means that there is no such limit."""

    def words(self) -> str:
        """Describe its policies in a few words, without the durability volatile and without limits that are not set."""
        return ", ".join(filter(None, [str(self.policies.get("reliability") or "").replace("_", " "), *self.unusual()]))

    def unusual(self) -> list[str]:
        """Describe in a few words each policy, except the reliability, that differs from the default."""
        said = []
        if self.policies.get("durability") == "transient_local":
            said.append("transient local")
        for name in ("deadline", "lifespan", "lease"):
            value = self.policies.get(name)
            if isinstance(value, float):
                said.append(f"{name} {value:g} s")
        if self.policies.get("liveliness") == "manual_by_topic":
            said.append("manual liveliness")
        return said


_ROW, _LOW_ROW, _FEW = 84.0, 62.0, 4
"""The height of a row, its height if there are many rows, and the number from which they count as many."""
Mismatch = Callable[[Endpoint, Endpoint], str | None]


def graph(
    nodes: Iterable[str], endpoints: Iterable[Endpoint], mismatch: Mismatch = lambda offer, request: None
) -> Picture:
    """Draw nodes (ovals), topics (boxes), and an arrow for each publisher and each subscription.

    An arrow without words means reliable and volatile, without limits; a dashed line means best effort.

    Args:
        nodes: the full names of all nodes, including those without a topic.
        endpoints: the publishers and subscriptions.
        mismatch: returns the policy because of which a publisher and a subscription on one topic do not match, or None
            if they match. A subscription that matches no publisher on its topic is crossed out.
    """
    everyone = list(endpoints)
    ends = list(dict.fromkeys((end.node, end.topic, end.publishes) for end in everyone))
    names = list(dict.fromkeys([*sorted(nodes), *(node for node, _, _ in ends)]))
    layers = _layers(names, ends)
    columns: dict[int, list[tuple[str, str]]] = {}
    for thing, layer in layers.items():
        columns.setdefault(layer, []).append(thing)
    rows = max((len(column) for column in columns.values()), default=1)
    height = max(rows, 1) * (_ROW if rows <= _FEW else _LOW_ROW) + 30
    canvas = Canvas(height, WIDTH)
    places = _places(columns, height)
    for (kind, name), (x, y, width) in places.items():
        draw = canvas.oval if kind == "node" else canvas.box
        draw(x - width / 2, y - 21, width, 42)
        canvas.words(x, y + 6, shortened(name, width - 14), size=TEXT, anchor="middle")
    for one in ends:
        own = [end for end in everyone if (end.node, end.topic, end.publishes) == one]
        _arrow(canvas, places, own, everyone, mismatch)
    if not names:
        canvas.words(30, height / 2, "no node is on the graph", italic=True)
    return canvas.picture(_alt(names, everyone, mismatch))


def _layers(nodes: Sequence[str], ends: Sequence[tuple[str, str, bool]]) -> dict[tuple[str, str], int]:
    """Return a column for each node and topic: a topic is right of its publishers, and its subscribers right of it."""
    layers = {("node", node): 0 for node in nodes} | {("topic", topic): 1 for _, topic, _ in ends}
    for _ in range(len(nodes)):  # this ends even if the nodes form a cycle
        before = dict(layers)
        for node, topic, publishes in ends:
            source, target = (("node", node), ("topic", topic)) if publishes else (("topic", topic), ("node", node))
            layers[target] = max(layers[target], min(layers[source] + 1, 8))
        if layers == before:
            break
    used = sorted(set(layers.values()))
    return {thing: used.index(layer) for thing, layer in layers.items()}


def _places(
    columns: Mapping[int, Sequence[tuple[str, str]]], height: float
) -> dict[tuple[str, str], tuple[float, float, float]]:
    """Return the centre and the width of each node and topic."""
    places = {}
    count = max(columns, default=0) + 1
    room = WIDTH / count
    for layer, things in columns.items():
        for number, thing in enumerate(things):
            width = min(max(width_of(thing[1]) + 34, 90), room * (0.78 if count < 4 else 0.62))
            y = height * (number + 0.5) / len(things)
            left, right = width / 2 + 6, WIDTH - width / 2 - 6
            x = left if layer == 0 else right if layer == count - 1 else room * (layer + 0.5)
            places[thing] = (x if count > 1 else WIDTH / 2, y, width)
    return places


def _arrow(
    canvas: Canvas,
    places: Mapping[tuple[str, str], tuple[float, float, float]],
    own: Sequence[Endpoint],
    everyone: Sequence[Endpoint],
    mismatch: Mismatch,
) -> None:
    end = own[0]
    node, topic = places["node", end.node], places["topic", end.topic]
    (x1, y1, w1), (x2, y2, w2) = (node, topic) if end.publishes else (topic, node)
    forth = x2 > x1
    begin = (x1 + (w1 / 2 if forth else -w1 / 2), y1)
    goal = (x2 + (-w2 / 2 if forth else w2 / 2), y2)
    if x1 == x2:
        begin, goal = (x1, y1 + 21), (x2, y2 - 21)
    broken = _refused(end, everyone, mismatch)
    canvas.line([begin, goal], arrow=True, dashed=end.policies.get("reliability") == "best_effort")
    x, y = (begin[0] + goal[0]) / 2, (begin[1] + goal[1]) / 2
    pieces = [*(["best effort"] if end.policies.get("reliability") == "best_effort" else []), *end.unusual()]
    pieces += [f"{len(own)} times"] if len(own) > 1 else []
    for number, piece in enumerate(pieces):
        canvas.words(x, y - 10 - SMALL * (len(pieces) - 1 - number), piece, size=SMALL, anchor="middle", halo=True)
    if broken:
        canvas.words(x, y + 11, "✗", size=26, anchor="middle", bold=True, halo=True)
        canvas.words(x, y + 28, broken, size=SMALL, anchor="middle", halo=True)


def _refused(end: Endpoint, everyone: Sequence[Endpoint], mismatch: Mismatch) -> str:
    """Return the policy because of which a subscription matches no publisher on its topic, or "" if it matches one."""
    if end.publishes:
        return ""
    offers = [other for other in everyone if other.publishes and other.topic == end.topic]
    reasons = [mismatch(offer, end) for offer in offers]
    return (reasons[0] or "") if reasons and all(reasons) else ""


def _alt(nodes: Sequence[str], endpoints: Sequence[Endpoint], mismatch: Mismatch) -> str:
    if not nodes:
        return "Graph: there is no node."
    told = [f"Graph of {len(nodes)} node{'s' * (len(nodes) != 1)}: {', '.join(nodes)}."]
    for end in endpoints:
        refused = _refused(end, endpoints, mismatch)
        verb = "publishes on" if end.publishes else "subscribes to"
        quality = f" ({end.words()})" if end.words() else ""
        told.append(f"{end.node} {verb} {end.topic}{quality}{f', no match: {refused}' if refused else ''}.")
    return " ".join(told)


_MATCH_ROW = 62.0


def qos(topic: str, endpoints: Sequence[Endpoint], mismatch: Mismatch) -> Picture:
    """Draw a table with the offers of publishers at the left and the requests of subscriptions at the top.

    Args:
        topic: the full name of the topic.
        endpoints: the publishers and subscriptions on that topic.
        mismatch: returns the policy because of which a publisher and a subscription do not match, or None if they
            match.
    """
    offers = [end for end in endpoints if end.publishes]
    requests = [end for end in endpoints if not end.publishes]
    left, head = 290.0, 100.0
    column = (WIDTH - left - 16) / max(1, len(requests))
    canvas = Canvas(head + _MATCH_ROW * max(1, len(offers)) + 16, WIDTH)
    canvas.words(12, 26, topic, bold=True)
    canvas.words(12, head - 12, "offered ↓", size=SMALL)
    canvas.words(left - 14, head - 12, "requested →", size=SMALL, anchor="end")
    for number, request in enumerate(requests):
        _end(canvas, left + column * number + 8, 34, request, column - 14)
    for row, offer in enumerate(offers):
        y = head + row * _MATCH_ROW
        _end(canvas, 12, y + 24, offer, left - 24)
        for number, request in enumerate(requests):
            policy = mismatch(offer, request)
            x = left + column * number
            canvas.box(x, y, column, _MATCH_ROW, fill="#ffffff" if policy is None else "#e4e4e4")
            symbol, words = ("✓", "match") if policy is None else ("✗", policy)
            canvas.words(x + column / 2, y + 27, symbol, size=24, anchor="middle", bold=True)
            canvas.words(x + column / 2, y + 50, shortened(words, column - 8, SMALL), size=SMALL, anchor="middle")
    if not offers or not requests:
        lacks = "publisher" if not offers else "subscription"
        canvas.words(left, head + 36, f"there is no {lacks}: nothing to match", italic=True)
    return canvas.picture(_matches_in_words(topic, offers, requests, mismatch))


def _end(canvas: Canvas, x: float, y: float, end: Endpoint, room: float) -> None:
    canvas.words(x, y, shortened(end.node, room, TEXT - 1), size=TEXT - 1)
    canvas.words(x, y + SMALL + 5, shortened(end.words(), room, SMALL - 1), size=SMALL - 1, fill="#444444")


def _matches_in_words(topic: str, offers: Sequence[Endpoint], requests: Sequence[Endpoint], mismatch: Mismatch) -> str:
    told = [f"Which ends of {topic or 'the topic'} match."]
    for offer in offers:
        for request in requests:
            policy = mismatch(offer, request)
            verdict = "match" if policy is None else f"do not match: {policy}"
            told.append(f"{offer.node} ({offer.words()}) and {request.node} ({request.words()}) {verdict}.")
    if not offers or not requests:
        told.append(f"There is no {'publisher' if not offers else 'subscription'}.")
    return " ".join(told)
