"""The lines that a program's probe writes, with one class for each kind. The diagnosis reads them into these classes.

Times are seconds of the system's monotonic clock, which is the same in every process of a machine. Fields that have a
default may be missing in a line: a program can forge its lines.
"""

from dataclasses import dataclass, field
from typing import Literal

_NOTICED = 0.05
"""If one run of a callback takes this many seconds, whatever waits for its end notices it."""


@dataclass(frozen=True, kw_only=True)
class Where:
    """A line of the student's own files."""

    line: str = ""
    """For example `talker.py:12`; empty if none of the student's lines is involved."""
    code: str = ""
    """The source code of this line."""


@dataclass(frozen=True, kw_only=True)
class Attached:
    """The probe is attached and works."""

    e: Literal["attached"] = "attached"


@dataclass(frozen=True, kw_only=True)
class ProbeFailed:
    """A part of rclpy cannot be watched, so nothing may be concluded from what the other events do not say."""

    e: Literal["probe_failed"] = "probe_failed"
    what: str


@dataclass(frozen=True, kw_only=True)
class MemoryFailed:
    """The program ends because it ran out of memory; `sandbox/running_program.py` reads this event."""

    e: Literal["memory_error"] = "memory_error"


@dataclass(frozen=True, kw_only=True)
class CallbackError(Where):
    """An exception left a callback."""

    e: Literal["callback_error"] = "callback_error"
    kind: str = ""
    name: str = ""
    """The full name of the topic or service; empty if there is none."""
    when: float = 0.0
    type: str
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class ThreadError(Where):
    """An exception ended a thread that the program started itself."""

    e: Literal["thread_error"] = "thread_error"
    type: str
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class BadReturn(Where):
    """A callback returned something of the wrong type."""

    e: Literal["bad_return"] = "bad_return"
    kind: str
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class BadMessage(Where):
    """A message, request or response could not be sent because the value of a field has the wrong type."""

    e: Literal["bad_message"] = "bad_message"
    kind: str
    name: str
    field: str
    """Empty if the whole message has the wrong type."""
    expected: str
    given: str
    value: str


@dataclass(frozen=True, kw_only=True)
class LifecyclePublishOff(Where):
    """A lifecycle publisher dropped a message because it is not activated."""

    e: Literal["lifecycle_publish_off"] = "lifecycle_publish_off"
    name: str
    state: str


@dataclass(frozen=True, kw_only=True)
class Ran:
    """Runs of callbacks, and messages sent. Only the first ones of a program are written."""

    e: Literal["ran"] = "ran"
    runs: list[tuple[int, float, float, int]]
    """The number of the thing, the begin, the end, and the thread. A message begins and ends at the same time."""


@dataclass(frozen=True, kw_only=True)
class GoalLeft(Where):
    """An execute callback has returned, and its goal has neither succeeded nor been aborted or canceled."""

    e: Literal["goal_left"] = "goal_left"
    name: str


@dataclass(frozen=True, kw_only=True)
class Awaits(Where):
    """The line where a coroutine callback waits; empty if it does not wait."""

    client: int = 0
    """The number of the client whose response it awaits, if it awaits one."""
    since: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ThingMade(Where):
    """The information about a thing when it is created; `line` is where its callback begins."""

    kind: str
    name: str = ""
    """The full name on the graph."""
    given: str = ""
    """The name in the code, before namespace and remap rules are applied."""
    node: str = ""
    made: str = ""
    """The line that created it."""
    group: str = ""
    group_id: int = 0
    default_group: bool = False
    period: float = 0.0
    cancelled: bool = False
    cancelled_in: str = ""
    """The line that cancelled it last, even if it has been reset since then."""
    cancelled_at: float = 0.0
    destroyed: bool = False


@dataclass(frozen=True, kw_only=True)
class Thing(ThingMade):
    """A timer, subscription, service, client, publisher or action server, or a callback of another kind."""

    e: Literal["thing"] = "thing"
    id: int
    runs: int = 0
    """How often its callback began. For a publisher, this is the number of messages, for a client that of requests, and
    for an action server that of feedback messages."""
    done: int = 0
    """How often its callback ended. For a client, this is the number of responses that were taken."""
    raised: int = 0
    most: int = 0
    """The largest number of its runs at the same time."""
    last: float = 0.0
    """When it last began."""
    spent: float = 0.0
    """The seconds that its completed runs took together."""
    running: list[tuple[float, int]] = field(default_factory=list)
    """The current runs: since when each is running, and on which thread."""
    threads: int = 0
    """The number of threads on which it ran, or from which a publisher was used."""
    awaits: Awaits = Awaits()
    awaited: str = ""
    """The line in which one of its runs last awaited something."""

    @property
    def exclusive(self) -> bool:
        """Whether it is in a mutually exclusive group."""
        return self.group == "MutuallyExclusiveCallbackGroup"

    @property
    def has_callback(self) -> bool:
        """Whether an executor runs a callback for it."""
        return self.kind in ("timer", "subscription", "service")

    @property
    def takes_time(self) -> bool:
        """Whether its runs take so long that whatever waits for their end notices it."""
        return bool(self.running) or self.spent > _NOTICED * self.done


@dataclass(frozen=True, kw_only=True)
class Call(Where):
    """The calls in one line of a function that may block."""

    e: Literal["call"] = "call"
    what: str
    """One of client.call, wait_for_service, action_client.send_goal, rate.sleep, spin and shutdown."""
    in_callback: bool
    callback: int = 0
    target: int = 0
    begun: int
    ended: int
    vain: int = 0
    """How often it should have spun until a future was done, but returned before that."""
    since: float = 0.0
    """When it last began."""
    thread: int = 0

    @property
    def blocks(self) -> bool:
        """Whether a call has not returned."""
        return self.begun > self.ended


@dataclass(frozen=True, kw_only=True)
class ExecutorSeen:
    """The state of an executor."""

    e: Literal["executor"] = "executor"
    id: int
    type: str = ""
    threads: int | None = None
    """The number of threads of a multi-threaded executor; None for other executors."""
    threads_given: bool | None = None
    nodes: list[str] = field(default_factory=list)
    spins: int = 0
    spinning: bool = False
    main: bool = False
    """Whether the program's main thread is in its `spin`, which does not return before shutdown."""
    busy: int = 0
    """How many callbacks its threads are running now."""
    most: int = 0
    """The largest number of callbacks that its threads were running at once."""

    @property
    def size(self) -> int:
        """The number of callbacks that it can run at once."""
        return self.threads or 1


@dataclass(frozen=True, kw_only=True)
class NodeSeen:
    """The state of a node, which is known from the end of `Node.__init__` on."""

    e: Literal["node"] = "node"
    name: str
    made: float = 0.0
    spun: float = 0.0
    """When it was last seen in a spinning executor; 0 if never."""
    destroyed: bool = False
    foreign: bool = False
    """Whether it is in an executor that the probe does not watch."""


@dataclass(frozen=True, kw_only=True)
class ParameterSeen:
    """The state of a parameter of a node."""

    e: Literal["parameter"] = "parameter"
    node: str
    name: str
    declared: bool = False
    gets: int = 0
    sets: int = 0
    last_get: float = 0.0
    last_set: float = 0.0


Record = Thing | Call | ExecutorSeen | NodeSeen | ParameterSeen
"""The current state of a thing. A record is written again whenever it has changed."""

Event = (
    Attached
    | ProbeFailed
    | MemoryFailed
    | CallbackError
    | ThreadError
    | BadReturn
    | BadMessage
    | LifecyclePublishOff
    | Ran
    | GoalLeft
    | Record
)
