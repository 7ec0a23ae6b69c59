"""Every reason has a program for which it must speak, and a near miss for which it must not.

The programs are real ones. Several run in one launch, each is asked about on its own, and the answer is awaited: a
reason that is established comes as soon as there is enough to see, and a near miss is asked when it has done its work.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest
from std_msgs.msg import String

from autograder import diagnosis
from autograder.checks import launch, session
from autograder.diagnosis import Diagnosis, Scene
from autograder.diagnosis.inside import Inside
from autograder.graph.recording import quiet_profile
from autograder.results import Isolation

PRELUDE = """
import threading, time
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup as Exclusive, ReentrantCallbackGroup as Reentrant
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger
"""

TOGETHER = 8
"""Programs in one launch."""

Ask = Callable[[Scene, str], Diagnosis | None]


def silent(scene: Scene, name: str) -> Diagnosis | None:
    return diagnosis.why_silent(scene, f"/{name}/out", String, quiet_profile())


def inside(scene: Scene, name: str) -> Diagnosis | None:
    return diagnosis.inside_reason(scene, f"/{name}")


def together(at_once: int = 2, itself: bool = False) -> Ask:
    return lambda scene, name: diagnosis.why_not_together(scene, at_once, itself)


def starved(scene: Scene, name: str) -> Diagnosis | None:
    return diagnosis.why_starved(scene)


@dataclass
class Case:
    """A program, what must be said about it, and what must not."""

    init: str = ""
    """The rest of the constructor, after `self.out`, a publisher on `~/out`."""
    methods: str = ""
    main: str = "rclpy.spin(node)"
    says: str = ""
    because: str = ""
    never: tuple[str, ...] = ()
    """Reasons that this is a near miss of."""
    ask: Ask = silent
    ready: Callable[[Inside], object] = field(default=lambda it: any(thing.done >= 3 for thing in it.callbacks))
    """When a near miss has done its work."""
    base: str = "Node"

    def source(self, name: str) -> str:
        parts = (
            PRELUDE,
            f"class It({self.base}):",
            "    def __init__(self):",
            f'        super().__init__("{name}")',
            '        self.out = self.create_publisher(String, "~/out", 10)',
            textwrap.indent(textwrap.dedent(self.init), " " * 8),
            textwrap.indent(textwrap.dedent(self.methods), " " * 4),
            "",
            "def main():",
            "    rclpy.init()",
            "    node = It()",
            textwrap.indent(textwrap.dedent(self.main), " " * 4),
            "",
            "main()",
        )
        return "\n".join(parts)


THREADS = "executor = MultiThreadedExecutor(num_threads={})\nexecutor.add_node(node)\nexecutor.spin()"
TALK = "self.create_timer(0.05, lambda: self.out.publish(String(data='x')))\n"
SERVER = "self.create_service(Trigger, '~/gate', lambda request, response: response, callback_group=Reentrant())\n"
CLIENT = "self.client = self.create_client(Trigger, '~/gate'{})\n"
ASKER = SERVER + CLIENT + "self.create_timer(0.05, self.ask)\n"
CALL = "def ask(self):\n    self.client.call(Trigger.Request())\n"
AWAIT = "async def ask(self):\n    await self.client.call_async(Trigger.Request())\n"
POLL = """
def ask(self):
    future = self.client.call_async(Trigger.Request())
    while not future.done():
        time.sleep(0.01)
"""
SLOW = "def slow(self):\n    time.sleep(0.1)\n"
TWO = "self.create_timer(0.05, self.slow{})\nself.create_timer(0.05, self.slow{})\n"
OWN = ", callback_group=Exclusive()"

CASES = {
    # Blocked callbacks.
    "calls": Case(ASKER.format(""), CALL, says="call-in-callback", because="holds the only thread"),
    "calls_same_group": Case(
        ASKER.format(""), CALL, THREADS.format(4), says="call-same-group", never=("call-in-callback",)
    ),
    "calls_well": Case(
        ASKER.format(OWN), CALL, THREADS.format(4), says="silent", never=("call-same-group", "stuck-callback")
    ),
    "calls_nobody": Case(
        ASKER.format(OWN)
        .replace("'~/gate'{},", "'~/gate',")
        .replace("(Trigger, '~/gate', cal", "(Trigger, '~/gat', cal"),
        CALL,
        THREADS.format(4),
        says="waits-for-service",
        because="the nearest name is",
        never=("call-same-group",),
    ),
    "waits_for_nobody": Case(
        "self.create_client(Trigger, '/gate').wait_for_service()\n",
        says="waits-for-service",
        because="`/gate`",
        never=("stuck-in-init",),
    ),
    "waits_well": Case(
        SERVER + CLIENT.format("") + "self.client.wait_for_service()\n" + TALK,
        says="silent",
        never=("waits-for-service",),
    ),
    "awaits": Case(ASKER.format(""), AWAIT, says="await-same-group", because="await self.client"),
    "awaits_well": Case(ASKER.format(OWN), AWAIT, says="silent", never=("await-same-group", "spinning-ended")),
    "polls": Case(ASKER.format(OWN), POLL, says="busy-wait", because="no thread is free", never=("stuck-callback",)),
    "polls_well": Case(ASKER.format(OWN), POLL, THREADS.format(2), says="silent", never=("busy-wait",)),
    "spins_inside": Case(
        ASKER.format(OWN),
        "def ask(self):\n"
        "    rclpy.spin_until_future_complete(self, self.client.call_async(Trigger.Request()), timeout_sec=0.3)\n",
        "executor = SingleThreadedExecutor()\nexecutor.add_node(node)\nexecutor.spin()",
        says="nested-spin",
        because="took the node away",
        never=("spinning-ended",),
    ),
    "spins_before": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    pass\n",
        "rclpy.spin_once(node)\nrclpy.spin(node)",
        says="silent",
        never=("nested-spin", "spinning-ended", "not-spinning"),
    ),
    "rate": Case(
        "self.rate = self.create_rate(20)\nself.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    while True:\n        self.rate.sleep()\n",
        says="rate-in-callback",
        never=("stuck-callback",),
    ),
    "rate_well": Case(
        "self.rate = self.create_rate(20)\nself.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.rate.sleep()\n",
        THREADS.format(2),
        says="silent",
        never=("rate-in-callback", "rate-unspun"),
    ),
    "rate_unspun": Case(main="rate = node.create_rate(20)\nrate.sleep()", says="rate-unspun"),
    "loops": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    number = 0\n    while True:\n        number += 1\n",
        says="stuck-callback",
        because="the loop in line",
        never=("starved", "busy-wait"),
    ),
    "works_long": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    time.sleep(0.2)\n",
        says="silent",
        never=("stuck-callback",),
    ),
    # Spinning.
    "never_spins": Case(
        TALK, main="threading.Event().wait()", says="not-spinning", because="`threading.Event().wait()`"
    ),
    "needs_no_spin": Case(
        main="while rclpy.ok():\n    time.sleep(0.1)",
        says="silent",
        never=("not-spinning", "node-not-added"),
        ready=lambda it: it.age > 1,
    ),
    "in_init": Case(
        TALK + "while True:\n    pass\n", says="stuck-in-init", because="`while True:`", never=("not-spinning",)
    ),
    "slow_init": Case(TALK + "time.sleep(0.3)\n", says="silent", never=("stuck-in-init", "timer-period")),
    "not_added": Case(TALK, main="SingleThreadedExecutor().spin()", says="node-not-added", never=("not-spinning",)),
    "ends_spinning": Case(
        TALK,
        main="executor = SingleThreadedExecutor()\nexecutor.add_node(node)\nexecutor.spin_once()\ntime.sleep(60)",
        says="spinning-ended",
        because="`time.sleep(60)`",
    ),
    "spins_in_a_loop": Case(
        TALK,
        main="while rclpy.ok():\n    rclpy.spin_once(node, timeout_sec=0.05)",
        says="silent",
        never=("spinning-ended", "not-spinning", "node-not-added"),
    ),
    # Errors in callbacks.
    "raises": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.nothing()\n",
        THREADS.format(2),
        says="callback-exception",
        because="nothing",
    ),
    "catches": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    try:\n        self.nothing()\n    except AttributeError:\n        pass\n",
        says="silent",
        never=("callback-exception", "thread-exception"),
    ),
    "thread_raises": Case(
        "self.create_timer(0.05, self.tick)\nthreading.Thread(target=self.work).start()\n",
        "def tick(self):\n    pass\n\ndef work(self):\n    raise ValueError('no')\n",
        says="thread-exception",
        because="ValueError: no",
        never=("callback-exception",),
    ),
    "wrong_field": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.out.publish(String(data=5))\n",
        THREADS.format(2),
        says="message-field",
        because="`data` is of type string, and its value is 5 (int)",
        never=("callback-exception", "message-type"),
    ),
    "wrong_message": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.out.publish('x')\n",
        THREADS.format(2),
        says="message-type",
        because="'x' (str)",
        never=("callback-exception", "message-field"),
    ),
    # Silence.
    "long_period": Case(
        "self.create_timer(500.0, lambda: None)\n", says="timer-period", because="every 500 s", never=("silent",)
    ),
    "two_periods": Case(
        "self.create_timer(500.0, lambda: None)\nself.create_timer(0.05, lambda: None)\n",
        says="silent",
        because="every 0.05 s) fired",
        never=("timer-period",),
    ),
    # Together.
    "one_thread": Case(
        TWO.format("", ""), SLOW, says="single-threaded-executor", because="one callback at a time", ask=together()
    ),
    "no_groups": Case(
        TWO.format("", ""),
        SLOW,
        THREADS.format(4),
        says="no-callback-groups",
        ask=together(),
        never=("single-threaded-executor", "few-threads", "one-group"),
    ),
    "one_group": Case(
        "group = Exclusive()\n" + TWO.format(", callback_group=group", ", callback_group=group"),
        SLOW,
        THREADS.format(4),
        says="one-group",
        ask=together(),
        never=("no-callback-groups",),
    ),
    "two_threads": Case(
        TWO.format(OWN, OWN),
        SLOW,
        THREADS.format(2),
        says="few-threads",
        because="2 threads, and 3",
        ask=together(3),
        never=("one-group", "machine-threads"),
    ),
    "any_threads": Case(
        TWO.format(OWN, OWN),
        SLOW,
        THREADS.format(2).replace("num_threads=2", ""),
        says="machine-threads",
        ask=together(8),
        never=("few-threads",),
    ),
    "groups": Case(
        TWO.format(OWN, OWN),
        SLOW,
        THREADS.format(4),
        ask=together(),
        never=(
            "single-threaded-executor",
            "few-threads",
            "machine-threads",
            "one-group",
            "exclusive-group",
            "no-callback-groups",
        ),
    ),
    "exclusive": Case(
        "self.create_timer(0.05, self.slow)\n",
        SLOW,
        THREADS.format(4),
        says="exclusive-group",
        ask=together(itself=True),
    ),
    "reentrant": Case(
        "self.create_timer(0.05, self.slow, callback_group=Reentrant())\n",
        SLOW,
        THREADS.format(4),
        ask=together(itself=True),
        never=("exclusive-group", "no-callback-groups"),
    ),
    "starves": Case(
        "group = Exclusive()\n" + TWO.format(", callback_group=group", ", callback_group=group"),
        SLOW,
        THREADS.format(4),
        says="starved",
        because="made in line",
        ask=starved,
    ),
    "shares": Case(
        "group = Exclusive()\n" + TWO.format(", callback_group=group", ", callback_group=group"),
        SLOW.replace("0.1", "0.001"),
        THREADS.format(4),
        ask=starved,
        never=("starved", "single-threaded-executor", "few-threads"),
    ),
    "timer_waits": Case(
        ASKER.format(OWN) + "self.create_timer(0.05, lambda: None)\n",
        CALL,
        THREADS.format(4),
        says="",
        ask=lambda scene, name: diagnosis.waits_for_its_group(scene),
        never=("timer-same-group",),
    ),
    "timer_waits_for_a_subscription": Case(
        SERVER + CLIENT.format(OWN) + "self.create_subscription(String, '~/out', self.ask, 10)\n" + TALK,
        CALL.replace("self)", "self, message)"),
        THREADS.format(4),
        says="timer-same-group",
        ask=lambda scene, name: diagnosis.waits_for_its_group(scene),
    ),
}


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[Diagnosis | None, str]]]:
    """What is said about each program in the end, and what it printed."""
    folder = tmp_path_factory.mktemp("programs")
    for name, case in CASES.items():
        (folder / f"{name}.py").write_text(case.source(name))
    session.current.configure(folder, Isolation.NONE, 7)
    found: dict[str, tuple[Diagnosis | None, str]] = {}
    names = list(CASES)
    for start in range(0, len(names), TOGETHER):
        batch = names[start : start + TOGETHER]
        with launch(*batch) as ros:
            programs = {node.program: program for node, program in ros.programs}

            def scene_of(name: str) -> Scene:
                return Scene(ros.observer, [programs[name]], [], folder, [[]])  # noqa: B023

            def answered(name: str) -> bool:
                case, scene = CASES[name], scene_of(name)
                (it,) = scene.insides
                if case.never and case.says in ("", "silent") and not case.ready(it):
                    return False
                said = case.ask(scene, name)
                found[name] = (said, programs[name].output() if said is None else "")  # noqa: B023
                return (said.code if said else "") == case.says

            for name in batch:
                ros.observer.wait(lambda: answered(name), 8.0)  # noqa: B023
    yield found
    session.current.close()


@pytest.mark.parametrize("name", CASES)
def test_a_reason_is_given_where_it_was_seen_and_only_there(
    name: str, answers: dict[str, tuple[Diagnosis | None, str]]
) -> None:
    case, (said, output) = CASES[name], answers[name]
    assert (said.code if said else "") == case.says, (said, output)
    assert said is None or case.because in said.because, said
    assert said is None or said.code not in case.never
