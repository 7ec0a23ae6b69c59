"""Draws the ROS graph, and whether the QoS profiles of publishers and subscriptions match."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from autograder.core.results import Picture
from autograder.pictures.svg import SMALL, WIDTH, Canvas, in_lines, shortened, width_of


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription of a node."""

    node: str
    topic: str
    publishes: bool
    policies: Mapping[str, str | float | None] = field(default_factory=dict)
    """The QoS policies that the graph shows, as words or seconds; None means that there is no such limit."""
    action: bool = False
    """Whether it is an action's server (which publishes) or a client of it; `topic` is then the name of the action."""

    def words(self) -> str:
        """Describe its policies in a few words, without the durability volatile and without limits that are not set."""
        return ", ".join(filter(None, [str(self.policies.get("reliability") or "").replace("_", " "), *self.unusual()]))

    def value(self, policy: str) -> str:
        """Describe one policy, by the name that a mismatch has, in a few words."""
        value = self.policies.get("lease" if policy == "liveliness lease" else policy)
        if isinstance(value, float):
            return f"{value:g} s"
        return str(value).replace("_", " ").removesuffix(" by topic") if value else "no limit"

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


_HALF = 23.0
"""Half the height of a node and of a topic."""
_TWO = 14.0
"""The size of a name that takes several lines."""
_MANY = 4
"""The number of columns from which they are narrow."""
_ROW, _LOW_ROW, _FEW = 84.0, 66.0, 4
"""The height of a row, its height if there are many rows, and the number from which they count as many."""
Mismatch = Callable[[Endpoint, Endpoint], str | None]


def graph(
    nodes: Iterable[str], endpoints: Iterable[Endpoint], mismatch: Mismatch = lambda offer, request: None
) -> Picture:
    """Draw nodes (ovals), topics (boxes), and an arrow for each publisher and each subscription.

    An arrow without words means reliable and volatile, without limits; a dashed line means best effort. An action is a
    round box between its clients and its server; its arrows show the way of the goals.

    Args:
        nodes: the full names of all nodes, including those without a topic.
        endpoints: the publishers and subscriptions.
        mismatch: returns the policy because of which a publisher and a subscription on one topic do not match, or None
            if they match. A subscription that matches no publisher on its topic is crossed out.
    """
    everyone = list(endpoints)
    # Goals go from a client through the action to the server, so that a client is drawn like a publisher.
    ends = list(dict.fromkeys((end.node, end.topic, end.publishes != end.action) for end in everyone))
    actions = {end.topic for end in everyone if end.action}
    names = list(dict.fromkeys([*sorted(nodes), *(node for node, _, _ in ends)]))
    layers = _layers(names, ends)
    columns: dict[int, list[tuple[str, str]]] = {}
    for thing, layer in layers.items():
        columns.setdefault(layer, []).append(thing)
    rows = max((len(column) for column in columns.values()), default=1)
    words = max((len(_pieces(end, 1)) + 2 * bool(_refused(end, everyone, mismatch)) for end in everyone), default=0)
    many = max(columns, default=0) >= _MANY
    half = _HALF + 7 * many  # a name takes up to three lines where there are many columns
    height = max(rows, 1) * max(_ROW if rows <= _FEW else _LOW_ROW, 20 + words * (SMALL + 4)) + 30
    canvas = Canvas(height, WIDTH)
    places = _places(columns, height)
    for (kind, name), (x, y, width) in places.items():
        if kind == "node":
            canvas.oval(x - width / 2, y - half, width, 2 * half)
        elif name in actions:
            canvas.box(x - width / 2, y - half, width, 2 * half, round=half / 2, line=2.6)
            canvas.words(x, y - half - 7, "action", size=SMALL, anchor="middle", italic=True)
        else:
            canvas.box(x - width / 2, y - half, width, 2 * half)
        _label(canvas, x, y, name, width - (26 if kind == "node" and not many else 10), 3 if many else 2)
    for one in ends:
        own = [end for end in everyone if (end.node, end.topic, end.publishes != end.action) == one]
        _arrow(canvas, places, own, everyone, mismatch)
    if not names:
        canvas.words(30, height / 2, "no node is on the graph", italic=True)
    return canvas.picture(_alt(names, everyone, mismatch))


def _label(canvas: Canvas, x: float, y: float, name: str, room: float, most: int) -> None:
    """Write a name around a point, in at most so many smaller lines if it is long."""
    if width_of(name) <= room:
        canvas.words(x, y + 6, name, anchor="middle")
        return
    size = _TWO if most == 2 else _TWO - 1
    lines = in_lines(name, room, size, most)
    for number, line in enumerate(lines):
        canvas.words(x, y + 5 + (number - (len(lines) - 1) / 2) * (size + 2), line, size=size, anchor="middle")


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
            width = min(max(width_of(thing[1]) + 34, 90), room * (0.66 if count == _MANY else 0.78))
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
    leaves_node = end.publishes != end.action
    (x1, y1, w1), (x2, y2, w2) = (node, topic) if leaves_node else (topic, node)
    forth = x2 > x1
    begin = (x1 + (w1 / 2 if forth else -w1 / 2), y1)
    goal = (x2 + (-w2 / 2 if forth else w2 / 2), y2)
    if x1 == x2:
        begin, goal = (x1, y1 + _HALF * (1 if y2 > y1 else -1)), (x2, y2 - _HALF * (1 if y2 > y1 else -1))
    broken = _refused(end, everyone, mismatch)
    canvas.line([begin, goal], arrow=True, dashed=end.policies.get("reliability") == "best_effort")
    near, far = (begin, goal) if leaves_node else (goal, begin)  # at the topic, several arrows meet
    x, y = near[0] + _AWAY * (far[0] - near[0]), near[1] + _AWAY * (far[1] - near[1])
    pieces = _pieces(end, len(own))
    for number, piece in enumerate(pieces):
        canvas.words(x, y - 10 - SMALL * (len(pieces) - 1 - number), piece, size=SMALL, anchor="middle", halo=True)
    if broken:
        canvas.words(x, y + 11, "✗", size=26, anchor="middle", bold=True, halo=True)
        canvas.words(x, y + 28, broken, size=SMALL, anchor="middle", halo=True)


def _pieces(end: Endpoint, times: int) -> list[str]:
    """Return what an arrow says."""
    if end.action:
        pieces = ["server" if end.publishes else "client"]
    else:
        pieces = [*(["best effort"] if end.policies.get("reliability") == "best_effort" else []), *end.unusual()]
    return [*pieces, *([f"{times} times"] if times > 1 else [])]


_AWAY = 0.36
"""How far from its node the words of an arrow stand, as a part of the arrow."""


def _refused(end: Endpoint, everyone: Sequence[Endpoint], mismatch: Mismatch) -> str:
    """Return the policy because of which a subscription matches no publisher on its topic, or "" if it matches one."""
    if end.publishes or end.action:
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
        if end.action:
            verb = "is the server of the action" if end.publishes else "is a client of the action"
        quality = f" ({end.words()})" if end.words() else ""
        told.append(f"{end.node} {verb} {end.topic}{quality}{f', no match: {refused}' if refused else ''}.")
    return " ".join(told)


_MATCH_ROW = 76.0
_LEAST_COLUMN = 120.0
"""The width from which a column of the table has the name of its subscription, and not only its number."""


def qos(topic: str, endpoints: Sequence[Endpoint], mismatch: Mismatch) -> Picture:
    """Draw a table with the offers of publishers at the left and the requests of subscriptions at the top.

    Publishers are numbered P1, P2 and so on, and subscriptions S1, S2 and so on. A cell of two that do not match names
    the policy, what is offered and what is requested.

    Args:
        topic: the full name of the topic.
        endpoints: the publishers and subscriptions on that topic.
        mismatch: returns the policy because of which a publisher and a subscription do not match, or None if they
            match.
    """
    offers = [end for end in endpoints if end.publishes]
    requests = [end for end in endpoints if not end.publishes]
    left = 290.0
    column = (WIDTH - left - 16) / max(1, len(requests))
    wide = column >= _LEAST_COLUMN
    heads = [_end_lines(f"S{number}", end, column - 14, wide) for number, end in enumerate(requests, 1)]
    head = 58 + _LINE * max(map(len, heads), default=1)
    listed = [] if wide else [f"S{number}  {end.node}: {end.words()}" for number, end in enumerate(requests, 1)]
    bottom = head + _MATCH_ROW * max(1, len(offers))
    canvas = Canvas(bottom + 16 + (SMALL + 8) * len(listed), WIDTH)
    canvas.words(12, 26, topic, bold=True)
    canvas.words(12, head - 10, "Publishers offer ↓", size=SMALL)
    canvas.words(left + 4, 26, "Subscriptions request ↓", size=SMALL)
    for number, lines in enumerate(heads):
        _write(canvas, left + column * number + 6, 50, lines)
    for row, offer in enumerate(offers):
        y = head + row * _MATCH_ROW
        canvas.line([(8, y), (left, y)], line=1, grey=True)
        _write(canvas, 12, y + 19, _end_lines(f"P{row + 1}", offer, left - 24, True))
        for number, request in enumerate(requests):
            _match(canvas, left + column * number, y, column, offer, request, mismatch(offer, request))
    if not offers or not requests:
        lacks = "publisher" if not offers else "subscription"
        canvas.words(left, head + 36, f"there is no {lacks}: nothing to match", italic=True)
    for number, line in enumerate(listed):
        canvas.words(12, bottom + (number + 1) * (SMALL + 8), shortened(line, WIDTH - 24, SMALL), size=SMALL)
    return canvas.picture(_matches_in_words(topic, offers, requests, mismatch))


_LINE = SMALL + 2.0


def _end_lines(number: str, end: Endpoint, room: float, names: bool) -> list[tuple[str, bool]]:
    """Return the lines about an end in a heading, and whether each is a name."""
    if not names:
        return [(number, True)]
    name = in_lines(f"{number} {end.node}", room, SMALL, _NAME_LINES)
    said = in_lines(end.words(), room, SMALL - 1, 2) if end.words() else []
    return [*((line, True) for line in name), *((line, False) for line in said)]


_NAME_LINES = 4
"""The most lines of a name in a heading."""


def _write(canvas: Canvas, x: float, y: float, lines: Sequence[tuple[str, bool]]) -> None:
    for number, (line, is_name) in enumerate(lines):
        at = y + number * _LINE
        if is_name:
            canvas.words(x, at, line, size=SMALL, bold=number == 0 and len(line) < 4)
        else:
            canvas.words(x, at, line, size=SMALL - 1, fill="#444444")


def _match(
    canvas: Canvas, x: float, y: float, column: float, offer: Endpoint, request: Endpoint, policy: str | None
) -> None:
    """Draw the cell of a publisher and a subscription."""
    centre = x + column / 2
    canvas.box(x, y, column, _MATCH_ROW, fill="#ffffff" if policy is None else "#e4e4e4")
    if policy is None:
        canvas.words(centre, y + 33, "✓", size=24, anchor="middle", bold=True)
        canvas.words(centre, y + 57, shortened("match", column - 8, SMALL), size=SMALL, anchor="middle")
        return
    narrow = column < _LEAST_COLUMN
    canvas.words(centre, y + 24, "✗" if narrow else f"✗ {policy}", size=SMALL + 1, anchor="middle", bold=True)
    said = [policy] if narrow else [f"offers {offer.value(policy)}", f"asks {request.value(policy)}"]
    size = SMALL - 4 if narrow else SMALL - 2
    for number, words in enumerate(said):
        canvas.words(centre, y + 45 + number * 19, shortened(words, column - 4, size), size=size, anchor="middle")


def _matches_in_words(topic: str, offers: Sequence[Endpoint], requests: Sequence[Endpoint], mismatch: Mismatch) -> str:
    told = [f"Which ends of {topic or 'the topic'} match."]
    for row, offer in enumerate(offers, 1):
        for column, request in enumerate(requests, 1):
            policy = mismatch(offer, request)
            verdict = "match"
            if policy is not None:
                values = f"it offers {offer.value(policy)}, and {request.value(policy)} is requested"
                verdict = f"do not match: {policy} ({values})"
            publisher = f"Publisher P{row} of {offer.node} ({offer.words()})"
            told.append(f"{publisher} and subscription S{column} of {request.node} ({request.words()}) {verdict}.")
    if not offers or not requests:
        told.append(f"There is no {'publisher' if not offers else 'subscription'}.")
    return " ".join(told)
