"""Says why there is no node, publisher, subscription or service with the expected name."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from autograder.arguments import remap_rules, rule_effect
from autograder.arguments.rule_effect import ABSOLUTE_NAME, RULE_WITHOUT_MATCH, TOPIC_NAME
from autograder.diagnosis.blocked import WRONG_TYPE
from autograder.diagnosis.chain import inside_reason, reason_inside
from autograder.diagnosis.inside import Inside
from autograder.diagnosis.programs import program_trouble
from autograder.diagnosis.scene import Scene
from autograder.graph.names import nearest, node_of, type_name
from autograder.reasons import Group, Kind, Reason
from autograder.sandbox.inside.probe.events import Thing

NOT_MADE_YET = Kind(
    "not-made-yet",
    "a method in the source code creates the publisher or subscription in a line that the probe has not seen executed",
    Group.NAMES,
)
TAKEN_AWAY = Kind(
    "taken-away",
    "the program made the publisher or subscription and destroyed it again",
    Group.NAMES,
)
NODE_NAME = Kind("node-name", "the node is not there, others are", Group.NAMES)
DUPLICATE_NODE = Kind("duplicate-node", "several nodes have one name", Group.NAMES)
TOPIC_PRESENT = Kind("topic-present", "somebody uses the topic", Group.NAMES)
NOTHING_STARTED = Kind("nothing-started", "the launch has no program", Group.PROGRAM)
NO_NODE = Kind("no-node", "programs run, and no node is on the graph", Group.NAMES)
NOT_ON_GRAPH = Kind(
    "not-on-graph", "a program has made a node, and the node is not on the graph of its launch", Group.NAMES
)
NAMESPACE = Kind("namespace", "a node of this name is there in another namespace", Group.NAMES)
WRONG_NODE = Kind("wrong-node", "the end is there and belongs to another node", Group.NAMES)
WRONG_END = Kind("wrong-end", "only the other end is there", Group.NAMES)
NO_TOPIC = Kind("no-topic", "no node has such an end, on no similar topic", Group.NAMES)
NO_SERVICE = Kind("no-service", "no such service, and none similar", Group.NAMES)
ONE_NAME_FOR_ALL = Kind(
    "one-name-for-all", "one rule without a prefix gave several nodes of a process one name", Group.NAMES
)
SERVICE_NAME = Kind("service-name", "a service with a similar name is offered", Group.NAMES)

_EVERY_NODES = ("/rosout", "/parameter_events")
_MAKERS = {
    "publisher": ("create_publisher", "create_lifecycle_publisher"),
    "subscription": ("create_subscription",),
}


def _no_node_at_all(scene: Scene) -> Reason:
    """Return why no node is on the graph, although no program is known to have failed."""
    if not scene.programs:
        return NOTHING_STARTED(
            "No program was started, so there is nothing to check.",
            "A launch file starts the programs that its `node` entries name.",
        )
    names = ", ".join(f"`{program.name}`" for program in scene.programs)
    return inside_reason(scene) or NO_NODE(
        f"{names} {'runs' if len(scene.programs) == 1 else 'run'}, but no node is on the graph.",
    )


def _around(scene: Scene, name: str) -> list[Inside]:
    """Return the programs that were started in the innermost namespace of a name; all programs if there are none."""
    started = [
        (remap_rules.namespace_of(rules), inside) for inside, rules in zip(scene.insides, scene.rules, strict=False)
    ]
    depth = max((len(space) for space, _ in started if name.startswith(f"{space}/")), default=-1)
    return [inside for space, inside in started if len(space) == depth and name.startswith(f"{space}/")] or (
        scene.insides
    )


def _twins(scene: Scene, name: str) -> set[str]:
    """Return the nodes of runs, in other namespaces, of the programs that also run in the namespace of a name.

    These nodes have the right name for where they were started, so they are not misnamed.
    """
    around = _around(scene, name)
    programs = {inside.name for inside in around}
    return {
        node for inside in scene.insides if inside not in around and inside.name in programs for node in inside.nodes
    }


def _deeper(wanted: str, there: Sequence[str]) -> str:
    """What to leave out where every node of the wanted name is below the wanted namespace; empty if one is not."""
    space, base = wanted.rpartition("/")[0], wanted.rpartition("/")[2]
    if not all(name.startswith(f"{space}/") and name.endswith(f"/{base}") for name in there):
        return ""
    more = ", ".join(dict.fromkeys(f"`{name[len(space) : -len(base) - 1]}`" for name in there))
    return (
        f"The node should be in `{space or '/'}`, and something adds {more} to that: a rule for `__ns`, or in a launch "
        "file `namespace` or `push_ros_namespace`. Leave it out."
    )


def _given_as_a_parameter(scene: Scene, insides: Sequence[Inside], wanted: str) -> Reason | None:
    """Return why a name that was given with `-p` to one of these programs does not exist."""
    pairs = zip(scene.insides, scene.parameter_rules, strict=False)
    return next(
        (why for it, given in pairs if it in insides and (why := rule_effect.renames_nothing(given, wanted))), None
    )


def _nothing_of(silent: Sequence[Inside]) -> Reason:
    """Return why running programs have no node: what is wrong inside, or how far the first of them has got."""
    if found := reason_inside(silent):
        return found
    made = [name for name, node in silent[0].nodes.items() if not node.destroyed]
    if made:
        return NOT_ON_GRAPH(
            f"`{silent[0].name}` runs, and has made the node `{made[0]}`, which is not on the graph of this launch.",
            "A program that chooses a ROS domain itself, with `rclpy.init(domain_id=...)` or `ROS_DOMAIN_ID`, is found "
            "by nobody here.",
        )
    return NO_NODE(f"`{silent[0].name}` runs, but it shows no node.")


def _ending_in(base: str, names: Sequence[str]) -> list[str]:
    """Return the nodes with this name in any namespace."""
    return [name for name in names if name.rsplit("/", 1)[-1] == base]


def why_no_node(scene: Scene, wanted: str) -> Reason:
    """Return why the node `wanted` is not on the graph.

    Another node is mentioned only if each program that was started in this namespace has a node of its own.
    """
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    names = scene.observer.nodes()
    if not names:
        return _no_node_at_all(scene)
    doubles = [name for name in names if names.count(name) > 1]
    if doubles:
        return why_doubled(scene, doubles[0])
    around = _around(scene, wanted)
    own = sorted(set(names) - _twins(scene, wanted))
    silent = [inside for inside in around if inside.alive and inside.nodes.keys().isdisjoint(names)]
    if silent or not own:
        return _nothing_of(silent or around)
    for inside, rules in zip(scene.insides, scene.rules, strict=False):
        idle = rule_effect.node_without_effect(rules, wanted, own) if inside in around else None
        if idle:
            return idle
    idle = _given_as_a_parameter(scene, around, wanted)
    if idle:
        return idle
    base = wanted.rsplit("/", 1)[-1]
    there = _ending_in(base, own) or _ending_in(base, names)  # the second includes twins
    if there:
        return NAMESPACE(
            f"The node `{base}` exists, but in another namespace: {', '.join(f'`{name}`' for name in there)}.",
            _deeper(wanted, there)
            or "Set the namespace when the node starts: with `-r __ns:=/name`, or in a launch file with `namespace` or "
            "with `push_ros_namespace` above the node in the same group. In a launch file, each of these adds a level. "
            "The namespace applies to every node that does not set its own.",
        )
    space = wanted.rpartition("/")[0]
    if space in own:
        return NAMESPACE(
            f"`{space}` is the name of the node, but it should be its namespace.",
            "`__ns` sets the namespace, and `__node` sets the name of the node: `-r __ns:=" + space + "`.",
        )
    close = nearest(wanted, own) or own[0]
    return NODE_NAME(
        f"There is no node `{wanted}`; the nearest name on the graph is `{close}`.",
        "The node gets its name from the Node constructor, or from `-r __node:=` (in a launch file: from `name`).",
    )


def why_doubled(scene: Scene, name: str) -> Reason:
    """Return why several nodes have the same name."""
    count = scene.observer.nodes().count(name)
    for rule in map(remap_rules.parse, scene.rules_for(name)):
        if rule and rule.left in ("__node", "__name") and not rule.prefix and len(scene.programs) == 1:
            return ONE_NAME_FOR_ALL(
                f"`{rule.text}` renames every node of its process: now {count} nodes are called `{name}`.",
                "Say which node is meant by its name in the code: `NODE:__node:=NEW`.",
            )
    return DUPLICATE_NODE(
        f"{count} nodes are called `{name}`: their parameters and services cannot be told apart.",
        "Give each node a name of its own.",
    )


def _made_as(scene: Scene, kind: str, name: str) -> list[Thing]:
    """Return the ends of this kind and full name whose creation the probes have seen."""
    return [
        thing
        for inside in scene.insides
        for thing in inside.things.values()
        if (thing.kind, thing.name) == (kind, name)
    ]


def absolute_name(scene: Scene, kind: str, name: str, wanted: str = "") -> Reason | None:
    """Must have seen: the code create this end with a name that begins with a slash.

    `wanted` is the name that the end should have instead.
    """
    for thing in _made_as(scene, kind, name):
        if thing.given.startswith("/"):
            at = f" in {thing.made}" if thing.made else ""
            return ABSOLUTE_NAME(
                f"The {kind} is on `{name}`. The code{at} uses the absolute name `{thing.given}`, and a namespace does "
                "not change an absolute name.",
                f"A topic name with a leading slash is absolute. {_not_absolute(thing, wanted)}",
            )
    return None


def _not_absolute(thing: Thing, wanted: str) -> str:
    """Say what to write so that the name becomes the wanted one."""
    if thing.node and wanted.startswith(f"{thing.node}/"):
        return f"Write `~{wanted.removeprefix(thing.node)}`: such a name is placed below the node's own name."
    return "Remove the slash."


def why_topic_present(scene: Scene, topic: str) -> Reason:
    """Return a reason that says which nodes use a topic that no node should use."""
    ends = scene.observer.publishers(topic) + scene.observer.subscriptions(topic)
    owners = sorted({node_of(end) for end in ends})
    outside = any(end.node_namespace != "/" and not topic.startswith(end.node_namespace + "/") for end in ends)
    absolute = absolute_name(scene, "publisher", topic) or absolute_name(scene, "subscription", topic)
    if outside and absolute:
        return absolute
    return TOPIC_PRESENT(f"{', '.join(owners) or 'A node'} uses `{topic}`.")


def why_no_endpoint(scene: Scene, topic: str, msg_type: type | None, kind: str, node: str = "") -> Reason:
    """Return why there is no `kind` ("publisher" or "subscription") of this type on the topic; None means any type."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    observer = scene.observer
    reach = observer.publishers if kind == "publisher" else observer.subscriptions
    ends = reach(topic)
    wanted = type_name(msg_type) if msg_type else ""
    others = sorted({end.topic_type for end in ends if end.topic_type != wanted})
    if others and wanted:
        return WRONG_TYPE(f"The {kind} on `{topic}` has the type {others[0]}, not {wanted}.")
    if ends and node:
        owners = sorted({node_of(end) for end in ends})
        return WRONG_NODE(f"The {kind} on `{topic}` belongs to {', '.join(owners)}, not to `{node}`.")
    if not observer.nodes():
        return _no_node_at_all(scene)
    if node and node not in observer.nodes():
        return why_no_node(scene, node)
    used = [name for name in observer.topics() if name not in _EVERY_NODES and not name.endswith("/transition_event")]
    # The nearest name is first looked for among the topics of the node and type in question.
    meant = {
        name
        for name in used
        for end in reach(name)
        if end.topic_type == (wanted or end.topic_type) and node_of(end) == (node or node_of(end))
    }
    twins = _twins(scene, topic)
    # What the car of a world has, or uses, has its right name, so it is not what the student meant to call otherwise.
    written = {name for inside in scene.insides for name in inside.nodes}
    near = [
        name
        for name in (meant or used)
        for users in [{node_of(end) for end in [*observer.publishers(name), *observer.subscriptions(name)]}]
        if not {node_of(end) for end in reach(name)} <= twins and (not written or users <= written)
    ]
    found = _idle_rule(scene, topic, node)
    unmade = taken_away(scene, topic, kind, node) or not_made_yet(scene, topic, kind, node)
    if unmade and (found is None or found.kind is RULE_WITHOUT_MATCH):  # no rule matches what does not exist yet
        found = unmade
    found = found or _elsewhere(scene, topic, kind, near)
    if found:
        return found
    opposite = observer.subscriptions(topic) if kind == "publisher" else observer.publishers(topic)
    if opposite:
        return WRONG_END(
            f"`{topic}` has a {'subscription' if kind == 'publisher' else 'publisher'}, but no {kind}.",
        )
    return inside_reason(scene, node) or NO_TOPIC(
        f"No node has a {kind} on `{topic}`. The nodes are {', '.join(observer.nodes())}; "
        + (f"their topics are {', '.join(sorted(used))}." if used else "they have no topic of their own."),
    )


def _idle_rule(scene: Scene, topic: str, node: str) -> Reason | None:
    """Return why a rule of the program in question did not produce the topic's name, although it was meant to."""
    observer = scene.observer
    users = {
        name: {node_of(end) for end in ends}
        for name in observer.topics()
        for ends in [[*observer.publishers(name), *observer.subscriptions(name)]]
    }
    for inside, rules in zip(scene.insides, scene.rules, strict=False):
        own = [name for name in observer.nodes() if name in inside.nodes] or observer.nodes()
        nodes = [name for name in own if name == node] if node else own
        found = rule_effect.without_effect(rules, topic, nodes, users, inside.names_in_code)
        named = [name for name in users if found and name in found.because]
        absolute = any(absolute_name(scene, kind, name) for name in named for kind in ("publisher", "subscription"))
        if found and (found.kind is not ABSOLUTE_NAME or absolute):
            return found
    given = _given_as_a_parameter(scene, scene.inside_of(node) if node else scene.insides, topic)
    return given


def _elsewhere(scene: Scene, topic: str, kind: str, names: list[str]) -> Reason | None:
    """Return the reason if the same end exists under another name, which is absolute in the code or misspelt.

    Args:
        scene: the launch.
        topic: the expected name.
        kind: "publisher" or "subscription".
        names: the names that the student can have meant.
    """
    base = topic.rsplit("/", 1)[-1]
    for name in names:
        if name != topic and name.rsplit("/", 1)[-1] == base and topic.endswith(name):
            absolute = absolute_name(scene, kind, name, topic)
            if absolute:
                return absolute
    close = nearest(topic, [name for name in names if name != topic])
    if not close:
        return None
    said = f"There is no {kind} on `{topic}`; the nearest topic with one is"
    return _misspelt(scene, kind, topic, close, said, TOPIC_NAME)


def _misspelt(scene: Scene, kind: str, wanted: str, close: str, said: str, missing: Kind) -> Reason:
    """Return the reason if instead of `wanted` there is only a similar name, which ends the sentence `said`."""
    made = _made_as(scene, kind, close)
    given = made[0].given if made else ""
    in_code = f" (`{given}` in the code)" if given and given != close else ""
    return missing(f"{said} `{close}`{in_code}.", _what_differs(scene.observer.nodes(), wanted, close))


def _what_differs(nodes: Sequence[str], wanted: str, close: str) -> str:
    """Return advice about the difference between the expected name and a similar one, chosen by what it is."""
    if close.endswith(wanted):
        return (
            f"`{close.removesuffix(wanted)}` is too much. If it is the namespace in which the node was started: a name "
            "with a leading slash is absolute, and a namespace does not change it."
        )
    if wanted.endswith(close):
        return f"`{wanted.removesuffix(close)}` is missing in front of it."
    old, new = close.split("/"), wanted.split("/")
    places = [place for place, parts in enumerate(zip(old, new, strict=False)) if parts[0] != parts[1]]
    if len(old) != len(new) or len(places) != 1:
        return "Compare the two names part by part, namespace included."
    place = places[0]
    differs = f"They differ in one part: it has to be `{new[place]}` and is `{old[place]}`."
    if place < len(new) - 1 and "/".join(new[: place + 1]) in nodes:
        rest = "/".join(new[place + 1 :])
        return f"{differs} `{new[place]}` is the name of the node, and a private name, `~/{rest}`, follows it."
    return differs


def why_no_service(scene: Scene, name: str, srv_type: type) -> Reason:
    """Return why there is no server for a service."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    services = scene.observer.services()
    wanted = type_name(srv_type)
    if name in services and wanted not in services[name]:
        return WRONG_TYPE(f"The service `{name}` has the type {services[name][0]}, not {wanted}.")
    if not scene.observer.nodes():
        return _no_node_at_all(scene)
    twins = _twins(scene, name)
    elsewhere = {t.name for i in scene.insides for t in i.things.values() if t.kind == "service" and t.node in twins}
    names = [n for n, types in services.items() if not types[0].startswith(("rcl_interfaces/", "type_description"))]
    close = nearest(name, [n for n in names if n not in elsewhere])
    if close and close != name:
        said = f"There is no service `{name}`; the nearest name on the graph is"
        return _misspelt(scene, "service", name, close, said, SERVICE_NAME)
    return inside_reason(scene) or NO_SERVICE(f"No node offers the service `{name}`.")


def taken_away(scene: Scene, topic: str, kind: str, node: str) -> Reason | None:
    """Must have seen: such ends that the program made, and that it has destroyed all of them."""
    for inside in scene.inside_of(node) if node else scene.insides:
        things = inside.things.values() if inside.alive else ()
        made = [thing for thing in things if (thing.kind, thing.name) == (kind, topic)]
        if made and all(thing.destroyed for thing in made):
            line = f" in {made[-1].made}" if made[-1].made else ""
            return TAKEN_AWAY(
                f"`{inside.name}` made the {kind} on `{topic}`{line} and has destroyed it since.",
                f"Destroy the {kind} where it must no longer exist, and not before.",
            )
    return None


def not_made_yet(scene: Scene, topic: str, kind: str, node: str) -> Reason | None:
    """Must have seen: a line in a method of the source that creates such an end, and no end created there.

    What is wrong inside this program comes first, because that can be what keeps it from reaching the line.
    """
    for inside in scene.inside_of(node) if node else scene.insides:
        for method, call in _makers(inside, _before_rules(scene, inside, topic), kind) if inside.alive else []:
            code = inside.source.line(call.lineno)
            return reason_inside([inside]) or NOT_MADE_YET(
                f"The code creates the {kind} on `{topic}` in `{method}`, line {call.lineno} (`{code}`), but the "
                "program has not reached this line.",
                f"Look at what the program does before this line, and at what calls `{method}`. If the {kind} must "
                "exist earlier, create it in the callback after which it must exist.",
            )
    return None


def _before_rules(scene: Scene, inside: Inside, topic: str) -> list[str]:
    """Return the full names that the program's rules change to this topic, and the topic itself."""
    rules = map(remap_rules.parse, dict(zip(scene.insides, scene.rules, strict=False)).get(inside, ()))
    return [topic] + [
        rule_effect.full_name(rule.left, node)
        for rule in rules
        if rule and rule.renames_topics
        for node in inside.nodes
        if rule_effect.full_name(rule.right, node) == topic
    ]


def _makers(inside: Inside, topics: list[str], kind: str) -> list[tuple[str, ast.Call]]:
    """Return the calls that would create an end on one of these topics and have created none, each with its method.

    Calls in `__init__` are left out.
    """
    used = {int(thing.made.rpartition(":")[2] or 0) for thing in inside.things.values() if thing.kind == kind}
    found = []
    for method, call in inside.source.method_calls():
        made = isinstance(call.func, ast.Attribute) and call.func.attr in _MAKERS[kind]
        names = [word.value for word in call.args if isinstance(word, ast.Constant) and isinstance(word.value, str)]
        named = any(topic.endswith("/" + name.lstrip("~/")) for name in names for topic in topics)
        if made and named and used.isdisjoint(range(call.lineno, (call.end_lineno or 0) + 1)) and method != "__init__":
            found.append((method, call))
    return found
