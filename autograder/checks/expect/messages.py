"""Expectations of messages: how many, how often, what is in them, from whom."""

from __future__ import annotations

import itertools
import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from rclpy.qos import QoSProfile

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.concurrency import Activity
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.graph import GraphExpectations
from autograder.checks.message_text import in_words, shorten
from autograder.diagnosis import Diagnosis
from autograder.graph.names import full_name
from autograder.graph.recording import Received, Recording, quiet_profile
from autograder.graph.stream import Stream

RELIABLE_DEEP = 1000
"""Depth of the observer's own publishers, so that a burst of its own is never cut."""

_RATE_DECIDED = 4
"""A rate is judged after so many times the messages that were asked for, if it is not right before."""

MATCHES_WITHIN = 1.0
"""Seconds to wait for the observer's recordings before it sends something that may be answered at once."""

DECISIVE_RUNS = 6
"""Complete runs of each callback after which "they never overlapped" is a finding, not bad luck."""


class MessageExpectations(GraphExpectations):
    """What must arrive, what must not, and sending."""

    def prepare(self) -> None:
        """Set up the observer's publishers."""
        super().prepare()
        self._publishers: dict[tuple[str, str], Any] = {}
        self.overlaps: list[tuple[str, str]] = []
        """Topic and title of each expectation of overlapping callbacks that was met."""

    def listen(self, topic: str, msg_type: type, qos: QoSProfile | None = None) -> Recording:
        """Record a topic from now on; the same topic and profile share a recording."""
        return self.observer.record(topic, msg_type, qos)

    def expect_messages(
        self,
        topic: str,
        msg_type: type,
        *,
        at_least: int = 0,
        at_most: int | None = None,
        exactly: int | None = None,
        rate: float | None = None,
        tolerance: float = 0.2,
        window: float = 1.0,
        after: int = 0,
        where: Callable[[Any], object] | None = None,
        values: Callable[[list[Any]], object] | None = None,
        publisher: str = "",
        publishers: int = 1,
        qos: QoSProfile | None = None,
        within: float = WITHIN,
        hint: str = "",
    ) -> list[Any]:
        """Messages arrive on a topic.

        Args:
            topic: full name.
            msg_type: message class.
            at_least: so many (by default 1, or 10 with `rate`), counted from the first.
            at_most: not more, looked at for `window` seconds more; 0 means silence for `window` seconds.
            exactly: both at once.
            rate: hertz, of the last messages; judged by the median gap of the publisher's own stamps, so that a slow
                grader does not matter.
            tolerance: allowed deviation of the rate, as a share.
            window: seconds.
            after: leaves out the first so many messages of the topic, for example those of a node's first life.
            where: counts only messages for which it gives something true.
            values: looks at all counted messages; a sentence that says what is wrong fails, and so does what is false.
            publisher: full name of the node that they must come from.
            publishers: how many publishers the topic may have.
            qos: subscribe with this profile instead of one that hears everything.
            within: seconds to wait for `at_least`.
            hint: a pointer for the student.

        Returns:
            the counted messages.
        """
        most = exactly if exactly is not None else at_most
        need = exactly if exactly is not None else at_least or (0 if most == 0 else 10 if rate else 1)
        recording = self.observer.record(topic, msg_type, qos)

        def counted() -> list[Received]:
            return [r for r in recording.messages[after:] if where is None or bool(where(r.msg))]

        title = _title(topic, need, most, rate)
        if not self.wait(lambda: len(counted()) >= need, within, lambda: self._ends(topic, msg_type, "publisher", "")):
            got, scene = len(counted()), self.scene()
            if where and not got and recording.count > after:
                # Messages do come, so what keeps callbacks waiting is not the reason.
                last = shorten(in_words(recording.messages[-1].msg, where), 120)
                reason = (
                    diagnosis.program_trouble(scene)
                    or diagnosis.inside_reason(scene)
                    or diagnosis.lifecycle_silence(scene)
                    or Diagnosis(f"Messages came, but none as expected; the last of them is `{last}`.", "content")
                )
            else:
                reason = diagnosis.why_silent(scene, topic, msg_type, qos or quiet_profile())
                if got and reason.code == diagnosis.SILENT:
                    reason = Diagnosis(
                        f"Only {got} of {need} messages came in {within:g} s. {reason.because}", "too-few"
                    )
            self.fail(title, reason, expected=f"{need} messages", observed=f"{got} messages", hint=hint)
        if most is not None:
            self.observer.wait(lambda: len(counted()) > most, window)
        received = counted()
        if most is not None and len(received) > most:
            self.fail(
                title,
                Diagnosis(f"{len(received)} messages came where at most {most} were expected.", "too-many"),
                expected=f"at most {most}",
                observed=f"{len(received)}",
                hint=hint,
            )
        self._one_source(title, topic, msg_type, publisher, publishers, recording.messages[after:])
        if rate is not None:
            # What a busy machine held up for a moment comes at its rate again; what has another rate never does.
            enough = need if most is not None else _RATE_DECIDED * need
            self.wait(lambda: _at_rate(counted()[-need:], rate, tolerance) or len(counted()) >= enough, within)
            received = counted()
            self._rate(title, received[-need:], rate, tolerance, hint)
        if values is not None:
            verdict = values([r.msg for r in received])
            if isinstance(verdict, str) or not verdict:
                said = verdict if isinstance(verdict, str) and verdict else "The messages do not say what they should."
                self.fail(
                    title,
                    Diagnosis(said, "content"),
                    observed=shorten("; ".join(in_words(r.msg, values) for r in received[:3])),
                    hint=hint,
                )
        outcomes.passed(title, observed=f"{len(received)} messages")
        return [r.msg for r in received]

    def _one_source(
        self, title: str, topic: str, msg_type: type, node: str, publishers: int, received: Sequence[Received]
    ) -> None:
        ends = self._ends(topic, msg_type, "publisher", "")
        if len(ends) > publishers:
            owners = ", ".join(sorted(full_name(end.node_namespace, end.node_name) for end in ends))
            self.fail(
                title,
                Diagnosis(
                    f"`{topic}` has {len(ends)} publishers ({owners}): it cannot be told whose messages these are.",
                    "extra-publisher",
                    "Publish on this topic from one place only.",
                ),
                expected=f"{publishers} publisher",
                observed=f"{len(ends)} publishers",
            )
        if publishers == 1:
            # Each publisher counts its own messages: a second one, gone by now, shows as a number that comes again.
            numbers = [r.sequence for r in received]
            if any(later <= earlier for earlier, later in itertools.pairwise(numbers)):
                self.fail(
                    title,
                    Diagnosis(
                        f"The messages on `{topic}` come from more than one publisher (their sequence numbers repeat).",
                        "extra-publisher",
                    ),
                    expected="one publisher",
                )
        if node and not any(full_name(end.node_namespace, end.node_name) == node for end in ends):
            owners = (
                ", ".join(sorted(full_name(end.node_namespace, end.node_name) for end in ends)) or "nobody any more"
            )
            self.fail(
                title,
                Diagnosis(f"The messages on `{topic}` come from {owners}, not from `{node}`.", "wrong-node"),
                expected=node,
                observed=owners,
            )

    def _rate(self, title: str, received: Sequence[Received], rate: float, tolerance: float, hint: str) -> None:
        median = _median_gap(received)
        if not _at_rate(received, rate, tolerance):
            measured = f"{1 / median:.1f} Hz" if median > 0 else "all at once"
            self.fail(
                title,
                Diagnosis(f"The messages come at {measured} instead of {rate:g} Hz.", "rate"),
                expected=f"{rate:g} Hz within {tolerance:.0%}",
                observed=measured,
                hint=hint,
            )

    def expect_silence(
        self, topic: str, msg_type: type, *, seconds: float = 1.0, because: str = "", code: str = "", hint: str = ""
    ) -> None:
        """Nothing arrives on the topic for `seconds`, after what is already under way.

        `because` and `code` say what a message would mean here, if the check knows better than "it should not".
        """
        recording = self.observer.record(topic, msg_type)
        self.observer.pause(0.15)  # messages sent before this moment may still arrive
        before = recording.count
        came = self.observer.wait(lambda: recording.count > before, seconds)
        self.expect_that(
            not came,
            f"Nothing is published on `{topic}`",
            lambda: Diagnosis(because or f"Messages came on `{topic}` that should not.", code or "not-silent"),
            expected="no message",
            observed=f"{recording.count - before} messages",
            hint=hint,
        )

    def open_publisher(self, topic: str, msg_type: type, *, qos: QoSProfile | int = RELIABLE_DEEP) -> Any:
        """Make the publisher that a later `publish` uses, before the program subscribes.

        A best-effort subscription hears only what comes after it has matched, and only the program can tell when that
        is: one that is made after the publisher has matched it by the time its other messages arrive.
        """
        profile = qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)
        key = (topic, str(profile))  # its repr would tell objects apart, not policies
        if key not in self._publishers:
            self._publishers[key] = self.observer.publisher(topic, msg_type, profile)
        return self._publishers[key]

    def publish(
        self,
        topic: str,
        *messages: Any,
        qos: QoSProfile | int = RELIABLE_DEEP,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Send messages to the student's node, after its subscription has matched, and the recordings what answers.

        What the messages set off is heard from the first one on if its topic is recorded: `listen` before.
        A missing or incompatible subscription is a failed outcome with its reason.
        """
        msg_type = type(messages[0])
        profile = qos if isinstance(qos, QoSProfile) else QoSProfile(depth=qos)
        publisher = self.open_publisher(topic, msg_type, qos=profile)
        self._wait_until_heard(publisher.get_subscription_count, topic, msg_type, profile, within, hint)
        self.observer.wait(self.observer.hears_all, MATCHES_WITHIN)
        for message in messages:
            publisher.publish(message)

    def _wait_until_heard(
        self, matched: Callable[[], int], topic: str, msg_type: type, profile: QoSProfile, within: float, hint: str
    ) -> None:
        """Wait until a subscription has matched a publisher of the observer's; fail with what keeps them apart."""
        if self.wait_for_graph(matched, within):
            return
        reason = diagnosis.why_not_matched(self.scene(), topic, profile, "subscription") or diagnosis.why_no_endpoint(
            self.scene(), topic, msg_type, "subscription"
        )
        self.fail(
            f"A node listens to `{topic}`",
            reason,
            expected=f"a subscription on {topic}",
            observed=self._topics(),
            hint=hint,
        )

    def stream(self, topic: str, message: Any, *, rate: float, qos: QoSProfile) -> Stream:
        """A message that is sent again and again, as by a sensor or a controller, between `start()` and `stop()`.

        Args:
            topic: full name; a node of the student's must subscribe to it with a profile that matches.
            message: what is sent.
            rate: hertz.
            qos: what is offered.
        """

        def expect_heard(matched: Callable[[], int]) -> None:
            self._wait_until_heard(matched, topic, type(message), qos, WITHIN, "")

        return Stream(self.observer, topic, message, rate, qos, expect_heard)

    def activity(self, topic: str) -> Activity:
        """Begins and ends of callbacks that have arrived on a topic so far."""
        from std_msgs.msg import String

        return Activity(self.observer.record(topic, String).messages)

    def _wait_for_runs(self, topic: str, names: Sequence[str], runs: int, title: str, within: float, hint: str) -> None:

        def come() -> bool:
            return all(self.activity(topic).runs(name) >= runs for name in names)

        self.wait(lambda: come() or self._starves(topic, names, runs), within)
        if come():
            return
        from std_msgs.msg import String

        found = self.activity(topic)
        counts = {name: found.runs(name) for name in names}
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        scene = self.scene()
        if not any(counts.values()):
            reason = diagnosis.why_silent(scene, topic, String, quiet_profile())
        else:
            missing = ", ".join(name for name, count in counts.items() if count < runs)
            trouble = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
            reason = (
                trouble or diagnosis.why_starved(scene) or Diagnosis(diagnosis.account(scene, topic), "too-few-runs")
            )
            if not trouble:
                reason = replace(
                    reason,
                    because=f"{missing} did not run {'once' if runs == 1 else f'{runs} times'}"
                    f"{' while others did' * any(count >= runs for count in counts.values())}. " + reason.because,
                )
        self.fail(title, reason, expected=f"{runs} complete runs of each", observed=told or "no run", hint=hint)

    def _starves(self, topic: str, names: Sequence[str], runs: int) -> bool:
        """Whether some callback has run so often that one of these, with fewer than `runs` runs, gets no turn."""
        counts = Counter(span.name for span in self.activity(topic).spans())
        often = max(2 * DECISIVE_RUNS, 8 * runs)
        return min(counts[name] for name in names) < runs and max(counts.values(), default=0) >= often

    def expect_runs(
        self, topic: str, names: Sequence[str], *, runs: int = 2, within: float = WITHIN, hint: str = ""
    ) -> None:
        """Each of the named callbacks runs completely at least `runs` times."""
        title = f"{', '.join(names)} run, each at least {runs} times"
        self._wait_for_runs(topic, names, runs, title, within, hint)
        outcomes.passed(title)

    def expect_period(
        self,
        topic: str,
        names: Sequence[str],
        period: float,
        *,
        tolerance: float = 0.2,
        runs: int = 4,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Each of the named callbacks begins every `period` seconds, judged by the median of at least `runs` gaps.

        Args:
            topic: where they publish `NAME begin` and `NAME end` (`std_msgs/String`).
            names: the callbacks.
            period: seconds.
            tolerance: allowed deviation, as a share.
            runs: gaps between two begins of each; three times as many decide against it.
            within: seconds to wait for them.
            hint: a pointer for the student.
        """
        title = f"{', '.join(names)} run{'s' if len(names) == 1 else ', each'} every {period:g} s"

        def wrong(least: int) -> dict[str, list[float]]:
            gaps = {name: self.activity(topic).gaps(name) for name in names}
            return {
                name: found
                for name, found in gaps.items()
                if len(found) < least or abs(statistics.median(found) - period) > tolerance * period
            }

        def decided() -> bool:
            off = wrong(runs)
            long_off = any(len(gaps) >= 3 * runs for gaps in off.values())
            return not off or long_off or self._starves(topic, names, runs)

        self.wait(decided, within)
        late = wrong(runs)
        if all(len(found) < runs for found in late.values()):
            self._wait_for_runs(topic, names, runs, title, 0.0, hint)
        told = ", ".join(f"{name} every {statistics.median(found):.2f} s" for name, found in late.items() if found)
        self.expect_that(
            not late,
            title,
            lambda: Diagnosis(f"From begin to begin it was: {told}.", "period"),
            expected=f"{period:g} s within {tolerance:.0%}",
            observed=told,
            hint=hint,
        )

    def expect_overlap(
        self,
        topic: str,
        names: Sequence[str],
        others: Sequence[str] = (),
        *,
        itself: bool = False,
        at_least: int = 2,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Callbacks run at the same time.

        Args:
            topic: where they publish `NAME begin` and `NAME end` (`std_msgs/String`).
            names: two different ones of these are under way at once; with `others`, one of these and one of those.
            others: the other side.
            itself: each of `names` overlaps itself instead.
            at_least: so many of them at once; with `others`, one of each is enough.
            within: seconds to wait.
            hint: a pointer for the student.
        """
        if itself:
            title = f"{' and '.join(names)} overlap{'s' if len(names) == 1 else ''} itself" + (
                f", {at_least} runs at once" if at_least > 2 else ""
            )
        elif others:
            title = f"{', '.join(names)} and {', '.join(others)} overlap each other"
        else:
            title = f"{', '.join(names)} overlap each other" + (f", {at_least} at once" if at_least > 2 else "")

        def holds() -> bool:
            found = self.activity(topic)
            if itself:
                return all(found.overlap([name]) >= at_least for name in names)
            return found.crossed(names, others) if others else found.distinct_overlap(names) >= at_least

        def decided() -> bool:
            found = self.activity(topic)
            everybody = [*names, *others]
            enough = all(found.runs(name) >= DECISIVE_RUNS for name in everybody)
            return holds() or enough or self._starves(topic, everybody, 1)

        self.wait(decided, within)
        if holds():
            outcomes.passed(title)
            self.overlaps.append((topic, title))
            return
        if not all(self.activity(topic).runs(name) for name in [*names, *others]):
            self._wait_for_runs(topic, [*names, *others], 1, title, 0.1, hint)
        found = self.activity(topic)
        most = max(found.overlap([name]) for name in names) if itself else found.distinct_overlap([*names, *others])
        at_most = f"There were never more than {most} at once."
        apart = f"None of {', '.join(names)} ran beside one of {', '.join(others)}."
        scene = self.scene()
        self.fail(
            title,
            diagnosis.program_trouble(scene)
            or diagnosis.inside_reason(scene)
            or diagnosis.why_not_together(scene, topic, 2 if others else at_least, itself)
            or Diagnosis(f"{apart if others else at_most} {diagnosis.layout(scene, topic)}".strip(), "no-overlap"),
            expected="one of each at once" if others else f"{at_least} at once",
            observed="never one of each" if others else f"{most} at once" if most > 1 else "one at a time",
            hint=hint,
        )

    def expect_no_overlap(
        self, topic: str, names: Sequence[str], *, runs: int = 3, within: float = WITHIN, hint: str = ""
    ) -> None:
        """The named callbacks never run at the same time; each must have run at least `runs` times to count."""
        title = f"{', '.join(names)} never overlap"
        self._wait_for_runs(topic, names, runs, title, within, hint)
        most = self.activity(topic).overlap(names)
        self.expect_that(
            most <= 1,
            title,
            lambda: Diagnosis(
                f"Up to {most} of them ran at once: they are not all in one mutually exclusive group.",
                "overlap",
                "Callbacks exclude each other only within the same MutuallyExclusiveCallbackGroup object.",
            ),
            expected="one at a time",
            observed=f"{most} at once",
            hint=hint,
        )

    def messages_during(
        self, topic: str, msg_type: type, *, callback: str = "", activity: str = "", service: str = ""
    ) -> list[int]:
        """How many messages on `topic` were published during each run of a callback or each call of a service so far.

        Args:
            topic: full name of the topic whose messages are counted, by the publisher's stamps.
            msg_type: their class.
            callback: a callback that publishes `NAME begin` and `NAME end` (`std_msgs/String`) ...
            activity: ... on this topic.
            service: or a service that the check offers (`serve`): from a request's arrival to its answer.
        """
        if service:
            spans = self.served(service)
        else:
            spans = [(span.begin, span.end) for span in self.activity(activity).spans() if span.name == callback]
        stamps = [received.stamp for received in self.observer.record(topic, msg_type).messages]
        return [sum(1 for stamp in stamps if begin < stamp < end) for begin, end in spans]

    def expect_messages_during(
        self,
        topic: str,
        msg_type: type,
        *,
        callback: str = "",
        activity: str = "",
        service: str = "",
        at_least: int = 1,
        runs: int = 3,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Messages go on while a slow callback runs, or while the node waits for a service.

        One run with enough messages is enough: a busy machine may have stopped the whole node during another.

        Args:
            topic: as for `messages_during`, like `msg_type`, `callback`, `activity` and `service`.
            msg_type: message class.
            callback: name in `activity`.
            activity: topic of begins and ends.
            service: full name of an offered service, instead of a callback.
            at_least: messages.
            runs: complete runs (or answered calls) to look at before giving up.
            within: seconds.
            hint: a pointer for the student.
        """
        title = f"`{topic}` goes on while " + (f"`{service}` is being called" if service else f"`{callback}` runs")

        def counts() -> list[int]:
            return self.messages_during(topic, msg_type, callback=callback, activity=activity, service=service)

        def enough() -> bool:
            return max(counts(), default=0) >= at_least

        self.wait(lambda: enough() or len(counts()) >= runs, within)
        self.observer.wait(enough, 0.2)  # the last messages may come after the end that lies behind them
        seen = counts()
        if not enough():
            if not service and not seen:
                self._wait_for_runs(activity, [callback], 1, title, 0.0, hint)
            told = ", ".join(str(count) for count in seen) or "no complete run"
            scene = self.scene()
            self.fail(
                title,
                diagnosis.program_trouble(scene)
                or diagnosis.inside_reason(scene)
                or diagnosis.waits_for_its_group(scene)
                or diagnosis.why_not_together(scene, activity or topic)
                or Diagnosis(
                    f"The most that came on `{topic}` in one run is {max(seen, default=0)}. "
                    + diagnosis.layout(scene, activity or topic),
                    "paused",
                ),
                expected=f"at least {at_least} messages in one run",
                observed=told,
                hint=hint,
            )
        self._one_source(title, topic, msg_type, "", 1, self.observer.record(topic, msg_type).messages)
        outcomes.passed(title, observed=", ".join(str(count) for count in seen))


def _median_gap(received: Sequence[Received]) -> float:
    """Seconds between two messages as they were published; 0 if there are fewer than two."""
    gaps = [later.stamp - earlier.stamp for earlier, later in itertools.pairwise(received)]
    return statistics.median(gaps) if gaps else 0.0


def _at_rate(received: Sequence[Received], rate: float, tolerance: float) -> bool:
    median = _median_gap(received)
    return median > 0 and abs(median - 1 / rate) <= tolerance / rate


def _title(topic: str, need: int, most: int | None, rate: float | None) -> str:
    if most == 0:
        return f"No message arrives on `{topic}`"
    number = f"Exactly {need}" if most == need else f"At least {need}" + (f", at most {most}," if most else "")
    return f"{number} message{' arrives' if need == 1 else 's arrive'} on `{topic}`" + (
        f" at {rate:g} Hz" if rate else ""
    )
