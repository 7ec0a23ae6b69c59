"""The fields of every event and record, as types. A test holds that `autograder/diagnosis/events.py` reads the same."""

from typing import Literal, TypedDict


class Where(TypedDict):
    """A line of the student's own files, `talker.py:12`, and what stands there; empty if none is involved."""

    line: str
    code: str


class Attached(TypedDict):
    """The probe works."""

    e: Literal["attached"]


class ProbeFailed(TypedDict):
    """A part of rclpy cannot be watched."""

    e: Literal["probe_failed"]
    what: str


class MemoryFailed(TypedDict):
    """The program ends for want of memory; `sandbox/running_program.py` reads it."""

    e: Literal["memory_error"]


class CallbackError(Where):
    """An exception left a callback."""

    e: Literal["callback_error"]
    kind: str
    name: str
    when: float
    type: str
    text: str


class ThreadError(Where):
    """An exception ended a thread of the program's own."""

    e: Literal["thread_error"]
    type: str
    text: str


class BadReturn(Where):
    """A callback returned something of the wrong type."""

    e: Literal["bad_return"]
    kind: str
    text: str


class BadMessage(Where):
    """A message, request or response could not be sent."""

    e: Literal["bad_message"]
    kind: str
    name: str
    field: str
    expected: str
    given: str
    value: str


class LifecyclePublishOff(Where):
    """A lifecycle publisher dropped a message because it is not activated."""

    e: Literal["lifecycle_publish_off"]
    name: str
    state: str


class Ran(TypedDict):
    """Runs of callbacks, and messages sent: number of the thing, begin, end, thread."""

    e: Literal["ran"]
    runs: list[tuple[int, float, float, int]]


class GoalLeft(Where):
    """An execute callback has returned, and its goal has neither succeeded nor been aborted or canceled."""

    e: Literal["goal_left"]
    name: str


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
)


class Awaits(TypedDict, total=False):
    """Where a coroutine callback waits, for which client's answer, and since when; empty if it does not wait."""

    line: str
    code: str
    client: int
    since: float


class ThingMade(TypedDict, total=False):
    """What is known of a thing when it is made; `line` is where its callback begins."""

    line: str
    code: str
    kind: str
    name: str
    given: str
    node: str
    made: str
    group: str
    group_id: int
    default_group: bool
    period: float
    cancelled: bool
    destroyed: bool


class Thing(ThingMade):
    """A timer, subscription, service, client, publisher or action server, or a callback of another kind."""

    e: Literal["thing"]
    id: int
    runs: int
    done: int
    raised: int
    most: int
    last: float
    running: list[tuple[float, int]]
    threads: int
    awaits: Awaits
    awaited: str
    spent: float


class Call(Where):
    """A call that may block, by its line."""

    e: Literal["call"]
    what: str
    in_callback: bool
    callback: int
    target: int
    begun: int
    ended: int
    vain: int
    since: float
    thread: int


class Executor(TypedDict):
    """An executor."""

    e: Literal["executor"]
    id: int
    type: str
    threads: int | None
    threads_given: bool | None
    nodes: list[str]
    spins: int
    spinning: bool
    main: bool
    busy: int
    most: int


class Node(TypedDict):
    """A node."""

    e: Literal["node"]
    name: str
    made: float
    spun: float
    destroyed: bool
    foreign: bool


class Parameter(TypedDict):
    """A parameter of a node."""

    e: Literal["parameter"]
    node: str
    name: str
    declared: bool
    gets: int
    sets: int
    last_get: float
    last_set: float


Record = Thing | Call | Executor | Node | Parameter
