"""Programs for `test_diagnosis.py`: for each reason one where it must speak, and a near miss where it must not."""

from __future__ import annotations

import textwrap
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci, NestedMessage

from autograder import diagnosis
from autograder.diagnosis import Scene
from autograder.diagnosis.inside import Inside
from autograder.graph.recording import quiet_profile
from autograder.reasons import Reason

PRELUDE = """
import threading, time
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup as Exclusive, ReentrantCallbackGroup as Reentrant
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci, NestedMessage
"""

Ask = Callable[[Scene, str], Reason | None]


def silent(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_silent(scene, f"/{name}/out", String, quiet_profile())


def silent_late(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_silent(scene, f"/{name}/map", String, LATCHED)


def unlogged(scene: Scene, name: str) -> Reason | None:
    return diagnosis.nothing_due(scene, f"/{name}")


def inside(scene: Scene, name: str) -> Reason | None:
    return diagnosis.inside_reason(scene, f"/{name}")


def together(at_once: int = 2, itself: bool = False) -> Ask:
    return lambda scene, name: diagnosis.why_not_together(scene, "", at_once, itself)


def alike(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_all_alike(scene)


def meanwhile(scene: Scene, name: str) -> Reason | None:
    """Why nothing was published in the last half second."""
    return diagnosis.sent_nothing(scene, f"/{name}/out", [(time.time() - 0.5, time.time())])


def shut_down(scene: Scene, name: str) -> Reason | None:
    return None if scene.programs[0].running() else diagnosis.shut_down_inside(scene)


def starved(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_starved(scene)


def kept_waiting(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_kept_waiting(scene, f"/{name}/gate")


def trouble(scene: Scene, name: str) -> Reason | None:
    return diagnosis.program_trouble(scene)


def of_goal(ask: str, *more: str) -> Ask:
    return lambda scene, name: getattr(diagnosis, ask)(scene, f"/{name}/count", *more)


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
ABROAD = """
other = rclpy.create_node('other', namespace='/{}')
other.create_publisher(String, 'words', 10)
other.create_subscription(String, '/heard', print, 10)
other.create_timer(0.05, lambda: None)
node.create_publisher(String, '/{}/heard', 10)
executor = MultiThreadedExecutor(num_threads=2)
executor.add_node(node)
executor.add_node(other)
executor.spin()
"""
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
ONCE = "self.client.call_async(Trigger.Request())\n"
ANSWER = "def answer(self, request, response):\n    {}\n"
CONFIGURE = "def on_configure(self, state):\n    {}\n"
TRIGGER = "node.trigger_configure()\nrclpy.spin(node)"
MANAGED = "self.create_timer(0.05, lambda: self.managed.publish(String()))\n"
MAP = (
    "kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL{})\n"
    "self.map = self.create_publisher(String, '~/map', kept)\nself.map.publish(String())\n"
)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STRICT = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    deadline=Duration(seconds=1),
    liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
    liveliness_lease_duration=Duration(seconds=1),
)
_BEST = {
    "durability": ", durability=DurabilityPolicy.TRANSIENT_LOCAL",
    "deadline": ", deadline=Duration(seconds=0.5)",
    "liveliness": ", liveliness=LivelinessPolicy.MANUAL_BY_TOPIC",
    "lease": ", liveliness_lease_duration=Duration(seconds=0.5)",
}
OFFERS = {
    policy: "".join(words for other, words in _BEST.items() if other != policy)
    + (", reliability=ReliabilityPolicy.BEST_EFFORT" if policy == "reliability" else "")
    for policy in ("reliability", *_BEST)
}

WORKS_AND_ANSWERS = """
self.lock = threading.Lock()
self.own = Reentrant()
self.create_timer(0.05, self.work, callback_group=self.{0})
self.create_service(Trigger, "~/gate", self.gate, callback_group=self.{1})
self.client = self.create_client(Trigger, "~/gate", callback_group=Reentrant())
self.create_timer(0.05, lambda: self.client.call_async(Trigger.Request()), callback_group=Reentrant())
"""
WORK_AND_GATE = """
def work(self):
    {}:
        time.sleep(0.3)

def gate(self, request, response):
    {}:
        return response
"""


def no_end(scene: Scene, name: str) -> Reason | None:
    return diagnosis.why_no_endpoint(scene, f"/{name}/more", String, "publisher", f"/{name}")


def no_end_under_a_rule(scene: Scene, name: str) -> Reason | None:
    """As if the program had been given a rule for what it makes in `on_activate`."""
    ruled = replace(scene, rules=[["~/more:=path"]] * len(scene.programs))
    return diagnosis.why_no_endpoint(ruled, "/path", String, "publisher", f"/{name}")


LATER = "def {}(self, state):\n    self.more = self.create_publisher(String, '~/more', 10)\n{}"
SUCCESS = "    return TransitionCallbackReturn.SUCCESS\n"
ANSWERED = lambda it: any(thing.kind == "service" and thing.done >= 2 for thing in it.callbacks)  # noqa: E731

AGREE = ", cancel_callback=lambda goal: CancelResponse.ACCEPT"
COUNTS = (
    "self.server = ActionServer(self, Fibonacci, '~/count', self.execute{})\n"
    "self.client = ActionClient(self, Fibonacci, '~/count')\n"
    "self.asked = self.create_timer(0.05, self.ask, callback_group=Reentrant())\n"
)
EXECUTE = """
def ask(self):
    if self.client.server_is_ready():
        self.asked.cancel()
        self.client.send_goal_async(Fibonacci.Goal(order=3)).add_done_callback(self.accepted)

def accepted(self, future):
    future.result().get_result_async()

def execute(self, goal):
"""
FEEDBACK = "    goal.publish_feedback(Fibonacci.Feedback(sequence=[1]))\n"
SUCCEED = "    goal.succeed()\n    return Fibonacci.Result()\n"
EXECUTED = lambda it: any(thing.kind == "execute" and thing.done for thing in it.things.values())  # noqa: E731
ASKED = lambda it: any(thing.kind == "goal" and thing.done for thing in it.things.values())  # noqa: E731

CASES = {
    # Goals of an action.
    "execute_raises": Case(
        COUNTS.format(AGREE),
        EXECUTE + FEEDBACK + "    raise ValueError('too far')\n",
        says="execute-exception",
        because="too far",
        never=("no-succeed", "execute-return"),
        ask=of_goal("why_not_finished"),
    ),
    "execute_raises_and_the_node_goes_on": Case(
        TALK + COUNTS.format(AGREE),
        EXECUTE + "    raise ValueError('too far')\n",
        says="silent",
        never=("execute-exception", "callback-exception"),
        ready=EXECUTED,
    ),
    "execute_returns_nothing": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.succeed()\n",
        THREADS.format(2),
        says="execute-return",
        because="None instead of Fibonacci_Result",
        never=("no-succeed", "execute-exception"),
        ask=of_goal("why_not_finished"),
    ),
    "execute_returns_the_feedback": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.succeed()\n    return Fibonacci.Feedback()\n",
        THREADS.format(2),
        says="execute-return",
        because="Fibonacci_Feedback instead of Fibonacci_Result",
        ask=of_goal("why_not_finished"),
    ),
    "result_of_whole_numbers": Case(
        COUNTS.format(AGREE).replace("Fibonacci", "NestedMessage"),
        EXECUTE.replace("Fibonacci.Goal(order=3)", "NestedMessage.Goal()")
        + "    goal.succeed()\n    result = NestedMessage.Result()\n    result.nested_field.float64_value = 5\n"
        "    return result\n",
        THREADS.format(2),
        says="message-field",
        because="a wrong number in its result on `/result_of_whole_numbers/count`: the field `nested_field.float64",
        never=("execute-return",),
        ask=of_goal("why_not_finished"),
    ),
    "feedback_is_a_list": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.publish_feedback([1, 2])\n" + SUCCEED,
        says="message-type",
        because="Fibonacci_Feedback",
        never=("execute-exception", "no-feedback"),
        ask=of_goal("why_no_feedback"),
    ),
    "does_not_succeed": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    return Fibonacci.Result()\n",
        says="no-succeed",
        because="goal_handle.canceled()",
        ask=of_goal("why_not_finished", "canceled"),
    ),
    "cancels_by_itself": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.canceled()\n    return Fibonacci.Result()\n",
        says="execute-exception",
        because="without a request to cancel",
        ask=of_goal("why_not_finished"),
    ),
    "ends_twice": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.abort()\n" + SUCCEED,
        says="execute-exception",
        because="a goal can end only once",
        ask=of_goal("why_not_finished"),
    ),
    "sets_the_status": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.status = 4\n    return Fibonacci.Result()\n",
        says="execute-exception",
        because="A call in the execute callback sets the status",
        ask=of_goal("why_not_finished"),
    ),
    "executes_twice": Case(
        COUNTS.format(AGREE + ", handle_accepted_callback=self.take"),
        EXECUTE + SUCCEED + "\ndef take(self, goal):\n    goal.execute()\n    goal.execute()\n",
        says="callback-exception",
        because="It ended the spinning. `execute()` was called for a goal whose execution has already begun",
    ),
    "executes_when_it_has_ended": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.succeed()\n    goal.execute()\n    return Fibonacci.Result()\n",
        says="execute-exception",
        because="The goal keeps its earlier status, with an empty result; the node continues. `execute()` was called",
        ask=of_goal("why_not_finished"),
    ),
    "aborts_by_itself": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    goal.abort()\n    return Fibonacci.Result()\n",
        never=("no-succeed", "execute-return", "execute-exception"),
        ask=of_goal("why_not_finished"),
        ready=EXECUTED,
    ),
    "decides_nothing": Case(
        COUNTS.format(", goal_callback=lambda goal: None"),
        EXECUTE + SUCCEED,
        says="goal-return",
        because="None instead of GoalResponse",
        ask=of_goal("why_rejected"),
    ),
    "rejects": Case(
        COUNTS.format(", goal_callback=lambda goal: GoalResponse.REJECT"),
        EXECUTE + SUCCEED,
        never=("goal-return",),
        ask=of_goal("why_rejected"),
        ready=ASKED,
    ),
    "no_feedback": Case(
        COUNTS.format(AGREE),
        EXECUTE + SUCCEED,
        says="no-feedback",
        ask=of_goal("why_no_feedback"),
    ),
    "no_feedback_at_first": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    if goal.request.order > 5:\n    " + FEEDBACK + SUCCEED,
        says="no-feedback",
        because="Feedback(sequence=[1]))`) should publish feedback",
        ask=of_goal("why_no_feedback"),
    ),
    "waits_for_its_rate": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    rate = self.create_rate(20)\n    rate.sleep()\n" + FEEDBACK + SUCCEED,
        says="rate-in-callback",
        because="inside a callback waits for a timer",
        never=("no-feedback",),
        ask=of_goal("why_no_feedback"),
    ),
    "some_feedback": Case(
        COUNTS.format(AGREE),
        EXECUTE + FEEDBACK + SUCCEED,
        never=("no-feedback",),
        ask=of_goal("why_no_feedback"),
        ready=EXECUTED,
    ),
    "cannot_be_canceled": Case(
        COUNTS.format(""),
        EXECUTE + SUCCEED,
        says="no-cancel-callback",
        ask=of_goal("why_not_canceled"),
    ),
    "cancels_nothing": Case(
        COUNTS.format(", cancel_callback=lambda goal: None"),
        EXECUTE.replace("future.result().get_result_async()", "future.result().cancel_goal_async()")
        + "    time.sleep(0.2)\n"
        + SUCCEED,
        THREADS.format(2),
        says="cancel-return",
        never=("no-cancel-callback",),
        ask=of_goal("why_not_canceled"),
    ),
    "holds_the_thread": Case(
        COUNTS.format(AGREE),
        EXECUTE.replace("def execute", "async def execute") + "    time.sleep(0.5)\n" + SUCCEED,
        THREADS.format(1),
        says="goal-holds-thread",
        because="only `await` frees the thread. Give it two threads",
        never=("cancel-return", "goal-holds-group"),
        ask=of_goal("why_not_canceled"),
    ),
    "has_two_threads": Case(
        COUNTS.format(AGREE),
        EXECUTE + "    time.sleep(0.5)\n" + SUCCEED,
        THREADS.format(2),
        never=("goal-holds-thread", "goal-holds-group", "no-cancel-callback", "cancel-return"),
        ask=of_goal("why_not_canceled"),
        ready=EXECUTED,
    ),
    "awaits_its_goal": Case(
        "self.later = rclpy.task.Future()\nself.create_timer(0.6, lambda: self.later.set_result(None))\n"
        + COUNTS.format(AGREE),
        EXECUTE.replace("def execute", "async def execute") + "    await self.later\n" + SUCCEED,
        never=("goal-holds-thread",),
        ask=of_goal("why_not_canceled"),
        ready=EXECUTED,
    ),
    "holds_the_group": Case(
        COUNTS.format(AGREE + ", handle_accepted_callback=self.take"),
        EXECUTE + SUCCEED + "\ndef take(self, goal):\n    time.sleep(0.5)\n    goal.execute()\n",
        THREADS.format(3),
        says="goal-holds-group",
        never=("goal-holds-thread",),
        ask=of_goal("why_waits_for_a_goal"),
    ),
    "other_action": Case(
        COUNTS.format(AGREE),
        EXECUTE + SUCCEED,
        says="action-name",
        because="`/other_action/count` (`~/count` in the code)",
        never=("no-action",),
        ask=lambda scene, name: diagnosis.why_no_action(scene, f"/{name}/cuont", Fibonacci),
    ),
    "other_action_type": Case(
        COUNTS.format(AGREE),
        EXECUTE + SUCCEED,
        says="wrong-type",
        because="test_msgs/action/Fibonacci, not test_msgs/action/NestedMessage",
        never=("action-name", "no-action"),
        ask=lambda scene, name: diagnosis.why_no_action(scene, f"/{name}/count", NestedMessage),
    ),
    "no_action": Case(
        says="no-action",
        never=("action-name",),
        ask=lambda scene, name: diagnosis.why_no_action(scene, "/zzz", Fibonacci),
    ),
    # Ends that the code makes later.
    "makes_it_in_activate": Case(
        methods=LATER.format("on_activate", SUCCESS),
        main=TRIGGER,
        base="LifecycleNode",
        says="not-made-yet",
        because="in `on_activate`, line",
        never=("taken-away",),
        ask=no_end,
    ),
    "makes_it_in_activate_under_a_rule": Case(
        methods=LATER.format("on_activate", SUCCESS),
        main=TRIGGER,
        base="LifecycleNode",
        says="not-made-yet",
        because="in `on_activate`, line",
        never=("rule-without-match",),
        ask=no_end_under_a_rule,
    ),
    "makes_it_in_a_method_that_nobody_calls": Case(
        methods="def make(self):\n    self.more = self.create_publisher(String, '~/more', 10)\n",
        says="not-made-yet",
        because="what calls `make`",
        ask=no_end,
    ),
    "makes_it_after_an_endless_loop": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    while True:\n        time.sleep(0.01)\n"
        "    self.more = self.create_publisher(String, '~/more', 10)\n",
        says="stuck-callback",
        because="the loop in lines",
        never=("not-made-yet",),
        ask=no_end,
    ),
    "no_end_for_a_rule": Case(
        says="rule-without-match",
        because="nothing is called",
        never=("not-made-yet",),
        ask=no_end_under_a_rule,
    ),
    "made_it_and_took_it_away": Case(
        TALK,
        LATER.format("on_configure", "    self.destroy_publisher(self.more)\n" + SUCCESS),
        TRIGGER,
        base="LifecycleNode",
        says="taken-away",
        because="and has destroyed it since",
        never=("not-made-yet", "topic-name"),
        ask=no_end,
    ),
    # Why a service waits for another callback.
    "waits_in_its_group": Case(
        WORKS_AND_ANSWERS.format("default_callback_group", "default_callback_group"),
        WORK_AND_GATE.format("if True", "if True"),
        THREADS.format(4),
        says="one-group",
        because="the node's default group",
        ask=kept_waiting,
    ),
    "waits_for_the_thread": Case(
        WORKS_AND_ANSWERS.format("default_callback_group", "own"),
        WORK_AND_GATE.format("with self.lock", "with self.lock"),
        says="single-threaded-executor",
        because="has one thread",
        ask=kept_waiting,
    ),
    "waits_for_the_lock": Case(
        WORKS_AND_ANSWERS.format("default_callback_group", "own"),
        WORK_AND_GATE.format("with self.lock", "with self.lock"),
        THREADS.format(4),
        says="waits-for-lock",
        because="takes `self.lock` in line",
        ask=kept_waiting,
    ),
    "answers_at_once": Case(
        WORKS_AND_ANSWERS.format("default_callback_group", "own"),
        WORK_AND_GATE.format("with self.lock", "if True"),
        THREADS.format(4),
        never=("one-group", "single-threaded-executor", "waits-for-lock"),
        ask=kept_waiting,
        ready=ANSWERED,
    ),
    "never_gets_the_lock": Case(
        "self.lock = threading.Lock()\nself.lock.acquire()\n" + TALK + "self.create_timer(0.05, self.work)\n",
        "def work(self):\n    with self.lock:\n        pass\n",
        says="waits-for-lock",
        because="on every path and also after an error: `with self.lock:` does so",
        never=("stuck-callback",),
    ),
    "waits_for_who_holds_the_lock": Case(
        "self.lock = threading.Lock()\n"
        "self.create_timer(0.05, self.work, callback_group=Exclusive())\n"
        "self.create_timer(0.05, self.wait, callback_group=Exclusive())\n",
        "def work(self):\n    with self.lock:\n        time.sleep(60)\n\n"
        "def wait(self):\n    with self.lock:\n        pass\n",
        THREADS.format(3),
        says="waits-for-lock",
        because="Callbacks that take the same lock run one after another",
    ),
    "takes_the_lock_twice": Case(
        "self.lock = threading.Lock()\n" + TALK + "self.create_timer(0.05, self.work)\n",
        "def work(self):\n    with self.lock:\n        self.more()\n\n"
        "def more(self):\n    with self.lock:\n        pass\n",
        says="waits-for-lock",
        because="it already holds this lock",
        never=("stuck-callback",),
    ),
    "takes_another_lock": Case(
        "self.lock, self.other = threading.Lock(), threading.Lock()\nself.other.acquire()\n"
        + TALK
        + "self.create_timer(0.05, self.work)\n",
        "def work(self):\n    with self.lock:\n        self.more()\n\n"
        "def more(self):\n    with self.other:\n        pass\n",
        says="waits-for-lock",
        because="what it takes there is not free",
    ),
    "never_gets_the_semaphore": Case(
        "self.some = threading.Semaphore(2)\n" + TALK + "self.create_timer(0.05, self.work)\n",
        "def work(self):\n    self.some.acquire()\n",
        says="waits-for-lock",
        because="because the semaphore that it needs is not free",
    ),
    "holds_the_lock": Case(
        "self.lock = threading.Lock()\nself.create_timer(0.05, self.work)\n",
        "def work(self):\n    with self.lock:\n        time.sleep(60)\n",
        says="stuck-callback",
        never=("waits-for-lock",),
    ),
    "leaves_a_thread": Case(
        TALK,
        main="threading.Thread(target=node.stay).start()\nrclpy.spin_once(node)",
        methods="def stay(self):\n    while True:\n        time.sleep(0.1)\n",
        says="thread-left",
        because="is still in `stay`",
        never=("spinning-ended",),
    ),
    "keeps_a_thread": Case(
        TALK,
        main="threading.Thread(target=node.stay).start()\nrclpy.spin(node)",
        methods="def stay(self):\n    while True:\n        time.sleep(0.1)\n",
        says="silent",
        never=("thread-left",),
    ),
    "calls_its_callback": Case(
        "self.create_timer(0.05, self.tick())\n",
        "def tick(self):\n    pass\n",
        says="callback-exception",
        because="creates is None",
    ),
    # Blocked callbacks.
    "calls": Case(ASKER.format(""), CALL, says="call-in-callback", because="occupies the only thread"),
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
    "waits_long_for_nobody": Case(
        "self.create_client(Trigger, '/parking').wait_for_service(timeout_sec=60.0)\n",
        says="waits-for-service",
        because="how long it is",
    ),
    "waits_in_a_callback": Case(
        "client = self.create_client(Trigger, '/zzz')\n"
        "self.create_timer(0.05, lambda: client.wait_for_service(timeout_sec=0.3))\n",
        says="waits-for-service",
        because="ask `service_is_ready()`",
    ),
    "waits_for_the_second": Case(
        SERVER + "self.clients_ = [self.create_client(Trigger, name) for name in ('~/gate', '~/door')]\n",
        main="for client in node.clients_:\n"
        "    client.wait_for_service()\n"
        "    rclpy.spin_until_future_complete(node, client.call_async(Trigger.Request()))",
        says="waits-for-service",
        because="/door`",
        never=("spinning-ended",),
    ),
    "waits_well": Case(
        SERVER + CLIENT.format("") + "self.client.wait_for_service()\n" + TALK,
        says="silent",
        never=("waits-for-service",),
    ),
    "awaits": Case(ASKER.format(""), AWAIT, says="await-same-group", because="await self.client"),
    "awaits_well": Case(
        ASKER.format(OWN), AWAIT, says="silent", never=("await-same-group", "spinning-ended", "never-awaited")
    ),
    "awaits_never": Case(
        "self.create_timer(0.05, lambda: self.ask())\n",
        "async def ask(self):\n    self.out.publish(String())\n",
        says="never-awaited",
        because="It.ask` was called, but never awaited",
    ),
    "asks_as_another_type": Case(
        "from rclpy.context import Context\nfrom std_srvs.srv import SetBool\n"
        "context = Context()\ncontext.init()\n"  # of one context Fast DDS would refuse the client
        "self.other = rclpy.create_node('other', context=context)\n"
        "self.other.create_service(Trigger, f'/{self.get_name()}/gate', lambda request, response: response)\n"
        "self.client = self.create_client(SetBool, '~/gate')\nself.client.call_async(SetBool.Request())\n"
        "self.create_timer(0.05, lambda: None)\n",
        says="wrong-type",
        because="the type std_srvs/srv/SetBool, but the service has the type std_srvs/srv/Trigger",
        never=("waits-for-service",),
    ),
    "polls": Case(ASKER.format(OWN), POLL, says="busy-wait", because="no thread is free", never=("stuck-callback",)),
    "polls_well": Case(ASKER.format(OWN), POLL, THREADS.format(2), says="silent", never=("busy-wait",)),
    "spins_inside": Case(
        ASKER.format(OWN),
        "def ask(self):\n"
        "    rclpy.spin_until_future_complete(self, self.client.call_async(Trigger.Request()), timeout_sec=0.3)\n",
        "executor = SingleThreadedExecutor()\nexecutor.add_node(node)\nexecutor.spin()",
        says="nested-spin",
        because="removes the node from the executor",
        never=("spinning-ended",),
    ),
    "spins_in_vain": Case(
        SERVER + CLIENT.format("") + "self.asked = 0\nself.create_timer(0.05, self.ask)\n",
        "def ask(self):\n"
        "    self.asked += 1\n"
        "    if self.asked < 3:\n"
        "        future = self.client.call_async(Trigger.Request())\n"
        "        rclpy.spin_until_future_complete(self, future, timeout_sec=0.1)\n",
        says="nested-spin",
        because="before its future was done",
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
    "never_comes_to_spin": Case(
        TALK,
        main="while rclpy.ok():\n    time.sleep(0.1)\nrclpy.spin(node)",
        says="not-spinning",
        because="If this call is in the program already, the program has not come to it.",
    ),
    "events_executor": Case(
        TALK,
        main="from rclpy.experimental import EventsExecutor\nexecutor = EventsExecutor()\nexecutor.add_node(node)\n"
        "executor.spin()",
        says="events-executor",
        because="`executor.spin()`",
    ),
    "events_executor_in_a_loop": Case(
        TALK,
        main="from rclpy.experimental import EventsExecutor\nexecutor = EventsExecutor()\nexecutor.add_node(node)\n"
        "while rclpy.ok():\n    executor.spin_once(timeout_sec=0.05)",
        says="silent",
        never=("events-executor", "not-spinning"),
        ready=lambda it: it.age > 2,
    ),
    "spins_another_first": Case(
        TALK,
        main="other = rclpy.create_node('other')\nrclpy.spin(other)\nrclpy.spin(node)",
        says="not-spinning",
        because="Only `/other` is spun. `spin` returns only at shutdown, so a second `spin` after it is not reached.",
    ),
    "spun_another_once": Case(
        TALK,
        main="other = rclpy.create_node('other')\nrclpy.spin_once(other, timeout_sec=0.1)\nthreading.Event().wait()",
        says="not-spinning",
        because="(`threading.Event().wait()`). Call `rclpy.spin(node)`",
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
    "in_what_init_calls": Case(
        TALK + "self.work()\n",
        "def work(self):\n    while True:\n        time.sleep(0.1)\n",
        says="stuck-in-init",
        because="(`self.work()`), and there in the loop in line",
        never=("not-spinning",),
    ),
    "in_the_init_of_no_node": Case(
        TALK,
        "def work(self):\n    while True:\n        time.sleep(0.1)\n",
        "class App:\n    def __init__(self):\n        node.work()\nApp()",
        says="not-spinning",
        never=("stuck-in-init",),
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
    "thread_exits": Case(
        "import sys\nself.create_timer(0.05, lambda: None)\nthreading.Thread(target=sys.exit).start()\n",
        says="thread-exception",
        because="which ends only the thread in which it is raised",
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
        "self.create_timer(500.0, lambda: None)\n", says="timer-period", because="every 500 s)", never=("silent",)
    ),
    "in_milliseconds": Case(
        "self.create_timer(250, lambda: None)\n", says="timer-period", because="For 250 milliseconds, write `0.25`."
    ),
    "another_sends": Case(
        "self.create_timer(500.0, lambda: None)\n"
        "self.create_subscription(String, '~/in', lambda message: self.out.publish(message), 10)\n",
        says="silent",
        never=("timer-period",),
        ready=lambda it: it.age > 1,
    ),
    "logs_later": Case(
        "self.create_timer(500.0, lambda: None)\n", says="timer-period", because="every 500 s)", ask=unlogged
    ),
    "cancelled": Case(
        TALK.replace("self.create", "timer = self.create") + "timer.cancel()\nself.create_timer(0.05, lambda: None)\n",
        says="silent",
        because="has not fired and is cancelled until `reset()` is called, the timer (line",
        never=("timer-period",),
    ),
    "cancelled_and_reset": Case(
        "timer = self.create_timer(50.0, lambda: None)\ntimer.cancel()\ntimer.reset()\n"
        "self.create_timer(0.05, lambda: None)\n",
        says="silent",
        because="every 50 s) has not fired, the timer (line",
        never=("timer-period",),
    ),
    "two_periods": Case(
        "self.create_timer(500.0, lambda: None)\nself.create_timer(0.05, lambda: None)\n",
        says="silent",
        because="every 500 s) has not fired, the timer (line",
        never=("timer-period",),
    ),
    "outlived": Case(
        MAP.format(", lifespan=Duration(seconds=0.2)") + TALK,
        says="lifespan",
        because="The publisher's lifespan is 0.2 s",
        never=("silent",),
        ask=silent_late,
    ),
    "outlives": Case(
        MAP.format(", lifespan=Duration(seconds=600)") + TALK, says="silent", never=("lifespan",), ask=silent_late
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
    "quick_callbacks": Case(  # nothing waits for them, whatever groups they are in
        TWO.format("", ""),
        "def slow(self):\n    pass\n",
        ask=together(),
        never=("no-callback-groups", "single-threaded-executor", "one-group"),
    ),
    "holds_back": Case(
        "self.runs = 0\nself.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.runs += 1\n    if self.runs < 9:\n        self.out.publish(String())\n",
        says="ran-and-sent-nothing",
        because="ran 9 times",
        ask=meanwhile,
        never=("no-callback-groups", "cancelled-meanwhile"),
    ),
    "kept_waiting_beside_another": Case(  # the timer that runs is not the one that publishes
        "self.first = True\nself.create_timer(0.05, self.tick, callback_group=Exclusive())\n"
        "self.create_timer(0.05, lambda: None, callback_group=Exclusive())\n",
        "def tick(self):\n    self.first or time.sleep(1000)\n    self.out.publish(String())\n    self.first = False\n",
        THREADS.format(3),
        ask=meanwhile,
        ready=lambda it: it.age > 3 and any(thing.done >= 20 for thing in it.callbacks),
        never=("ran-and-sent-nothing", "cancelled-meanwhile"),
    ),
    "pauses_itself": Case(
        "self.ticks = self.create_timer(0.05, self.tick, callback_group=Exclusive())\nself.runs = 0\n"
        "self.create_timer(0.6, self.go_on, callback_group=Exclusive())\n",
        "def tick(self):\n    self.out.publish(String())\n    self.runs += 1\n"
        "    if self.runs % 3 == 0:\n        self.ticks.cancel()\n"
        "def go_on(self):\n    self.ticks.reset()\n",
        says="cancelled-meanwhile",
        because="cancelled the timer of `tick`",
        ask=lambda scene, name: diagnosis.sent_nothing(
            scene,
            f"/{name}/out",
            [
                (at + time.time() - time.monotonic() + 0.05, at + time.time() - time.monotonic() + 0.3)
                for inside in scene.insides
                for at in [max((thing.cancelled_at for thing in inside.callbacks), default=0)]
                if at
            ],
        ),
        never=("ran-and-sent-nothing",),
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
        because="2 threads, but 3",
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
            "group-limit",
        ),
    ),
    "two_of_three": Case(
        "group = Exclusive()\nself.create_timer(0.05, self.slow, callback_group=Exclusive())\n"
        + TWO.format(", callback_group=group", ", callback_group=group"),
        SLOW,
        THREADS.format(4),
        says="group-limit",
        because="at most 2 callbacks to run at the same time, but 3 have to",
        ask=together(3),
        never=("one-group",),
    ),
    "a_lock_for_both": Case(
        "self.lock = threading.Lock()\n" + TWO.format(OWN, OWN),
        "def slow(self):\n    with self.lock:\n        time.sleep(0.1)\n",
        THREADS.format(4),
        says="waits-for-lock",
        because="take the same `self.lock`",
        ask=together(),
    ),
    "a_semaphore_for_two": Case(
        "self.some = threading.Semaphore(2)\n" + TWO.format(OWN, OWN),
        "def slow(self):\n    with self.some:\n        time.sleep(0.1)\n",
        THREADS.format(4),
        ask=together(),
        never=("waits-for-lock",),
    ),
    "a_lock_for_each": Case(
        "self.one, self.other = threading.Lock(), threading.Lock()\n"
        "self.create_timer(0.05, self.slow, callback_group=Exclusive())\n"
        "self.create_timer(0.05, self.slower, callback_group=Exclusive())\n",
        "def slow(self):\n    with self.one:\n        time.sleep(0.1)\n\n"
        "def slower(self):\n    with self.other:\n        time.sleep(0.1)\n",
        THREADS.format(4),
        ask=together(),
        never=("waits-for-lock",),
    ),
    "two_executors": Case(
        TWO.format(OWN, OWN),
        SLOW,
        "one, other = SingleThreadedExecutor(), SingleThreadedExecutor()\none.add_node(node)\nother.add_node(node)\n"
        "spins = threading.Event()\none.create_task(spins.set)\n"
        "threading.Thread(target=one.spin, daemon=True).start()\nspins.wait()\nother.spin()",
        says="single-threaded-executor",
        because="a node belongs only to the executor to which it was added last",
        ask=together(),
    ),
    "last_of_the_loop": Case(
        "for word in ('a', 'b'):\n    self.create_timer(0.05, lambda: self.say(word))\n",
        "def say(self, word):\n    self.out.publish(String(data=word))\n",
        says="late-binding",
        because="reads `word` only when it runs",
        ask=alike,
    ),
    "each_of_the_loop": Case(
        "for word in ('a', 'b'):\n    self.create_timer(0.05, lambda word=word: self.say(word))\n",
        "def say(self, word):\n    self.out.publish(String(data=word))\n",
        ask=alike,
        never=("late-binding",),
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
        because="the timer of `slow` (line",
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
    # Programs that end. (A near miss of an end is a program that runs.)
    "syntax": Case(main="if True print()", says="syntax-error", never=("crashed",), ask=trouble),
    "crashes": Case(
        main="raise ValueError('no')",
        says="crashed",
        because="ValueError: no",
        ask=trouble,
        never=("syntax-error", "exited", "not-spinning"),
    ),
    "maps_more_than_there_is": Case(
        main="import mmap, tempfile\nfile = tempfile.TemporaryFile()\nfile.truncate(4096)\n"
        "mapped = mmap.mmap(file.fileno(), 4096)\nfile.truncate(0)\nmapped[0] = 1",
        says="crashed",
        because="a part of a memory-mapped file",
        ask=trouble,
    ),
    "ended_by_another_signal": Case(
        main="import os\nos.abort()", says="crashed", because="was ended by signal 6.", ask=trouble
    ),
    "done_callback_of_none": Case(
        "from rclpy.task import Future\nself.future = Future()\nself.future.add_done_callback(print('done'))\n"
        "self.create_timer(0.05, lambda: self.future.done() or self.future.set_result(1))\n",
        main="rclpy.spin_until_future_complete(node, node.future)\nNone()",
        says="crashed",
        because="Pass a callback without brackets",
        ask=trouble,
    ),
    "exits": Case(
        main="rclpy.spin_once(node, timeout_sec=0.1)\nprint('bye')",
        says="exited",
        because="`bye`",
        ask=trouble,
        never=("crashed", "not-spinning"),
    ),
    "exits_after_one": Case(
        main="def spin(it):\n    rclpy.spin_once(it, timeout_sec=0.1)\nspin(node)",
        says="exited",
        because="`) runs at most one callback and then returns",
        ask=trouble,
    ),
    "exits_after_future": Case(
        main="def spin(it):\n    rclpy.spin_until_future_complete(it, rclpy.Future(), timeout_sec=0.1)\nspin(node)",
        says="exited",
        because="Look at what completes this future",
        ask=trouble,
        never=("not-spinning",),
    ),
    "exits_unspun": Case(main="pass", says="not-spinning", ask=trouble, never=("exited",)),
    "undeclared": Case(
        "self.get_parameter('rate')\n", says="parameter-not-declared", ask=trouble, never=("parameter-type", "crashed")
    ),
    "no_response": Case(
        "self.create_service(Trigger, '~/gate', self.answer)\n" + CLIENT.format("") + ONCE,
        "def answer(self, request):\n    return Trigger.Response()\n",
        says="service-exception",
        because="It could not be called, because the function takes a different number of arguments",
        ask=inside,
    ),
    "builtin_callback": Case(
        "from collections import deque\nself.create_subscription(String, '~/in', deque().append, 10)\n",
        says="builtin-callback",
        ask=trouble,
        never=("crashed",),
    ),
    "with_init": Case(
        main="with rclpy.init(context=rclpy.Context()):\n    pass", says="crashed", because="returns None", ask=trouble
    ),
    "two_spins": Case(
        main="other = rclpy.create_node('other')\n"
        "threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()\n"
        "threading.Event().wait(0.5)\nrclpy.spin(other)",
        says="crashed",
        because="two threads spin one executor",
        ask=trouble,
    ),
    "time_for_an_executor": Case(
        main="rclpy.spin_until_future_complete(node, rclpy.Future(), 0.5)",
        says="crashed",
        because="`timeout_sec=…`",
        ask=trouble,
    ),
    "stop_iteration": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    next(iter(()))\n",
        says="crashed",
        because="raised StopIteration",
        ask=trouble,
    ),
    "one_place_two_levels": Case(
        "self.create_timer(0.05, self.tick)\n",
        "hot = False\n\ndef tick(self):\n    self.hot = not self.hot\n"
        "    log = self.get_logger().warning if self.hot else self.get_logger().info\n    log('x')\n",
        says="callback-exception",
        because="a separate call",
    ),
    "no_such_module": Case("import car_sensor\n", says="crashed", because="finds no module of this name", ask=trouble),
    "other_value_error": Case("int('x')\n", says="crashed", ask=trouble, never=("builtin-callback",)),
    "deepcopied_profile": Case(
        "from copy import deepcopy\nfrom rclpy.qos import qos_profile_sensor_data\ndeepcopy(qos_profile_sensor_data)\n",
        says="not-copied",
        ask=trouble,
        never=("crashed",),
    ),
    "deepcopied_lock": Case(
        "from copy import deepcopy\nimport threading\ndeepcopy(threading.Lock())\n",
        says="crashed",
        ask=trouble,
        never=("not-copied",),
    ),
    "names_its_timers": Case(
        "self.timers = []\n", says="crashed", because="another name, such as `self.my_timers`", ask=trouble
    ),
    "sets_a_property_of_its_own": Case(
        "class Door:\n    @property\n    def open(self):\n        return True\n\nDoor().open = False\n",
        says="crashed",
        because="The lines above it in the log",
        ask=trouble,
    ),
    "wrong_parameter": Case(
        main="given = [rclpy.Parameter('rate', value='x')]\n"
        "rclpy.create_node('other', parameter_overrides=given).declare_parameter('rate', 1)",
        says="parameter-type",
        ask=trouble,
        never=("parameter-not-declared", "crashed"),
    ),
    "empty_list": Case(
        main="given = [rclpy.Parameter('names', value=['x'])]\n"
        "rclpy.create_node('other', parameter_overrides=given).declare_parameter('names', [])",
        says="parameter-type",
        because="An empty list as the default",
        ask=trouble,
    ),
    "declared": Case(
        "self.declare_parameter('rate', 1)\nself.get_parameter('rate')\n" + TALK,
        ask=trouble,
        never=(
            "parameter-not-declared",
            "parameter-type",
            "crashed",
            "exited",
            "refused-call",
            "used-after-destroy",
            "shutdown-in-callback",
            "syntax-error",
        ),
    ),
    "starts_processes": Case("import subprocess\nsubprocess.run(['true'])\n", says="refused-call", ask=trouble),
    "destroys": Case(
        "self.destroy_publisher(self.out)\nself.out.publish(String())\n",
        says="used-after-destroy",
        ask=trouble,
        never=("crashed",),
    ),
    "shuts_down": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    rclpy.shutdown()\n",
        "rclpy.spin(node)\nrclpy.shutdown()",
        says="shutdown-in-callback",
        because="failed because of this",
        ask=shut_down,
    ),
    "shuts_down_and_sleeps": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    rclpy.shutdown()\n",
        "rclpy.spin(node)\ntime.sleep(1000)",
        says="spinning-ended",
        because="time.sleep(1000)",
        never=("shutdown-in-callback",),
    ),
    # More errors in callbacks.
    "awaits_asyncio": Case(
        "self.create_timer(0.05, self.tick)\n",
        "async def tick(self):\n    import asyncio\n    await asyncio.sleep(0.1)\n",
        THREADS.format(2),
        says="asyncio-in-callback",
        never=("callback-exception",),
    ),
    "declares_twice": Case(
        "self.create_timer(0.05, self.tick)\n",
        "def tick(self):\n    self.declare_parameter('x', 1)\n",
        THREADS.format(2),
        says="declared-twice",
        never=("callback-exception",),
    ),
    "service_raises": Case(
        SERVER.replace("lambda request, response: response", "self.answer") + CLIENT.format("") + ONCE,
        ANSWER.format("raise KeyError('key')"),
        THREADS.format(2),
        says="service-exception",
        because="KeyError",
        never=("callback-exception", "service-no-return"),
    ),
    "service_returns_nothing": Case(
        SERVER.replace("lambda request, response: response", "self.answer") + CLIENT.format("") + ONCE,
        ANSWER.format("response.success = True"),
        THREADS.format(2),
        says="service-no-return",
        never=("service-exception", "bad-return"),
    ),
    "service_answers_a_number": Case(
        SERVER.replace("lambda request, response: response", "self.answer") + CLIENT.format("") + ONCE,
        ANSWER.format("response.message = 5\n    return response"),
        THREADS.format(2),
        says="message-field",
        because="`message` is of type string",
        never=("service-exception",),
    ),
    "service_answers": Case(
        SERVER.replace("lambda request, response: response", "self.answer") + CLIENT.format("") + ONCE + TALK,
        ANSWER.format("return response"),
        says="silent",
        never=("service-exception", "service-no-return", "message-field", "asyncio-in-callback", "declared-twice"),
    ),
    "parameter_returns_nothing": Case(
        "self.declare_parameter('x', 1)\nself.add_on_set_parameters_callback(lambda new: None)\n"
        "self.set_parameters([rclpy.Parameter('x', value=2)])\n",
        says="bad-return",
        because="None instead of",
    ),
    "parameter_compares_all": Case(
        "self.declare_parameter('x', 'text')\nself.add_on_set_parameters_callback(self.check)\n"
        "self.set_parameters([rclpy.Parameter('x', value='other')])\n",
        "def check(self, new):\n    return all(one.value > 1 for one in new)",
        says="callback-exception",
        because="check its `name`",
    ),
    "parameter_returns": Case(
        "from rcl_interfaces.msg import SetParametersResult\nself.declare_parameter('x', 1)\n"
        "self.add_on_set_parameters_callback(lambda new: SetParametersResult(successful=True))\n"
        "self.set_parameters([rclpy.Parameter('x', value=2)])\n" + TALK,
        says="silent",
        never=("bad-return",),
    ),
    # Lifecycle.
    "configure_raises": Case(
        base="LifecycleNode",
        methods=CONFIGURE.format("raise ValueError('no')"),
        main=TRIGGER,
        says="lifecycle-exception",
        never=("lifecycle-return",),
    ),
    "configure_returns_nothing": Case(
        base="LifecycleNode",
        methods=CONFIGURE.format("pass"),
        main=TRIGGER,
        says="lifecycle-return",
        never=("lifecycle-exception",),
    ),
    "no_super": Case(
        "self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n" + MANAGED,
        CONFIGURE.format("return TransitionCallbackReturn.SUCCESS")
        + "\ndef on_activate(self, state):\n    return TransitionCallbackReturn.SUCCESS\n",
        "node.trigger_configure()\nnode.trigger_activate()\nrclpy.spin(node)",
        base="LifecycleNode",
        says="no-super-on-activate",
        never=("lifecycle-inactive",),
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    "no_super_and_published_before": Case(
        "self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n" + MANAGED,
        CONFIGURE.format("return TransitionCallbackReturn.SUCCESS")
        + "\ndef on_activate(self, state):\n    return TransitionCallbackReturn.SUCCESS\n",
        "node.trigger_configure()\nnode.managed.publish(String())\nnode.trigger_activate()\nrclpy.spin(node)",
        base="LifecycleNode",
        says="no-super-on-activate",
        never=("lifecycle-inactive",),
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    "made_after_super": Case(
        MANAGED,
        "def on_activate(self, state):\n    done = super().on_activate(state)\n"
        "    self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n    return done\n",
        "node.trigger_configure()\nnode.trigger_activate()\nrclpy.spin(node)",
        base="LifecycleNode",
        says="no-super-on-activate",
        because="or the publisher was created after that call. Create the publisher first",
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    "inactive_and_has_sent": Case(
        TALK + "self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n",
        main="node.trigger_configure()\nnode.managed.publish(String())\nnode.trigger_activate()\n"
        "node.managed.publish(String())\nrclpy.spin(node)",
        base="LifecycleNode",
        never=("lifecycle-inactive", "no-super-on-activate"),
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    "inactive": Case(
        "self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n" + MANAGED,
        main="rclpy.spin(node)",
        base="LifecycleNode",
        says="lifecycle-inactive",
        because="unconfigured",
        never=("no-super-on-activate",),
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    "active": Case(
        "self.managed = self.create_lifecycle_publisher(String, '~/managed', 10)\n",
        CONFIGURE.format("return TransitionCallbackReturn.SUCCESS"),
        "node.trigger_configure()\nnode.trigger_activate()\n"
        "node.create_timer(0.05, lambda: node.managed.publish(String()))\nrclpy.spin(node)",
        base="LifecycleNode",
        never=("no-super-on-activate", "lifecycle-inactive", "lifecycle-return", "lifecycle-exception"),
        ask=lambda scene, name: diagnosis.lifecycle_silence(scene, f"/{name}/managed"),
    ),
    # Names. The near miss of each is a program with the name, or with another reason.
    "absolute": Case(
        "self.create_publisher(String, '/picture', 10)\n",
        says="absolute-name",
        because="`/picture`",
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, f"/{name}/picture", String, "publisher"),
        never=("topic-name",),
    ),
    "relative": Case(
        "self.create_publisher(String, 'painting', 10)\n",
        says="topic-name",
        because="`painting` in the code",
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, f"/{name}/painting", String, "publisher"),
        never=("absolute-name", "no-topic"),
    ),
    "other_type": Case(
        says="wrong-type",
        never=("topic-name", "wrong-end"),
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, f"/{name}/out", Int64, "publisher"),
    ),
    "other_end": Case(
        says="wrong-end",
        never=("no-topic", "wrong-type"),
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, f"/{name}/out", String, "subscription"),
    ),
    "other_node": Case(
        says="wrong-node",
        never=("wrong-type",),
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, f"/{name}/out", String, "publisher", "/somebody"),
    ),
    "no_topic": Case(
        says="no-topic",
        never=("wrong-node", "topic-name"),
        ask=lambda scene, name: diagnosis.why_no_endpoint(scene, "/zzz", Int64, "publisher"),
    ),
    "outside": Case(
        main="other = rclpy.create_node('other', namespace='/outside')\n"
        "other.create_publisher(String, '/elsewhere', 10)\nrclpy.spin(node)",
        says="absolute-name",
        never=("topic-present",),
        ask=lambda scene, name: diagnosis.why_topic_present(scene, "/elsewhere"),
    ),
    "listens_elsewhere": Case(
        main=ABROAD.format("abroad", "abroad"),
        says="absolute-name",
        because="`/heard`",
        ask=lambda scene, name: diagnosis.why_silent(scene, "/abroad/words", String, quiet_profile()),
    ),
    "nobody_says_it": Case(
        main=ABROAD.format("away", "elsewhere"),
        says="silent",
        never=("absolute-name",),
        ask=lambda scene, name: diagnosis.why_silent(scene, "/away/words", String, quiet_profile()),
    ),
    "used_topic": Case(
        says="topic-present",
        never=("absolute-name",),
        ask=lambda scene, name: diagnosis.why_topic_present(scene, f"/{name}/out"),
    ),
    "other_node_name": Case(
        says="node-name",
        because="other_node_name",
        never=("namespace", "no-node", "duplicate-node"),
        ask=lambda scene, name: diagnosis.why_no_node(scene, f"/x_{name}"),
    ),
    "other_namespace": Case(
        says="namespace",
        because="`/other_namespace`",
        never=("node-name",),
        ask=lambda scene, name: diagnosis.why_no_node(scene, f"/front/{name}"),
    ),
    "other_service": Case(
        SERVER,
        says="service-name",
        because="/gate",
        never=("no-service",),
        ask=lambda scene, name: diagnosis.why_no_service(scene, f"/{name}/gat", Trigger),
    ),
    "no_service": Case(
        says="no-service",
        never=("service-name",),
        ask=lambda scene, name: diagnosis.why_no_service(scene, "/zzz", Trigger),
    ),
    "hears_nobody": Case(
        TALK,
        says="no-answer",
        because="but no response arrived",
        never=("not-spinning",),
        ask=lambda scene, name: diagnosis.why_no_answer(scene, f"/{name}/out"),
    ),
    "cannot_answer": Case(
        main="threading.Event().wait()",
        says="not-spinning",
        never=("no-answer",),
        ask=lambda scene, name: diagnosis.why_no_answer(scene, f"/{name}/get_parameters"),
    ),
    **{
        f"qos_{policy}": Case(
            f"self.create_publisher(String, '~/offer', QoSProfile(depth=1{offer}))\n" + TALK,
            says=f"qos-{policy}",
            never=tuple(f"qos-{other}" for other in OFFERS if other != policy),
            ask=lambda scene, name: diagnosis.why_not_matched(scene, f"/{name}/offer", STRICT, "publisher"),
        )
        for policy, offer in OFFERS.items()
    },
}
