"""`ros.topic`: who publishes and subscribes, and which messages arrive: how many, how often, saying what, from whom."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.qos import QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect import rates
from autograder.checks.expect.discovery import MATCHES_WITHIN
from autograder.checks.expect.endpoints import End, Sources
from autograder.checks.expect.expectations import GONE_WITHIN, WITHIN, objection
from autograder.checks.expect.rates import RATE
from autograder.checks.message_text import in_words, int_in_float, shorten
from autograder.checks.misuse import Misuse, refuse_other_class
from autograder.checks.running_launch import RunningLaunch
from autograder.checks.waiting import waits_for
from autograder.diagnosis.callbacks import MESSAGE_FIELD
from autograder.graph.recording import Received, Recording, quiet_profile
from autograder.reasons import Group, Kind, Reason, kind_of_lab

CONTENT = Kind("content", "messages came, and what they say is not what was asked for", Group.MESSAGES)
TOO_FEW = Kind(
    "too-few",
    "some messages came in the time, and fewer than asked for; no other reason was established",
    Group.MESSAGES,
)
TOO_MANY = Kind("too-many", "more messages came than may", Group.MESSAGES)
NOT_SILENT = Kind("not-silent", "a message came while there should be none", Group.MESSAGES)

_RATE_DECIDED = 4
"""A rate is judged after so many times the messages that were asked for, if it is not right before."""

_HELD_UP = 0.1
"""The share of a time for which others kept the programs from a CPU, from which on a slow rate may be their fault."""

_UNDER_WAY = 0.15
"""Seconds for which a thread that was about to publish may still do so."""


@dataclass
class _Wanted:
    """The messages that one expectation asks for, and the recording in which they arrive."""

    recording: Recording
    need: int
    most: int | None
    rate: float | None
    skip: int
    where: Callable[[Any], object] | None
    saying: str
    hint: str

    def __post_init__(self) -> None:
        self._counted: list[Received] = []
        self._looked_at = self.skip

    def counted(self) -> list[Received]:
        """Those of the messages so far that count; each is looked at once."""
        where, new = self.where, self.recording.messages_from(self._looked_at)
        self._counted += [r for r in new if where is None or bool(where(r.msg))]
        self._looked_at += len(new)
        return self._counted

    def enough(self) -> bool:
        return len(self.counted()) >= self.need

    @property
    def title(self) -> str:
        topic = self.recording.topic
        if self.most == 0:
            return f"No message arrives on `{topic}`"
        number = f"Exactly {self.need}" if self.most == self.need else f"At least {self.need}"
        number += f", at most {self.most}," if self.most and self.most != self.need else ""
        which = f" that {'says' if self.need == 1 else 'say'} {self.saying}" if self.saying else ""
        which = which or " with the expected content" * (self.where is not None)
        which += " arrives" if self.need == 1 else " arrive"
        rate = f" at {self.rate:.4g} Hz" if self.rate else ""
        return f"{number} message{'s' * (self.need != 1)}{which} on `{topic}`{rate}"


def _numbers(at_least: int, at_most: int | None, exactly: int | None, rate: float | None) -> tuple[int, int | None]:
    """How many messages have to come, and how many may."""
    if exactly is not None and (at_least or at_most is not None):
        raise Misuse("expect_messages: exactly=… already says at_least=… and at_most=….")
    if min(at_least, at_most or 0, exactly or 0) < 0 or (rate is not None and rate <= 0):
        raise Misuse("expect_messages: a number of messages is not negative, and a rate is above 0.")
    if exactly is not None:
        return exactly, exactly
    return at_least or (0 if at_most == 0 else 10 if rate else 1), at_most


def _an_int(message: Any) -> Reason | None:
    """Whether a message has an `int` in a field of floats."""
    field = int_in_float(message)
    because = f"Messages arrived, but one of their fields contains a wrong number, `{field}`, because an `int` was"
    because += " assigned where a `float` is required."
    hint = "Write `5.0` for `5`."
    return MESSAGE_FIELD(because, hint) if field else None


def _number(messages: int) -> str:
    return f"{messages} message{'s' * (messages != 1)}"


class Topic(Sources):
    """A topic: who is at its ends, and what arrives on it."""

    def __init__(self, running: RunningLaunch, name: str, msg_type: type | None = None) -> None:
        """Ask about the topic of this name; most questions need the class of its messages."""
        super().__init__(running, name)
        if msg_type is not None:
            refuse_other_class(f'ros.topic("{name}")', msg_type, "message")
        self._type = msg_type

    @property
    def _class(self) -> type:
        """The class of its messages.

        Raises:
            Misuse: the check did not name it.
        """
        if self._type is None:
            raise Misuse(f'ros.topic("{self.name}"): what is asked here needs the message type, as a second argument.')
        return self._type

    @waits_for("a publisher on `{name}`")
    def expect_publisher(self, *, node: str = "", count: int = 1, within: float | None = None, hint: str = "") -> None:
        """The topic has exactly so many publishers of this type, of the node `node` if one is given.

        Args:
            node: full name of the node whose they are; by default of any.
            count: so many publishers; 0: nobody publishes on the topic any more, with whatever type.
            within: seconds until they must be there, by default 10, or gone, by default 2.
            hint: a pointer for the student.

        Example:
            `ros.topic("/chatter", String).expect_publisher(node="/talker")`

        Codes:
            `no-topic`, `topic-name`, `wrong-type`, `wrong-node`, `wrong-end`, `absolute-name`, `count`,
            `extra-publisher`, `publisher-present`.
        """
        self._expect_ends("publisher", node, count, within, hint)

    @waits_for("a subscription on `{name}`")
    def expect_subscription(
        self, *, node: str = "", count: int = 1, within: float | None = None, hint: str = ""
    ) -> None:
        """The topic has at least so many subscriptions of this type, of the node `node` if one is given.

        Args:
            node: full name of the node whose they are; by default of any.
            count: so many subscriptions; 0: nobody subscribes to the topic any more, with whatever type.
            within: seconds until they must be there, by default 10, or gone, by default 2.
            hint: a pointer for the student.

        Example:
            `ros.topic("/chatter", String).expect_subscription(node="/listener")`

        Codes:
            `no-topic`, `topic-name`, `wrong-type`, `wrong-node`, `wrong-end`, `absolute-name`, `count`,
            `subscription-present`.
        """
        self._expect_ends("subscription", node, count, within, hint)

    def _expect_ends(self, kind: End, node: str, count: int, within: float | None, hint: str) -> None:
        if count:
            self._expect_end(self.name, self._class, kind, node, count, WITHIN if within is None else within, hint)
        else:
            self._expect_no_end(self.name, kind, GONE_WITHIN if within is None else within, hint)

    @waits_for("the topic `{name}` to go away")
    def expect_unused(self, *, within: float = GONE_WITHIN, hint: str = "") -> None:
        """Nobody publishes or subscribes to this topic.

        Args:
            within: seconds until nobody may use it any more.
            hint: a pointer for the student.

        Example:
            `ros.topic("/chatter").expect_unused()`

        Codes:
            `topic-present`, `absolute-name`.
        """
        gone = self._observer.wait(lambda: self.name not in self._observer.topics(), within)
        self._expect_that(
            gone,
            f"Nobody uses the topic `{self.name}`",
            lambda: diagnosis.why_topic_present(self._scene(), self.name),
            observed=self._topics,
            hint=hint,
        )

    def listen(self, qos: QoSProfile | None = None) -> Recording:
        """Record a topic from now on; the same topic and profile share a recording.

        Args:
            qos: subscribe with this profile instead of one that hears everything.

        Example:
            `heard = ros.topic("/chatter", String).listen().count`
        """
        topic, msg_type = self.name, self._class
        return self._observer.record(topic, msg_type, qos)

    @waits_for("messages on `{name}`")
    def expect_messages(
        self,
        *,
        at_least: int = 0,
        at_most: int | None = None,
        exactly: int | None = None,
        rate: float | None = None,
        tolerance: float = 0.2,
        for_seconds: float = 1.0,
        skip: int = 0,
        where: Callable[[Any], object] | None = None,
        saying: str = "",
        values: Callable[[list[Any]], object] | None = None,
        publisher: str = "",
        publishers: int = 1,
        qos: QoSProfile | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> list[Any]:
        """Messages arrive on a topic.

        Args:
            at_least: so many, by default 1, or 10 with `rate`.
            at_most: not more, watched for `for_seconds`; 0 means that none may come.
            exactly: both at once.
            rate: hertz, of the last messages, by the publisher's own stamps: a slow grader does not matter.
            tolerance: allowed deviation of the rate, as a share.
            for_seconds: how long it is watched, in seconds, whether more than `at_most` come.
            skip: leaves out so many messages at the beginning, such as those of a node's first life.
            where: counts only messages for which it gives something true.
            saying: what `where` asks for, in words for the student, such as "`ok`".
            values: looks at all counted messages; a sentence that says what is wrong fails, and so does what is false.
            publisher: full name of the node that they must come from.
            publishers: how many publishers the topic may have.
            qos: subscribe with this profile instead of one that hears everything.
            within: seconds until `at_least` of them must have come.
            hint: a pointer for the student.

        Returns:
            the counted messages.

        Example:
            `ros.topic("/chatter", String).expect_messages(at_least=10, rate=2, publisher="/talker")`

        Codes:
            `too-few`, `too-many`, `content`, `message-field`, `rate`, `extra-publisher`, `wrong-node`, and of silence.
        """
        topic, msg_type = self.name, self._class
        need, most = _numbers(at_least, at_most, exactly, rate)
        recording = self._observer.record(topic, msg_type, qos)
        wanted = _Wanted(recording, need, most, rate, skip, where, saying, hint)
        if not self._wait(wanted.enough, within, lambda: self._ends(topic, msg_type, "publisher", "")):
            self._too_few(wanted, qos or quiet_profile(), within)
        self._not_more(wanted, for_seconds)
        # They came: a title that asks for them would deny what was seen.
        whose = f"The messages on `{topic}` come from {f'`{publisher}`' if publisher else 'one publisher'}"
        self._one_source(whose, topic, msg_type, publisher, publishers, recording.messages[skip:])
        self._at_rate(wanted, tolerance, within)
        return self._say(wanted, values)

    def _too_few(self, wanted: _Wanted, qos: QoSProfile, within: float) -> None:
        got, scene, recording = len(wanted.counted()), self._scene(), wanted.recording
        if wanted.where and not got and recording.count > wanted.skip:
            # Messages do come, so what keeps callbacks waiting is not the reason.
            last = shorten(in_words(recording.messages[-1].msg, wanted.where), 120)
            which = f"that says {wanted.saying}" if wanted.saying else "as expected"
            reason = (
                diagnosis.program_trouble(scene)
                or diagnosis.inside_reason(scene)
                or diagnosis.lifecycle_silence(scene)
                or _an_int(recording.messages[-1].msg)
                or CONTENT(f"Messages arrived, but none {which}; the last of them is `{last}`.")
            )
        else:
            reason = diagnosis.why_silent(scene, recording.topic, recording.msg_type, qos)
            if got and reason.kind is diagnosis.SILENT:
                came = f"Only {got} of {wanted.need} messages arrived within {within:g} s."
                reason = TOO_FEW(f"{came} {reason.because}")
        expected, observed = _number(wanted.need), _number(got)
        self._fail(wanted.title, reason, expected=expected, observed=observed, hint=wanted.hint)

    def _not_more(self, wanted: _Wanted, for_seconds: float) -> None:
        most = wanted.most
        if most is None:
            return
        self._observer.wait(lambda: len(wanted.counted()) > most, for_seconds)
        came = len(wanted.counted())
        if came > most:
            asked = f"at most {most}" if most else "none"
            self._fail(
                wanted.title,
                TOO_MANY(f"{_number(came)} arrived, but {asked} {'were' if most > 1 else 'was'} expected."),
                expected=asked,
                observed=f"{came}",
                hint=wanted.hint,
            )

    def _at_rate(self, wanted: _Wanted, tolerance: float, within: float) -> None:
        rate, need, every = wanted.rate, wanted.need, wanted.where is None
        if rate is None:
            return
        # What a busy machine held up for a moment comes at its rate again; what has another rate never does.
        enough = need if wanted.most is not None else _RATE_DECIDED * need

        def right() -> bool:
            last = wanted.counted()[-need:]
            in_time = wanted.most is not None or rates.in_time(last, rate, tolerance, every)
            return in_time and rates.at_rate(last, rate, tolerance, every)

        self._wait(lambda: right() or len(wanted.counted()) >= enough, within)
        until = time.monotonic() + within
        while not right() and rates.too_slow(wanted.counted()[-need:], rate, every) and time.monotonic() < until:
            known, began = wanted.recording.count, time.monotonic()
            self._wait(lambda: right() or wanted.recording.count >= known + need, within)  # noqa: B023
            if self._observer.patience.kept(began) < _HELD_UP * (time.monotonic() - began):
                break  # nobody else slowed it down
        last = wanted.counted()[-need:]
        if not right():
            if rates.too_slow(last, rate, every):
                gap, allowed = rates.median_gap(last, every), (1 + tolerance) / rate
                self._observer.patience.was_slow(last[0].received if last else until - within, gap, allowed)
            self._sure_if(not rates.too_slow(last, rate, every))
            measured = rates.in_words(last, every)
            bursts = " on the average, and several come close together" * rates.together(last, every)
            self._fail(
                wanted.title,
                RATE(
                    f"The messages arrive at {measured} instead of {rate:.4g} Hz{bursts}. "
                    + diagnosis.paces(self._scene(), wanted.recording.topic),
                ),
                expected=f"{rate:.4g} Hz within {tolerance:.0%}",
                observed=measured,
                hint=wanted.hint,
            )

    def _say(self, wanted: _Wanted, values: Callable[[list[Any]], object] | None) -> list[Any]:
        """Look at what the messages say; where nothing is wrong, return them."""
        received = [r.msg for r in wanted.counted()]
        wrong = objection(values(received), "The messages do not say what they should.") if values is not None else ""
        if not wrong:
            outcomes.passed(wanted.title, observed=_number(len(received)))
            return received
        shown = received if len(received) <= 4 else [*received[:2], *received[-2:]]
        said = [in_words(msg, values) for msg in shown]
        observed = shorten("; ".join(said if len(received) <= 4 else [*said[:2], "…", *said[2:]]))
        outcomes.passed(wanted.title, observed=_number(len(received)))
        self._fail(
            f"The messages on `{wanted.recording.topic}` say what they should",
            CONTENT(wrong),
            observed=observed,
            hint=wanted.hint,
        )

    @waits_for("messages on `{name}`")
    def expect_last(
        self,
        value: object,
        title: str = "",
        *,
        times: int = 1,
        within: float = WITHIN,
        because: str = "",
        code: str = CONTENT.code,
        evident: object = False,
        node: str = "",
        hint: str = "",
    ) -> None:
        """The topic comes to say this: the `data` of its last message is this value.

        Args:
            value: of `data`.
            title: what is required, as a sentence without its full stop.
            times: so many of the last messages say it, one after the other.
            within: seconds until they must.
            because: what is wrong if they do not, with `{said}` for what the last one says; by default just that.
            code: of that reason.
            evident: as for `ros.require`, like `node`.
            node: full name of a node: what its program waits for is a reason.
            hint: a pointer for the student.

        Example:
            `ros.topic("/health", String).expect_last("ok", within=8)`

        Codes:
            `code`, by default `content`, and errors in callbacks.
        """
        heard = self.listen()

        def last() -> list[Any]:
            return [getattr(received.msg, "data", received.msg) for received in heard.messages[-times:]]

        came = self._wait(lambda: last() == [value] * times, within)
        said = ", ".join(map(str, last())) or "nothing"
        because = because.replace("{said}", said) or f"After {within:g} s, the last of its messages says `{said}`."
        self._expect_that(
            came,
            title or f"`{self.name}` says `{value}`",
            lambda: self._why_not(because, code=code, evident=evident, node=node),
            expected=str(value) + f", {times} times" * (times > 1),
            observed=said,
            hint=hint,
        )

    @waits_for("silence on `{name}`")
    def expect_silence(self, *, for_seconds: float = 1.0, because: str = "", code: str = "", hint: str = "") -> None:
        """Nothing arrives on the topic from now on, whatever came before and is already under way.

        From now on: once the nodes that publish have answered a question, and so have taken what was sent before it.

        Args:
            for_seconds: how long it is watched, in seconds.
            because: what a message would mean here, if the check knows better than "it should not".
            code: the code of that reason.
            hint: a pointer for the student.

        Example:
            `ros.topic("/chatter", String).expect_silence(for_seconds=0.5)`

        Codes:
            `not-silent`, or `code`.
        """
        topic, msg_type = self.name, self._class
        recording = self._observer.record(topic, msg_type)
        self._observer.wait(self._hears_programs, MATCHES_WITHIN)  # nobody hears what was made a moment ago
        # By its answer, a node has taken what was sent to it before, too.
        self._settle_owners(lambda: self._observer.publishers(topic))
        begins = time.time() + _UNDER_WAY

        def published() -> int:
            """How many were published since then, whenever they came: on a busy machine a message may be late."""
            return sum(received.stamp > begins for received in recording.messages)

        came = self._observer.wait(published, _UNDER_WAY + for_seconds)
        self._expect_that(
            not came,
            f"Nothing is published on `{topic}`",
            lambda: (kind_of_lab(code) if code else NOT_SILENT)(
                because or f"Messages arrived on `{topic}`, but there should be none."
            ),
            expected="no message",
            observed=_number(published()),
            hint=hint,
        )

    def account(self) -> str:
        """What was seen of its publisher, of the callbacks of that node and of the messages: for reasons only.

        Example:
            `ros.require(heard, "The status goes on", because=f"Nothing came. {ros.topic('/status').account()}")`
        """
        return diagnosis.account(self._scene(), self.name)
