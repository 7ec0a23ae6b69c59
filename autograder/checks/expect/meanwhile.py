"""What goes on while something else lasts: while a callback runs, a service is being called or a goal is executed."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.expect.endpoints import Sources
from autograder.checks.expect.topic import Topic
from autograder.reasons import Group, Kind, Reason

PAUSED = Kind(
    "paused", "messages stopped while a callback ran; no other reason was established", Group.MESSAGES, "timeline"
)


def published_during(topic: Topic, spans: Iterable[tuple[float, float]]) -> list[int]:
    """How many messages were published in each of these times, by the publisher's stamps.

    Args:
        topic: whose messages.
        spans: begins and ends, in seconds on the system clock.
    """
    # Looked up, not counted one by one: a program decides how many runs and how many messages there are.
    stamps = sorted(received.stamp for received in topic.listen().messages)
    return [max(0, bisect_left(stamps, end) - bisect_right(stamps, begin)) for begin, end in spans]


class Meanwhile(Sources):
    """Something that lasts, and what must go on meanwhile."""

    def _expect_messages(
        self,
        topic: Topic,
        meanwhile: str,
        spans: Callable[[], list[tuple[float, float]]],
        *,
        at_least: int,
        runs: int,
        within: float,
        hint: str,
        told_on: str = "",
        why: Callable[[], Reason | None] = lambda: None,
        look_first: Callable[[str], None] = lambda title: None,
    ) -> None:
        """Messages go on meanwhile; one time with enough of them is enough.

        Args:
            topic: on which they come.
            meanwhile: what lasts, in words.
            spans: tells when it began and ended each time so far, in seconds on the system clock.
            at_least: messages of one time.
            runs: times to look at before giving up.
            within: seconds until these must have come.
            hint: a pointer for the student.
            told_on: the topic whose node is looked at for a reason; by default the topic of the messages.
            why: looks for a reason that only this thing can have.
            look_first: is given the title and may fail, before it is said that the messages paused.
        """
        title = f"`{topic.name}` goes on while {meanwhile}"

        def counts() -> list[int]:
            return published_during(topic, spans())

        def enough() -> bool:
            return max(counts(), default=0) >= at_least

        self._wait(lambda: enough() or len(counts()) >= runs, within)
        self._observer.wait(enough, 0.2)  # the last messages may come after the end that lies behind them
        seen = counts()
        if not enough():
            look_first(title)
            scene, most = self._scene(), max(seen, default=0)
            number = f"At most {most} message{'s' * (most != 1)}" if most else "No message"
            told_on = told_on or topic.name
            self._fail(
                title,
                diagnosis.program_trouble(scene)
                or diagnosis.inside_reason(scene)
                or why()
                or diagnosis.sent_nothing(scene, topic.name, spans())
                or diagnosis.waits_for_its_group(scene)
                or diagnosis.why_not_together(scene, told_on)
                or PAUSED(f"{number} arrived on `{topic.name}` during one run. {diagnosis.layout(scene, told_on)}"),
                expected=f"at least {at_least} messages in one run",
                observed=", ".join(str(count) for count in seen) or "no complete run",
                hint=hint,
            )
        heard = topic.listen()
        self._one_source(title, topic.name, heard.msg_type, "", 1, heard.messages)
        outcomes.passed(title, observed=", ".join(str(count) for count in seen))
