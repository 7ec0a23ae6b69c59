"""What a check cell may ask and do with `ros`: its nouns, such as `ros.topic`, and its verbs, such as `ros.require`."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rclpy.qos import QoSProfile

from autograder.checks import current, outcomes, picture_data
from autograder.checks.expect.action import Action
from autograder.checks.expect.activity import Activity
from autograder.checks.expect.car import Car
from autograder.checks.expect.draw import Draw
from autograder.checks.expect.expectations import WITHIN, Expectations
from autograder.checks.expect.graph import Graph
from autograder.checks.expect.lifecycle import Lifecycle
from autograder.checks.expect.node import Node
from autograder.checks.expect.program import StartedProgram
from autograder.checks.expect.publisher import RELIABLE_DEEP, Publisher
from autograder.checks.expect.qos import Qos
from autograder.checks.expect.service import Server, Service
from autograder.checks.expect.topic import CONTENT, Topic
from autograder.checks.misuse import Misuse
from autograder.checks.program import Program
from autograder.checks.recording import record
from autograder.checks.waiting import waits_for
from autograder.core.results import Ranked
from autograder.graph.lifecycle import Change, in_order
from autograder.graph.publishing import ClockDriver
from autograder.own_run.sheet import OwnRun
from autograder.pictures import Runs
from autograder.reasons import Group, Kind

if TYPE_CHECKING:
    from autograder.checks.expect.goal import SentGoal

ARGUMENT_NOT_NEEDED = Kind(
    "argument-not-needed", "a launch file runs without an argument that it should demand", Group.FILES
)


class Facts(Expectations):
    """What a check requires."""

    def require(
        self,
        condition: object,
        title: str,
        *,
        expected: str = "",
        observed: str = "",
        because: str = "",
        hint: str = "",
        code: str = "",
        evident: object = False,
        node: str = "",
        goal: SentGoal | None = None,
    ) -> None:
        """State a fact: passed if `condition` is true in Python's sense.

        Where the programs themselves went wrong, the diagnosis of that is the reason. That one of them ended is none if
        the check gives a reason of its own: it knows whether that program had to go on.

        Args:
            condition: anything; `None`, `0` and what is empty count as false.
            title: what is required, as a sentence without its full stop.
            expected: in words, for the report.
            observed: in words, for the report.
            because: what is wrong if it does not hold.
            hint: a pointer for the student.
            code: of that reason.
            evident: anything; if true, the check has seen that this is the reason, and what callbacks wait for is none:
                in a launch where something is missing on purpose, a right program waits as well.
            node: full name of a node: what its program waits for is a reason, and what others wait for is none.
            goal: a goal that has ended, if this is about its result: an error in the execute callback leaves it empty.

        Example:
            `ros.require(reply.success, "The order is accepted", because=reply.message)`

        Codes:
            `code`, by default `required` with a reason and `failed` without.
        """
        if inspect.isroutine(condition):
            raise Misuse("require: its condition is a function, and a function is always true; call it.")
        seen = goal.seen if goal is not None else None
        self._expect_that(
            condition,
            title,
            lambda: self._why_not(because, code=code, evident=evident, node=node, goal=seen),
            expected=expected,
            observed=observed,
            hint=hint,
        )

    def require_equal(
        self, title: str, observed: Any, expected: Any, *, because: str = "", hint: str = "", code: str = CONTENT.code
    ) -> None:
        """State that two values are equal; the report shows both.

        Args:
            title: what is required, as a sentence without its full stop.
            observed: the value that was found.
            expected: the value that is right.
            because: what is wrong if they differ; by default that it is the one value and not the other.
            hint: a pointer for the student.
            code: of that reason.

        Example:
            `ros.require_equal("The total is right", total.data, sum(numbers))`

        Codes:
            `code`, by default `content`.
        """
        have, want = _in_words(observed), _in_words(expected)
        because = because or f"It is {have}, not {want}."
        self.require(observed == expected, title, expected=want, observed=have, because=because, hint=hint, code=code)

    def rank(self, value: float, unit: str, **figures: float) -> None:
        """Put the submission into the class's table of the best, if it gets all points of this check.

        Args:
            value: what the table is ordered by; the least is the best.
            unit: of the value, as the heading of its column.
            figures: what else the table shows, by the headings of its columns.

        Example:
            `ros.rank(31.5, "seconds", touches=0)`
        """
        figures = {name: float(figure) for name, figure in figures.items()}
        current.check.findings.ranked = Ranked(value=float(value), unit=unit, figures=figures)

    def expect_argument_needed(self, name: str, *, hint: str = "") -> None:
        """The launch file cannot be run, because a launch argument has no default and was not given.

        Args:
            name: of the launch argument.
            hint: a pointer for the student.

        Example:
            `ros.expect_argument_needed("vehicle")`

        Codes:
            `argument-not-needed`, and those of launch files.
        """
        title = f"Without `{name}` the launch file is refused"
        told = self._running.trouble[0].because if self._running.trouble else ""
        # The sentence begins with the place in the file; behind that it may quote what a student has written.
        if told.partition(": ")[2].startswith(f"the launch argument `{name}` has no value"):
            outcomes.passed(title)
            return
        number = len(self._running.described)
        started = f"It starts {number} program{'' if number == 1 else 's'} without it."
        reason = self._running.trouble[0] if self._running.trouble else ARGUMENT_NOT_NEEDED(started)
        self._fail(title, reason, expected=f"the launch argument `{name}` is wanted", hint=hint)


def _in_words(value: Any) -> str:
    """A value for the report: a list as its elements, none of them as `none`."""
    if isinstance(value, (list, tuple)):
        return ", ".join(str(one) for one in value) or "none"
    return str(value)


class Ros(Facts, ABC):
    """What can be asked of a launch that runs."""

    @abstractmethod
    def _start(self, node: Program | str) -> None:
        """Start one more program."""

    def topic(self, name: str, msg_type: type | None = None) -> Topic:
        """A topic: who publishes and subscribes, and what arrives.

        Args:
            name: full name.
            msg_type: message class; only `expect_unused` and counts of 0 do without.

        Example:
            `chatter = ros.topic("/chatter", String)`
        """
        return Topic(self._running, name, msg_type)

    def publisher(self, name: str, msg_type: type, qos: QoSProfile | int = RELIABLE_DEEP) -> Publisher:
        """A publisher of the check's own, made when it is first used.

        Args:
            name: full name of the topic.
            msg_type: message class.
            qos: what is offered, a profile or a depth.

        Example:
            `numbers = ros.publisher("/numbers", Int64)`
        """
        self._running.refuse_if_over()
        return Publisher(self._running, name, msg_type, qos)

    def qos(self, topic: str) -> Qos:
        """The QoS of a topic.

        Args:
            topic: full name.

        Example:
            `ros.qos("/map").expect(durability="transient_local")`
        """
        return Qos(self._running, topic)

    def node(self, name: str) -> Node:
        """A node: whether it is there, its parameters and what it logs.

        Args:
            name: full name.

        Example:
            `ros.node("/talker").expect()`
        """
        return Node(self._running, name)

    def lifecycle(self, node: str) -> Lifecycle:
        """The state machine of a lifecycle node.

        Args:
            node: full name.

        Example:
            `ros.lifecycle("/camera").expect_state("active")`
        """
        self._running.refuse_if_over()
        return Lifecycle(self._running, node)

    def service(self, name: str, srv_type: type) -> Service:
        """A service of the student's.

        Args:
            name: full name.
            srv_type: service class.

        Example:
            `total = ros.service("/add", AddTwoInts).call(AddTwoInts.Request(a=1, b=2)).sum`
        """
        self._running.refuse_if_over()
        return Service(self._running, name, srv_type)

    def server(
        self,
        name: str,
        srv_type: type | None = None,
        answer: Callable[[Any, Any], Any] | None = None,
        delay: float = 0.0,
    ) -> Server:
        """A service that the check offers to the student's client, from the first call of this on.

        Args:
            name: full name.
            srv_type: service class; not needed for a service that is offered already.
            answer: is given a request and a response, and returns the response.
            delay: seconds from the arrival of a request to its answer.

        Example:
            `ros.server("/gate", Trigger, lambda request, response: response, delay=0.2)`
        """
        self._running.refuse_if_over()
        return Server(self._running, name, srv_type, answer, delay)

    def action(self, name: str, action_type: type) -> Action:
        """An action of the student's.

        Args:
            name: full name.
            action_type: action class.

        Example:
            `goal = ros.action("/dock", Fibonacci).send_goal(Fibonacci.Goal(order=5), accepted=True)`
        """
        self._running.refuse_if_over()
        return Action(self._running, name, action_type)

    def activity(self, topic: str) -> Activity:
        """Callbacks that publish `NAME begin` and `NAME end` (`std_msgs/String`) when they begin and end.

        Record the topic from the start, with `launch(…, listen=[(topic, String)])`: an end whose begin was missed could
        be taken for that of a later run.

        Args:
            topic: full name of the topic on which they do.

        Example:
            `ros.activity("/activity").expect_overlap(["camera", "planner"])`
        """
        return Activity(self._running, topic)

    def program(self, name: str) -> StartedProgram:
        """A program that was started; a missing one is a failed outcome.

        Args:
            name: of the program, or of its node as the launch names it: that tells several runs of one program apart.

        Example:
            `ros.program("talker").expect_clean_end(by="SIGTERM")`

        Codes:
            `program-missing`, `nothing-started`.
        """
        return StartedProgram(self._running, name, self._start)

    def car(self, namespace: str = "") -> Car:
        """A car in the world of the launch: where it is and was, what it reached and touched.

        Args:
            namespace: as `World(cars=[…])` has it, such as `/front`; not needed for a world with one car.

        Example:
            `ros.car().expect_reached("parking")`
        """
        return Car(self._running, namespace)

    @property
    def graph(self) -> Graph:
        """What is on the graph at this moment.

        Example:
            `ros.graph.nodes()`
        """
        return Graph(self._running)

    @property
    def draw(self) -> Draw:
        """Pictures of what happened, for a notebook.

        Example:
            `ros.draw.timeline(seconds=2)`
        """
        return Draw(self._running)

    @cached_property
    def clock(self) -> ClockDriver:
        """Simulated time of this launch (`use_sim_time=True`).

        Example:
            `ros.clock.advance(1.0, lambda: heard.count > 0)`
        """
        return ClockDriver(self._observer)

    @waits_for("what `ros.wait` asks for")
    def wait(
        self, ready: Callable[[], object], within: float = WITHIN, needs: Callable[[], object] | None = None
    ) -> bool:
        """Wait until something is so, and tell whether it is: this records no outcome.

        Args:
            ready: what is waited for; anything true will do. It is asked again and again.
            within: seconds until it must have come. The wait ends earlier when every program has ended.
            needs: whether that is on the graph without which it cannot come. Once nothing new appears on the graph
                and it is still missing, the wait ends.

        Example:
            `came = ros.wait(lambda: heard.count >= 3, within=5)`
        """
        return self._wait(ready, within, needs)

    def pause(self, for_seconds: float) -> None:
        """Let the programs run for exactly so long: for experiments in which the length of a time matters.

        Args:
            for_seconds: how long, in seconds. To wait for something, use `wait` or an expectation.

        Example:
            `ros.pause(0.5)`
        """
        if for_seconds < 0:
            raise Misuse(f"pause: {for_seconds!r} is no time; it is a number of seconds, 0 or more.")
        self._observer.pause(for_seconds)

    def changes(self, *nodes: str) -> list[Change]:
        """State changes of lifecycle nodes so far, in the order of publication.

        Args:
            nodes: full names; by default all nodes that are watched.

        Example:
            `steps = [change.step for change in ros.changes("/camera")]`
        """
        return in_order([self._running.lifecycle_client(node) for node in nodes or self._running.lifecycle_clients])

    def runs(self) -> Runs:
        """What the programs' callbacks did so far, run by run: when, how long, on which thread, in which group.

        Seen from inside the programs, the first 2000 runs of each; a moment old.

        Example:
            `print(ros.runs().longest_pause("heartbeat"))`
        """
        return picture_data.runs(self._insides())

    def own_run(self, questions: int = 3) -> OwnRun:
        """Questions about what the programs have done so far, each with its picture: other ones in each run.

        As the last line of a cell it shows them, and the line that carries them into a table of answers, where
        `expect_own_run` and `expect_own_answers` look at them.

        Args:
            questions: how many.

        Example:
            `own = ros.own_run(questions=3)`
        """
        return OwnRun.of([record(self._running, self._insides())], questions)

    def programs(self) -> list[Program]:
        """What this launch was asked to start, or what its launch file starts: programs with their arguments.

        Example:
            `starts = len(ros.programs())`
        """
        return list(self._running.described)
