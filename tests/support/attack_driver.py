"""Runs attacks; itself runs inside the grading sandbox, where `test_attacks.py` sends it as text.

Expects `ATTACKS` (name to source) and `HOST_PORT` among its globals, and prints what came of each as JSON.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

from autograder.core.processes import descendants, memory, threads
from autograder.core.results import Isolation
from autograder.sandbox.environment import profile_environment
from autograder.sandbox.node_sandbox import NodeSandbox
from autograder.sandbox.running_program import RunningProgram

ATTACKS: dict[str, str] = globals().get("ATTACKS", {})
AT_ONCE = 6
WITHIN = 120
"""Seconds for what takes one or two where the machine does nothing else."""
HONEST_NODE = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("honest")
publisher = node.create_publisher(String, "/honest/talk", 10)
node.create_timer(0.02, lambda: publisher.publish(String(data="honest")))
rclpy.spin(node)
"""


def must(name: str) -> str:
    """The line that says what must happen."""
    return next(line for line in ATTACKS[name].splitlines() if line.startswith("Must"))


def fewest_processes() -> int:
    """How many processes the sandbox keeps: the fewest in a fifth of a second, for some live for a moment only."""
    end, found = time.monotonic() + 0.2, []
    while not found or time.monotonic() < end:
        found.append(len(descendants(os.getpid())))
    return min(found)


def left_over(resting: int) -> int:
    """How many processes more there are than the sandbox keeps, once those that are ending had time to."""
    deadline = time.monotonic() + WITHIN
    while (more := len(descendants(os.getpid())) - resting) > 0 and time.monotonic() < deadline:
        time.sleep(0.02)
    return max(more, 0)


def run(sandbox: NodeSandbox, names: list[str], resting: int) -> dict[str, Any]:
    """Run programs as one launch and end it."""
    began = time.monotonic()
    with sandbox.group() as group:
        given = {"ROS_DOMAIN_ID": "7", "HOST_PORT": str(globals()["HOST_PORT"])}
        programs = {name: group.start(name, env=given) for name in names}
        report = {name: watched(program, must(name)) for name, program in programs.items()}
        after = group.start("honest")
        after.wait(WITHIN)
        end = time.monotonic()
    teardown = time.monotonic() - end
    common = {
        "after": after.output(),
        "left": left_over(resting),
        "teardown": teardown,
        "seconds": end - began,
    }
    return {name: {**entry, **common} for name, entry in report.items()}


def nice(program: RunningProgram) -> list[int]:
    """The nice values of a program's threads, each once."""
    try:
        return sorted({os.getpriority(os.PRIO_PROCESS, thread) for thread in threads(program.pid)})
    except OSError:
        return []


def watched(program: RunningProgram, wanted: str) -> dict[str, Any]:
    """Wait for the end that a program must come to, and say how it stands."""
    if "goes on behind all others" in wanted:
        deadline = time.monotonic() + WITHIN
        while nice(program) != [19] and time.monotonic() < deadline:
            time.sleep(0.1)
    if "goes on" in wanted:
        values = nice(program)
        if not program.wait(1.0):
            program.stop(0.1)
            program.wait(
                WITHIN
            )  # a hundred threads, each of which must get a turn to die, take longer than `stop` waits
    else:
        values = []
        program.wait(WITHIN)
    return {
        "nice": values,
        "ended": program.exit_status(),
        "stopped_by": program.stopped_by(),
        "output": program.output()[-4000:],
        "events": len(program.events()),
    }


def run_beside_honest_node(sandbox: NodeSandbox, names: list[str]) -> dict[str, Any]:
    """Run programs that attack by ROS, beside an honest node and an observer."""
    os.environ.update(profile_environment())
    from std_msgs.msg import String

    from autograder.graph.observer import Observer

    before = memory(os.getpid())
    observer = Observer(7)
    with sandbox.group() as group:
        flood = observer.record("/flood", String)
        talk = observer.record("/honest/talk", String)
        attacks = {name: group.start(name, env={"ROS_DOMAIN_ID": "7"}) for name in names}
        honest = group.start("honest_node", env={"ROS_DOMAIN_ID": "7"})
        observer.wait(lambda: observer.nodes(), 5)
        heard = talk.wait_for(1, WITHIN)
        talk.wait_for(talk.count + 50, 2)  # in vain, if it floods the observer: that harms its own launch alone
        grown = memory(os.getpid()) - before
        for attack in attacks.values():
            attack.stop(0.0)
        heard = heard and talk.wait_for(talk.count + 20, WITHIN)
        entry = {
            "heard": heard,
            "own": all(message.msg.data == "honest" for message in talk.messages),
            "seen": observer.wait(lambda: "/honest" in observer.nodes(), WITHIN),
            "running": honest.running(),
            "grown": grown >> 20,
            "flood": flood.count,
        }
    observer.close()
    return {name: {**entry, "output": attack.output()[-2000:]} for name, attack in attacks.items()}


def main() -> None:
    """Run them all."""
    Path("/tmp/secret_checks.py").write_text("secret = 42")
    os.environ["SECRET"] = "secret"
    folder = Path("/tmp/programs")
    folder.mkdir()
    for name, source in {**ATTACKS, "honest_node": HONEST_NODE}.items():
        (folder / f"{name}.py").write_text(source)
    names = [name for name in ATTACKS if name[0] != "_" and name != "honest"]
    by_ros = [name for name in names if must(name).startswith("Must, beside")]
    alone = [name for name in names if must(name).startswith("Must, alone")]
    together = [name for name in names if name not in by_ros and name not in alone]
    report: dict[str, Any] = {}
    with NodeSandbox(folder, Isolation.FULL) as sandbox:
        with sandbox.group():
            pass
        resting = fewest_processes()
        for name in alone:
            for _ in range(1 + ("twice" in must(name))):
                found = run(sandbox, [name], resting)
                found[name]["output"] += report.get(name, {}).get("output", "")
                report |= found
        for place in range(0, len(together), AT_ONCE):
            report |= run(sandbox, together[place : place + AT_ONCE], resting)
        for place in range(0, len(by_ros), AT_ONCE):
            report |= run_beside_honest_node(sandbox, by_ros[place : place + AT_ONCE])
    print("REPORT" + json.dumps(report), flush=True)


main()
