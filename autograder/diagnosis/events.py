"""What a program's probe writes, as types. What does not have this form is ignored: a program can forge it.

Times are seconds of the system's monotonic clock, the same in every process of a machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

_NOTICED = 0.05
"""Seconds from which on one run of a callback is noticed by what waits for its end."""


class _Event(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class _AtLine(_Event):
    line: str = ""
    """`talker.py:12`, of the student's own files; empty if none is involved."""
    code: str = ""
    """What stands there."""


class Attached(_Event):
    """The probe works."""

    e: Literal["attached"]


class ProbeFailed(_Event):
    """A part of rclpy could not be watched: what the other events do not say is no evidence."""

    e: Literal["probe_failed"]
    what: str


class CallbackError(_AtLine):
    """An exception left a callback."""

    e: Literal["callback_error"]
    kind: str = ""
    name: str = ""
    """Full name of the topic or service, if it has one."""
    when: float = 0.0
    type: str
    text: str = ""


class ThreadError(_AtLine):
    """An exception ended a thread of the program's own."""

    e: Literal["thread_error"]
    type: str
    text: str = ""


class BadReturn(_AtLine):
    """A callback returned something of the wrong type."""

    e: Literal["bad_return"]
    kind: str
    text: str = ""


class BadMessage(_AtLine):
    """A message, request or response could not be sent: a field is not of its type."""

    e: Literal["bad_message"]
    kind: str
    name: str
    field: str
    """Empty: the whole message is of another type."""
    expected: str
    given: str
    value: str


class LifecyclePublishOff(_AtLine):
    """A lifecycle publisher dropped a message because it is not activated."""

    e: Literal["lifecycle_publish_off"]
    name: str
    state: str


class Ran(_Event):
    """Runs of callbacks, and messages sent; only so many of a program are told."""

    e: Literal["ran"]
    runs: list[tuple[int, float, float, int]]
    """Number of the thing, when it began and ended, and on which thread; a message is sent in no time."""


class GoalLeft(_AtLine):
    """An execute callback has returned, and its goal has neither succeeded nor been aborted or canceled."""

    e: Literal["goal_left"]
    name: str


class Awaits(_AtLine):
    """Where a coroutine callback waits."""

    client: int = 0
    """The client whose answer it awaits, if that is what it awaits."""
    since: float = 0.0


class Thing(_AtLine):
    """A timer, subscription, service, client, publisher, action server, or a callback of another kind."""

    e: Literal["thing"]
    id: int
    kind: str
    name: str = ""
    """Full name on the graph."""
    given: str = ""
    """The name as it stands in the code, before namespace and remap rules."""
    node: str = ""
    made: str = ""
    """The line that made it; `line` is where its callback begins."""
    group: str = ""
    group_id: int = 0
    default_group: bool = False
    period: float = 0.0
    cancelled: bool = False
    destroyed: bool = False
    runs: int = 0
    """How often its callback began; of a publisher: messages, of a client: requests, of an action server: feedback."""
    done: int = 0
    """How often its callback ended; of a client: answers taken."""
    raised: int = 0
    most: int = 0
    """How many runs of it were under way at once, at the most."""
    last: float = 0.0
    """When it last began."""
    spent: float = 0.0
    """Seconds that its complete runs took together."""
    running: list[tuple[float, int]] = Field(default_factory=list)
    """Its runs under way: since when, on which thread."""
    threads: int = 0
    """On how many threads it ran; of a publisher: from how many it was used."""
    awaits: Awaits = Awaits()
    awaited: str = ""
    """The line where a run of it last awaited."""

    @property
    def exclusive(self) -> bool:
        """Whether it is in a mutually exclusive group."""
        return self.group == "MutuallyExclusiveCallbackGroup"

    @property
    def has_callback(self) -> bool:
        """Whether an executor runs a callback of the student's for it."""
        return self.kind in ("timer", "subscription", "service")

    @property
    def takes_time(self) -> bool:
        """Whether its runs last so long that what waits for their end notices it."""
        return bool(self.running) or self.spent > _NOTICED * self.done


class Call(_AtLine):
    """A call that may block, from one line."""

    e: Literal["call"]
    what: str
    """client.call, wait_for_service, action_client.send_goal, rate.sleep, spin or shutdown."""
    in_callback: bool
    callback: int = 0
    target: int = 0
    begun: int
    ended: int
    vain: int = 0
    """How often it spun until a future was done, and came back before that."""
    since: float = 0.0
    """When it last began."""
    thread: int = 0

    @property
    def blocks(self) -> bool:
        """Whether it has not come back."""
        return self.begun > self.ended


class ExecutorSeen(_Event):
    """An executor."""

    e: Literal["executor"]
    id: int
    type: str = ""
    threads: int | None = None
    """Of a multi-threaded one."""
    threads_given: bool | None = None
    nodes: list[str] = Field(default_factory=list)
    spins: int = 0
    spinning: bool = False
    main: bool = False
    """The program's main thread is in its `spin`, which goes on until the end."""
    busy: int = 0
    """Callbacks on its threads now."""
    most: int = 0
    """The same, at the most."""

    @property
    def size(self) -> int:
        """How many callbacks it can run at once."""
        return self.threads or 1


class NodeSeen(_Event):
    """A node, from the end of `Node.__init__` on."""

    e: Literal["node"]
    name: str
    made: float = 0.0
    spun: float = 0.0
    """When it was last seen in an executor that was spinning; 0: never."""
    destroyed: bool = False
    foreign: bool = False
    """It is in an executor that the probe does not watch."""


class ParameterSeen(_Event):
    """A parameter."""

    e: Literal["parameter"]
    node: str
    name: str
    declared: bool = False
    gets: int = 0
    sets: int = 0
    last_get: float = 0.0
    last_set: float = 0.0


Event = (
    Attached
    | ProbeFailed
    | CallbackError
    | ThreadError
    | BadReturn
    | BadMessage
    | LifecyclePublishOff
    | Ran
    | GoalLeft
    | Thing
    | Call
    | ExecutorSeen
    | NodeSeen
    | ParameterSeen
)

_READER: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="e")])


def read(lines: Iterable[dict[str, Any]]) -> list[Event]:
    """The events that have the form of one, in their order."""
    found = []
    for line in lines:
        try:
            found.append(_READER.validate_python(line))
        except ValidationError:
            continue
    return found
