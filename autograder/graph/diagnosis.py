"""Why something did not happen: walks the chain from the program to the message and names the first broken link.

What the graph shows is evidence. What the student's process says about itself (its output, its probe's events, its
thread stacks) is used here for the *reason* only; points never depend on it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rclpy.qos import QoSProfile

from autograder.graph import qos, remap_rules
from autograder.graph.names import full_name, nearest, type_name
from autograder.graph.observer import Observer


@dataclass(frozen=True)
class Diagnosis:
    """The first broken link."""

    because: str
    """One or two sentences for the student."""
    code: str
    """A short stable word for the reason."""
    hint: str = ""
    """What to do or where to read on."""


class RunningProgram(Protocol):
    """What a diagnosis needs of a program."""

    name: str

    def running(self) -> bool:
        """Whether it is alive."""

    def exit_status(self) -> int | None:
        """None while it runs; negative: the signal that ended it."""

    def stopped_by(self) -> str:
        """The limit that ended it, if one did."""

    def output(self) -> str:
        """What it printed."""

    def events(self) -> list[dict[str, Any]]:
        """What its probe wrote."""

    def stacks(self, timeout: float = 1.0) -> str:
        """Where its threads are."""


@dataclass(frozen=True)
class Scene:
    """The launch that is looked at."""

    observer: Observer
    programs: Sequence[RunningProgram]
    missing: Sequence[str]
    """Programs that should have been launched, but that no cell defines."""
    folder: Path
    """Where the programs' sources are."""
    rules: Sequence[str] = ()
    """The remap rules given, as on the command line."""
    trouble: Sequence[Diagnosis] = ()
    """What kept programs from being started at all."""
    rules_by_program: Sequence[Sequence[str]] = ()
    """The same rules, those of each program by themselves: a program's rules reach its own nodes only."""


_IN_CALLBACK = {
    "client.call": (
        "call-in-callback",
        "`call()` blocks inside a callback until the answer comes, but no thread is free to take the answer: "
        "the callback waits for itself.",
        "Use `call_async` with a done callback, or put the client and the callback into different groups under a "
        "MultiThreadedExecutor.",
    ),
    "spin": (
        "nested-spin",
        "It spins inside a callback: the executor that runs this callback waits for its end, and a second spinning "
        "takes the node away from it, so the node's other callbacks stop.",
        "Never spin inside a callback: use `call_async` and a done callback, or `await`.",
    ),
    "rate.sleep": (
        "rate-in-callback",
        "`rate.sleep()` inside a callback waits for a timer that only the executor can run, and the executor waits for "
        "the callback: a deadlock.",
        "Use a timer for what must happen periodically.",
    ),
    "shutdown": (
        "shutdown-in-callback",
        "It shuts down inside a callback: the executor is told to end while it still waits for that callback.",
        "Let the callback set a future or a flag, and let `main` end the spinning and shut down.",
    ),
}
_SAME_LINK = {
    "spin_until_future_complete": "spin",
    "spin_once": "spin",
    "rclpy.shutdown": "shutdown",
    "executor.shutdown": "shutdown",
}


def program_trouble(scene: Scene) -> Diagnosis | None:
    """Link one: is every program there and alive?"""
    for name in scene.missing:
        return Diagnosis(
            f"There is no program `{name}`: no cell that begins with `%%node {name}` was found.",
            "program-missing",
            "Check the first line of the cell, which must stand there unchanged; in a notebook, run the cell first.",
        )
    for trouble in scene.trouble:
        return trouble
    for program in scene.programs:
        if program.running():
            continue
        refused = remap_rules.refused(scene.rules)
        if refused and "arse remap rule" in program.output():
            return Diagnosis(*refused)
        found = _death(scene, program)
        if found:
            return found
    return None


def _death(scene: Scene, program: RunningProgram) -> Diagnosis | None:
    limit = program.stopped_by()
    if limit:
        return Diagnosis(
            f"`{program.name}` was ended because it went over the {limit}.",
            limit.replace(" ", "-"),
            "Look for a loop without an end, or for data that grows without a bound.",
        )
    inside = _callback_failure(program)
    if inside:
        return inside
    failure = last_traceback(program.output(), program.name)
    if failure:
        return failure
    status = program.exit_status()
    if status is not None and status < 0:
        return Diagnosis(f"`{program.name}` was ended by signal {-status}.", "crashed")
    events = program.events()
    if not any(event.get("e") == "spin" for event in events):
        return Diagnosis(
            f"`{program.name}` ended by itself without spinning: no callback ever ran.",
            "not-spinning",
            "`main` must spin the node (`rclpy.spin(node)` or an executor's `spin()`), and must be called.",
        )
    return Diagnosis(f"`{program.name}` ended by itself (exit status {status}) before this was seen.", "exited")


_KNOWN_ERRORS = (
    (
        "ParameterNotDeclaredException",
        "parameter-not-declared",
        "A parameter exists from `declare_parameter` on: declare it before you read it, even if a value was given.",
    ),
    (
        "InvalidParameterTypeException",
        "parameter-type",
        "The value's type must be the declared one: 40 is an integer, 40.0 a double, '40' a string.",
    ),
    (
        "PermissionError: [Errno 1]",
        "refused-call",
        "A program may not ask this of the system, new processes (`fork`, `subprocess`, `multiprocessing`) among it: "
        "use threads, or one more program in the launch.",
    ),
    (
        "InvalidHandle",
        "used-after-destroy",
        "It used something that had been destroyed. Under a MultiThreadedExecutor the executor does this itself, now "
        "and then, while a callback destroys a publisher, subscription or timer (rclpy issue 1355): spin such a node "
        "with a SingleThreadedExecutor.",
    ),
    (
        "timer argument is null",
        "used-after-destroy",
        "A MultiThreadedExecutor asked a timer that a callback had just destroyed (rclpy issue 1355): spin a node that "
        "destroys its timers with a SingleThreadedExecutor, or use `cancel()` and `reset()`.",
    ),
)

_KIND = re.compile(r"[A-Za-z_][\w.]*(Error|Exception|Interrupt|Exit|Warning|Shutdown\w*)\b")
"""What the line of an error begins with, by the names that errors usually have."""


def last_traceback(output: str, program: str) -> Diagnosis | None:
    """The last error that a Python program printed, with the student's own line."""
    lines = output.splitlines()
    error_at = None
    for number in range(len(lines) - 1, -1, -1):
        if _KIND.match(lines[number]) or _under_frames(lines, number):
            error_at = number
            break
    if error_at is None:
        return None
    error = lines[error_at].strip()
    where, code = "", ""
    for number in range(error_at - 1, -1, -1):
        match = re.match(rf'\s+File "[^"]*\b{re.escape(program)}\.py", line (\d+)', lines[number])
        if match:
            where = f" in line {match[1]}"
            if number + 1 < error_at:
                code = lines[number + 1].strip()
            break
        if lines[number].startswith("Traceback"):
            break
    quoted = f" (`{code}`)" if code else ""
    for exception, word, hint in _KNOWN_ERRORS:
        if exception in error:
            return Diagnosis(f"`{program}` ended with an error{where}{quoted}: {error}", word, hint)
    kind = "syntax-error" if error.startswith(("SyntaxError", "IndentationError", "TabError")) else "crashed"
    what = "is not a Python program" if kind == "syntax-error" else "ended with an error"
    return Diagnosis(
        f"`{program}` {what}{where}{quoted}: {error}", kind, "The lines above it in the log say how it got there."
    )


def _under_frames(lines: Sequence[str], number: int) -> bool:
    """Whether this line is an error of any name: it stands under the frames of a traceback."""
    if not re.match(r"[A-Za-z_][\w.]*(: |$)", lines[number]):
        return False
    for above in reversed(lines[:number]):
        if above.startswith('  File "'):
            return True
        if not above.startswith("    "):
            return False
    return False


def _callback_failure(program: RunningProgram) -> Diagnosis | None:
    """An error or a wrong return value in a callback: rclpy lets it end the spinning, or swallows it."""
    for event in program.events():
        line, kind = str(event.get("line", "")), str(event.get("kind", ""))
        at = f" ({line})" if line else ""
        callback = f"A {kind} callback" if kind else "A callback"
        if event.get("e") == "bad_return":
            if kind == "service":
                return Diagnosis(
                    f"A service callback of `{program.name}`{at} did not return the response, which ends the node's "
                    "spinning: the client never gets an answer.",
                    "service-no-return",
                    "Fill `response` and `return response`.",
                )
            if kind == "lifecycle":
                return Diagnosis(
                    f"A lifecycle callback of `{program.name}`{at} did not return a TransitionCallbackReturn: the node "
                    "stops answering in the middle of the transition.",
                    "lifecycle-return",
                    "Return TransitionCallbackReturn.SUCCESS, FAILURE or ERROR from every path.",
                )
            return Diagnosis(
                f"{callback} of `{program.name}`{at} returned {event.get('text', 'the wrong type')}.",
                "bad-return",
            )
        if event.get("e") == "callback_error":
            error = f"{event.get('type', '')}: {event.get('text', '')}".strip(": ")
            source = f"`{event['code']}`, " if event.get("code") else ""
            if "event loop" in error:
                return Diagnosis(
                    f"A callback of `{program.name}`{at} awaits asyncio ({source}{error}): rclpy does not run an "
                    "asyncio loop.",
                    "asyncio-in-callback",
                    "Await rclpy futures only (such as the one of `call_async`), or use a timer.",
                )
            if "ParameterAlreadyDeclared" in error:
                return Diagnosis(
                    f"{callback} of `{program.name}`{at} declares a parameter that is declared already "
                    f"({source}{error}). A parameter lives as long as its node.",
                    "declared-twice",
                    "Declare parameters in `__init__`, once for all lives of the node.",
                )
            code = {"service": "service-exception", "lifecycle": "lifecycle-exception"}.get(kind, "callback-exception")
            after = {
                "service": "The client gets no answer and the node no longer spins.",
                "lifecycle": "rclpy swallows it without a log line and treats the transition as ERROR.",
            }.get(kind, "It ended the spinning.")
            return Diagnosis(f"{callback} of `{program.name}`{at} raised {source}{error}. {after}", code)
    return None


def failed_in_a_callback(scene: Scene) -> RunningProgram | None:
    """A program with an error in a callback, which ends it; a lifecycle node outlives its own.

    A node outlives a parameter callback that returns nothing, too: the value is refused, and rclpy warns.

    When it ends is luck: a multi-threaded executor of rclpy 7.1 looks for errors only at its next event.
    """
    for program in scene.programs:
        for event in program.events():
            kind = event.get("kind")
            if (event.get("e") == "bad_return" and kind not in ("lifecycle", "parameter")) or (
                event.get("e") == "callback_error" and kind != "lifecycle"
            ):
                return program
    return None


def inside_reason(scene: Scene) -> Diagnosis | None:
    """Why a program that lives does nothing: what its own process says."""
    for program in scene.programs:
        events = program.events()
        failure = _callback_failure(program)
        if failure:
            return failure
        for event in events:
            if event.get("e") == "in_callback":
                what = str(event.get("what", ""))
                if what == "client.call" and _several_threads(events) and _client_shares_a_group(events):
                    return Diagnosis(
                        f"`{program.name}`, {event.get('line', '')} (`{event.get('code', '')}`): {_SAME_GROUP}",
                        "call-same-group",
                        "Give the client, or the callback that calls, a callback group of its own.",
                    )
                code, because, hint = _IN_CALLBACK.get(_SAME_LINK.get(what, what), ("", "", ""))
                if code:
                    return Diagnosis(
                        f"`{program.name}`, {event.get('line', '')} (`{event.get('code', '')}`): {because}", code, hint
                    )
            if event.get("e") == "rate_sleep_unspun":
                return Diagnosis(
                    f"`{program.name}`, {event.get('line', '')} (`{event.get('code', '')}`): `rate.sleep()` waits for "
                    "a timer of the node, and nothing spins the node.",
                    "rate-unspun",
                    "Spin the node in another thread, or better: use a timer and `rclpy.spin`.",
                )
        made_node = any(event.get("e") == "node" for event in events)
        if made_node and not any(event.get("e") == "spin" for event in events) and program.running():
            waiting = waiting_line(scene, program)
            return Diagnosis(
                f"`{program.name}` made its node but nothing spins it, so no callback can run.{waiting}",
                "not-spinning",
                "Call `rclpy.spin(node)`, or `spin()` of the executor that the node was added to.",
            )
    return None


_SAME_GROUP = (
    "`call()` blocks this callback until the answer is taken, but the client is in the same mutually exclusive group "
    "as the callback: more threads do not help, the answer must wait for the callback's end."
)


def _several_threads(events: Sequence[dict[str, Any]]) -> bool:
    return any("MultiThreaded" in str(event.get("executor", "")) for event in events if event.get("e") == "spin")


def _client_shares_a_group(events: Sequence[dict[str, Any]]) -> bool:
    """Whether a client shares a mutually exclusive group with some other callback."""
    members: dict[Any, set[str]] = {}
    for event in events:
        if event.get("e") == "entity" and event.get("group") == "MutuallyExclusiveCallbackGroup":
            members.setdefault(event.get("group_id"), set()).add(str(event.get("kind")))
    return any("client" in kinds and len(kinds) > 1 for kinds in members.values())


def why_await_hangs(scene: Scene) -> Diagnosis | None:
    """Whether a callback awaits a client of its own mutually exclusive group: the group is held while it awaits."""
    for program in scene.programs:
        source = scene.folder / f"{program.name}.py"
        if not _client_shares_a_group(program.events()) or not source.is_file():
            continue
        for number, line in enumerate(source.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
            if re.search(r"\bawait\b.*call_async", line):
                return Diagnosis(
                    f"`{program.name}`, {program.name}.py:{number} (`{line.strip()}`): the client is in the same "
                    "mutually exclusive group as the callback that awaits it. A group is held until its "
                    "callback ends, so the answer is never taken.",
                    "await-same-group",
                    "Give the client, or the callback that awaits, a callback group of its own.",
                )
    return None


def shut_down_inside(scene: Scene) -> Diagnosis | None:
    """Why a program that shut down inside a callback did not end well."""
    for program in scene.programs:
        for event in program.events():
            if event.get("e") == "in_callback" and str(event.get("what")) in ("rclpy.shutdown", "executor.shutdown"):
                error = last_traceback(program.output(), program.name)
                return Diagnosis(
                    f"`{program.name}`, {event.get('line', '')} (`{event.get('code', '')}`) shuts down inside a "
                    "callback, "
                    + (
                        f"and what comes after finds it done already: {error.because}"
                        if error
                        else "so what spins the node is pulled away under it."
                    ),
                    *_IN_CALLBACK["shutdown"][::2],
                )
    return None


def waiting_line(scene: Scene, program: RunningProgram) -> str:
    """Where the program's threads are: the innermost line of the student's own file."""
    for line in program.stacks(1.0).splitlines():
        match = re.search(rf'File "[^"]*\b{re.escape(program.name)}\.py", line (\d+)', line)
        if match:
            source = _source_line(scene.folder / f"{program.name}.py", int(match[1]))
            return f" It waits in line {match[1]} (`{source}`)."
    return ""


def _source_line(path: Path, number: int) -> str:
    try:
        return path.read_text(encoding="utf-8").splitlines()[number - 1].strip()
    except (OSError, IndexError):
        return ""


def why_no_node(scene: Scene, wanted: str) -> Diagnosis:
    """Why the node `wanted` is not on the graph."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    names = scene.observer.nodes()
    if not names:
        inside = inside_reason(scene)
        return inside or Diagnosis("The program runs, but it has not made any node.", "no-node")
    doubles = [name for name in names if names.count(name) > 1]
    if doubles:
        return why_doubled(scene, doubles[0])
    base = wanted.rsplit("/", 1)[-1]
    for name in names:
        if name.rsplit("/", 1)[-1] == base:
            return Diagnosis(
                f"The node `{base}` exists, but in another namespace: `{name}`.",
                "namespace",
                "A namespace given at the start (`-r __ns:=/name`) reaches every node that does not fix its own.",
            )
    close = nearest(wanted, names) or names[0]
    return Diagnosis(
        f"There is no node `{wanted}`; the nearest name on the graph is `{close}`.",
        "node-name",
        "The name given to the Node constructor (or by `-r __node:=`) decides.",
    )


def why_doubled(scene: Scene, name: str) -> Diagnosis:
    """Why several nodes have one name."""
    count = scene.observer.nodes().count(name)
    for rule in map(remap_rules.parse, scene.rules):
        if rule and rule.left in ("__node", "__name") and not rule.prefix and len(scene.programs) == 1:
            return Diagnosis(
                f"`{rule.text}` renames every node of its process: now {count} nodes are called `{name}`.",
                "one-name-for-all",
                "Say which node is meant by its name in the code: `NODE:__node:=NEW`.",
            )
    return Diagnosis(
        f"{count} nodes are called `{name}`: their parameters and services cannot be told apart.",
        "duplicate-node",
        "Give each node a name of its own.",
    )


def _idle_rule(scene: Scene, topic: str) -> Diagnosis | None:
    """A remap rule that was meant to make the topic's name and did not."""
    observer = scene.observer
    users = {
        name: {full_name(end.node_namespace, end.node_name) for end in ends}
        for name in observer.topics()
        for ends in [[*observer.publishers(name), *observer.subscriptions(name)]]
    }
    for rules in scene.rules_by_program or [scene.rules]:
        idle = remap_rules.without_effect(rules, topic, observer.nodes(), users)
        if idle:
            return Diagnosis(*idle)
    return None


def why_no_endpoint(scene: Scene, topic: str, msg_type: type | None, kind: str, node: str = "") -> Diagnosis:
    """Why no `kind` ("publisher" or "subscription") of this type (None: of any) is on the topic."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    observer = scene.observer
    ends = observer.publishers(topic) if kind == "publisher" else observer.subscriptions(topic)
    wanted = type_name(msg_type) if msg_type else ""
    others = sorted({end.topic_type for end in ends if end.topic_type != wanted})
    if others and wanted:
        return Diagnosis(f"The {kind} on `{topic}` has the type {others[0]}, not {wanted}.", "wrong-type")
    if ends and node:
        owners = sorted({full_name(end.node_namespace, end.node_name) for end in ends})
        return Diagnosis(f"The {kind} on `{topic}` belongs to {', '.join(owners)}, not to `{node}`.", "wrong-node")
    if not observer.nodes():
        return inside_reason(scene) or Diagnosis("The program runs, but it has not made any node.", "no-node")
    idle = _idle_rule(scene, topic)
    if idle:
        return idle
    opposite = observer.subscriptions(topic) if kind == "publisher" else observer.publishers(topic)
    names = [name for name in observer.topics() if name not in ("/rosout", "/parameter_events")]
    names = [name for name in names if not name.endswith("/transition_event")]
    reach = observer.publishers if kind == "publisher" else observer.subscriptions
    names = [name for name in names if reach(name)]
    base = topic.rsplit("/", 1)[-1]
    for name in names:
        if name != topic and name.rsplit("/", 1)[-1] == base and topic.endswith(name):
            return Diagnosis(
                f"The {kind} is on `{name}`, not on `{topic}`: its name does not follow the namespace.",
                "absolute-name",
                "A topic name with a leading slash is absolute: no namespace reaches it. Write it without the slash.",
            )
    # A name that only the observer's own launch line or another node uses is not what the student meant.
    close = nearest(topic, names)
    if close:
        return Diagnosis(
            f"There is no {kind} on `{topic}`; the nearest topic with one is `{close}`.",
            "topic-name",
            "Compare the two names letter by letter, namespace included.",
        )
    if opposite:
        return Diagnosis(
            f"On `{topic}` there is only the other end: a {'subscription' if kind == 'publisher' else 'publisher'}.",
            "wrong-end",
        )
    inside = inside_reason(scene)
    return inside or Diagnosis(f"No node has a {kind} on `{topic}`.", "no-topic")


def why_not_matched(scene: Scene, topic: str, profile: QoSProfile, kind: str) -> Diagnosis | None:
    """Which QoS policy keeps the student's `kind` on the topic and an endpoint with `profile` apart."""
    ends = scene.observer.publishers(topic) if kind == "publisher" else scene.observer.subscriptions(topic)
    for end in ends:
        offered, requested = (end.qos_profile, profile) if kind == "publisher" else (profile, end.qos_profile)
        policy = qos.first_mismatch(offered, requested)
        if policy:
            words = policy.split()[0] if policy != "liveliness lease" else "lease"
            gives, wants = qos.describe(offered)[words], qos.describe(requested)[words]
            return Diagnosis(
                f"Publisher and subscription on `{topic}` do not match over {policy}: offered {_said(gives)}, "
                f"requested {_said(wants)}.",
                f"qos-{words}",
                "A subscription may not ask for more than the publisher offers.",
            )
    return None


def _said(value: str | float | None) -> str:
    if value is None:
        return "none"
    return value.replace("_", " ") if isinstance(value, str) else f"{value:g} s"


def why_silent(scene: Scene, topic: str, msg_type: type, profile: QoSProfile) -> Diagnosis:
    """Why nothing (more) arrived on a topic."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    ends = scene.observer.publishers(topic)
    if not any(end.topic_type == type_name(msg_type) for end in ends):
        return why_no_endpoint(scene, topic, msg_type, "publisher")
    mismatch = why_not_matched(scene, topic, profile, "publisher")
    if mismatch:
        return mismatch
    inside = inside_reason(scene)
    if inside:
        return inside
    asleep = lifecycle_silence(scene)
    if asleep:
        return asleep
    owners = {full_name(end.node_namespace, end.node_name) for end in ends}
    services = scene.observer.services()
    # A lifecycle node that says nothing does so because of its state or its code: crowding is no likely cause.
    crowded = why_await_hangs(scene) or why_serial(scene)
    if crowded and not any(f"{owner}/get_state" in services for owner in owners):
        return crowded
    for program in scene.programs:
        where = waiting_line(scene, program)
        if where:
            return Diagnosis(f"The publisher on `{topic}` exists but is silent.{where}", "silent")
    return Diagnosis(f"The publisher on `{topic}` exists but is silent: no callback of its node publishes.", "silent")


def lifecycle_silence(scene: Scene) -> Diagnosis | None:
    """Whether a lifecycle publisher is off: its node is not active, or its own on_activate leaves it out."""
    for program in scene.programs:
        for event in program.events():
            if event.get("e") == "lifecycle_publish_off":
                if event.get("state") == "active":
                    return Diagnosis(
                        f"`{program.name}` is active, but its lifecycle publisher was never activated: `on_activate` "
                        "does not call `super().on_activate(state)`.",
                        "no-super-on-activate",
                        "End `on_activate` with `return super().on_activate(state)`.",
                    )
                return Diagnosis(
                    f"`{program.name}` publishes while it is {event.get('state', 'not active')}: a lifecycle publisher "
                    "drops such messages.",
                    "lifecycle-inactive",
                )
    return None


def why_serial(scene: Scene) -> Diagnosis | None:
    """Why callbacks that should overlap, or go on beside a slow one, do not: the executor, its threads, the groups."""
    for program in scene.programs:
        events = program.events()
        executors = [event for event in events if event.get("e") == "executor"]
        used = {str(event.get("executor", "")) for event in events if event.get("e") == "spin"}
        entities = [
            event
            for event in events
            if event.get("e") == "entity" and event.get("kind") != "publisher" and event.get("group")
        ]
        reentrant = [e for e in entities if e["group"] == "ReentrantCallbackGroup"]
        own = [e for e in entities if not e.get("default_group")]
        if not used:
            continue
        if not any("MultiThreaded" in name for name in used):
            made = any("MultiThreaded" in str(event.get("type")) for event in executors)
            because = (
                "It makes a MultiThreadedExecutor, but `rclpy.spin` spins the node with another, single-threaded one."
                if made
                else "It is spun by a SingleThreadedExecutor (that is what `rclpy.spin` uses)"
                + (
                    ": a reentrant group changes nothing there."
                    if reentrant
                    else ", which runs one callback at a time."
                )
            )
            return Diagnosis(
                f"`{program.name}`: {because}",
                "single-threaded-executor",
                "Add the node to a MultiThreadedExecutor(num_threads=...) and spin that.",
            )
        if not own:
            return Diagnosis(
                f"`{program.name}` has a MultiThreadedExecutor, but all its callbacks are in the node's default group, "
                "which is mutually exclusive: they run one after another.",
                "no-callback-groups",
                "Give the callbacks that may overlap a callback group of their own.",
            )
        threads = [event for event in executors if "MultiThreaded" in str(event.get("type"))]
        if threads and not any(event.get("threads_given") for event in threads):
            return Diagnosis(
                f"`{program.name}` leaves the number of threads to the machine: MultiThreadedExecutor() took "
                f"{threads[-1].get('threads')} here, as many as there are CPUs.",
                "machine-threads",
                "Name it: MultiThreadedExecutor(num_threads=8).",
            )
        few = [e for e in threads if isinstance(e.get("threads"), int) and e["threads"] < 2]
        if few:
            return Diagnosis(
                f"`{program.name}`: a MultiThreadedExecutor with one thread runs one callback at a time.", "few-threads"
            )
        groups: dict[Any, list[dict[str, Any]]] = {}
        for entity in entities:
            if entity["group"] == "MutuallyExclusiveCallbackGroup":
                groups.setdefault(entity.get("group_id"), []).append(entity)
        shared = [members for members in groups.values() if len(members) > 1]
        if shared:
            kinds = ", ".join(
                str(member.get("name") or f"timer every {float(member.get('period') or 0):g} s") for member in shared[0]
            )
            return Diagnosis(
                f"`{program.name}` puts several callbacks into one mutually exclusive group ({kinds}): while one runs, "
                "the others wait, and an overloaded group starves some for ever.",
                "starved",
                "Callbacks that must not wait for each other need different groups.",
            )
    return None


def why_no_service(scene: Scene, name: str, srv_type: type) -> Diagnosis:
    """Why there is no server for a service."""
    trouble = program_trouble(scene)
    if trouble:
        return trouble
    services = scene.observer.services()
    wanted = type_name(srv_type)
    if name in services and wanted not in services[name]:
        return Diagnosis(f"The service `{name}` has the type {services[name][0]}, not {wanted}.", "wrong-type")
    if not scene.observer.nodes():
        return inside_reason(scene) or Diagnosis("The program runs, but it has not made any node.", "no-node")
    names = [n for n, types in services.items() if not types[0].startswith(("rcl_interfaces/", "type_description"))]
    close = nearest(name, names)
    if close and close != name:
        return Diagnosis(
            f"There is no service `{name}`; the nearest name on the graph is `{close}`.",
            "service-name",
            "Compare the two names letter by letter, namespace included.",
        )
    return inside_reason(scene) or Diagnosis(f"No node offers the service `{name}`.", "no-service")


def why_no_answer(scene: Scene, name: str) -> Diagnosis:
    """Why a service that exists did not answer."""
    found = program_trouble(scene) or inside_reason(scene) or why_serial(scene)
    if found:
        return found
    for program in scene.programs:
        where = waiting_line(scene, program)
        if where:
            return Diagnosis(f"The service `{name}` exists but does not answer.{where}", "no-answer")
    return Diagnosis(f"The service `{name}` exists but does not answer: nothing spins its node.", "no-answer")
