"""`ros.activity`: callbacks that publish when they begin and end: how often they run, and which run at once."""

from __future__ import annotations

import statistics
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from std_msgs.msg import String

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.concurrency import Concurrency
from autograder.checks.expect import rates
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.expect.meanwhile import PAUSED, Meanwhile, published_during
from autograder.checks.expect.topic import Topic
from autograder.checks.misuse import Misuse
from autograder.checks.waiting import waits_for
from autograder.graph.recording import quiet_profile
from autograder.reasons import Group, Kind, Reason

TOO_FEW_RUNS = Kind(
    "too-few-runs",
    "a callback reported fewer runs than required; no other reason was established",
    Group.MESSAGES,
    "timeline",
)
NO_OVERLAP = Kind(
    "no-overlap",
    "callbacks that should run at once did not; no other reason was established",
    Group.MESSAGES,
    "timeline",
)
OVERLAP = Kind("overlap", "callbacks that should exclude each other ran at once", Group.MESSAGES, "timeline")

PERIOD = Kind(
    "period", "the time from one begin of a callback to the next is not the asked one", Group.MESSAGES, "timeline"
)

DECISIVE_RUNS = 6
"""Complete runs of each callback after which "they never overlapped" is a finding, not bad luck."""


class Activity(Meanwhile):
    """A topic on which callbacks publish when they begin and end: how often they run, and which run at once."""

    def seen(self) -> Concurrency:
        """Begins and ends of callbacks that have arrived on a topic so far, and which overlap.


        Example:
            `ros.wait(lambda: ros.activity("/activity").seen().runs("slow") >= 3)`
        """
        recording = self._observer.record(self.name, String)
        known = self._running.concurrencies.get(self.name)
        if known is None or known.messages != recording.count:  # it is asked again and again while nothing arrives
            known = self._running.concurrencies[self.name] = Concurrency(recording.messages)
        return known

    def _wait_for_runs(self, names: Sequence[str], runs: int, title: str, within: float, hint: str) -> None:
        """Wait until each callback has completed so many runs; otherwise fail with what prevents it."""
        refuse_names(names)

        self._wait(lambda: self._came(names, runs) or self._starves(names, runs), within)
        if self._came(names, runs):
            return
        found = self.seen()
        counts = {name: found.runs(name) for name in names}
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        reason = self._why_too_few(counts, runs)
        self._fail(title, reason, expected=f"{runs} complete runs of each", observed=told or "no run", hint=hint)

    def _came(self, names: Sequence[str], runs: int) -> bool:
        found = self.seen()
        return all(found.runs(name) >= runs for name in names)

    def _why_too_few(self, counts: Mapping[str, int], runs: int) -> Reason:
        scene = self._scene()
        alike = diagnosis.why_all_alike(scene) if 0 in counts.values() else None
        if alike:
            return alike
        if not any(counts.values()):
            return diagnosis.why_silent(scene, self.name, String, quiet_profile())
        trouble = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
        if trouble:
            return trouble
        reason = diagnosis.why_starved(scene) or TOO_FEW_RUNS(diagnosis.account(scene, self.name))
        missing = ", ".join(name for name, count in counts.items() if count < runs)
        others = " while others did" if any(count >= runs for count in counts.values()) else ""
        because = f"{missing} did not run {'once' if runs == 1 else f'{runs} times'}{others}. {reason.because}"
        return replace(reason, because=because)

    def _starves(self, names: Sequence[str], runs: int) -> bool:
        """Whether one of these callbacks, with fewer than `runs` runs, gets no turn while another runs very often."""
        counts = Counter(span.name for span in self.seen().spans())
        often = max(2 * DECISIVE_RUNS, 8 * runs)
        return min(counts[name] for name in names) < runs and max(counts.values(), default=0) >= often

    def messages_during(self, callback: str, topic: Topic) -> list[int]:
        """How many messages on `topic` were published during each complete run of a callback so far.

        Args:
            callback: its name.
            topic: whose messages are counted, by the publisher's stamps.

        Example:
            `counts = ros.activity("/activity").messages_during("slow", ros.topic("/heartbeat", Int64))`
        """
        return published_during(topic, self._runs(callback))

    def _runs(self, callback: str) -> list[tuple[float, float]]:
        return [(span.begin, span.end) for span in self.seen().spans() if span.name == callback]

    @waits_for("messages during runs of callbacks, told on `{name}`")
    def expect_messages_during(
        self,
        callback: str,
        topic: Topic,
        *,
        at_least: int = 1,
        runs: int = 3,
        within: float = WITHIN,
        hint: str = "",
    ) -> None:
        """Messages go on while a slow callback runs.

        One run with enough messages is enough: a busy machine may have stopped the whole node during another.

        Args:
            callback: its name.
            topic: whose messages are counted, by the publisher's stamps.
            at_least: messages in one run.
            runs: complete runs to look at before giving up.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.activity("/activity").expect_messages_during("slow", ros.topic("/heartbeat", Int64), at_least=2)`

        Codes:
            `paused` or the cause of it, `extra-publisher`, and those of `expect_runs`.
        """

        def look_at_runs(title: str) -> None:
            if not self.messages_during(callback, topic):
                self._wait_for_runs([callback], 1, title, 0.0, hint)
            self._too_short(title, topic, callback, at_least, hint)

        self._expect_messages(
            topic,
            f"`{callback}` runs",
            lambda: self._runs(callback),
            at_least=at_least,
            runs=runs,
            within=within,
            hint=hint,
            told_on=self.name,
            look_first=look_at_runs,
        )

    def _too_short(self, title: str, topic: Topic, callback: str, at_least: int, hint: str) -> None:
        """Fail if no run of the callback was long enough for so many messages, at the pace at which these come."""
        gap = rates.median_gap(topic.listen().messages)
        spans = [span.end - span.begin for span in self.seen().spans() if span.name == callback]
        if spans and 0.0 < max(spans) < (at_least - 1) * gap:
            self._fail(
                title,
                PAUSED(
                    f"The longest run of `{callback}` took {max(spans):.2f} s, and a message arrives on `{topic.name}` "
                    f"every {gap:.2f} s. Such a run is too short for {at_least} messages.",
                ),
                expected=f"at least {at_least} messages in one run",
                observed=f"runs of at most {max(spans):.2f} s",
                hint=hint,
            )

    @waits_for("runs of callbacks, told on `{name}`")
    def expect_runs(self, names: Sequence[str], *, runs: int = 2, within: float = WITHIN, hint: str = "") -> None:
        """Each of the named callbacks runs completely, again and again.

        Args:
            names: the callbacks.
            runs: complete runs of each, at least.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.activity("/activity").expect_runs(["slow", "fast"], runs=3)`

        Codes:
            `too-few-runs`, and what starves a callback or keeps a topic silent.
        """
        times = "once" if runs == 1 else f"{runs} times"
        title = f"{', '.join(names)} run{'s' if len(names) == 1 else ', each'} at least {times}"
        self._wait_for_runs(names, runs, title, within, hint)
        outcomes.passed(title)

    @waits_for("callbacks that overlap, told on `{name}`")
    def expect_overlap(
        self,
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
            names: two different ones of these are under way at once; with `others`, one of these and one of those.
            others: the other side.
            itself: each of `names` overlaps itself instead.
            at_least: so many of them at once; with `others`, one of each is enough.
            within: seconds until they must have been seen together.
            hint: a pointer for the student.

        Example:
            `ros.activity("/activity").expect_overlap(["camera", "planner"])`

        Codes:
            `no-overlap` or the cause of it, and those of `expect_runs`.
        """
        refuse_names(names)
        refuse_names(others, may_be_empty=True)
        together = _Together(tuple(names), tuple(others), itself, at_least)
        everybody = [*names, *others]

        def holds() -> bool:
            return together.seen(self.seen())

        def decided() -> bool:
            found = self.seen()
            # Of runs of one callback the short ones are complete while a long one is still under way beside them.
            enough = not itself and all(found.runs(name) >= DECISIVE_RUNS for name in everybody)
            return holds() or enough or self._starves(everybody, 1)

        self._wait(decided, within)
        if holds():
            outcomes.passed(together.title)
            self._running.overlaps.append((self.name, together.title))
            return
        if not all(self.seen().runs(name) for name in everybody):
            self._wait_for_runs(everybody, 1, together.title, 0.1, hint)
        self._never_together(together, hint)

    def _never_together(self, together: _Together, hint: str) -> None:
        most = together.most(self.seen())
        scene = self._scene()
        self._fail(
            together.title,
            diagnosis.program_trouble(scene)
            or diagnosis.inside_reason(scene)
            or diagnosis.why_not_together(
                scene, self.name, 2 if together.others else together.at_least, together.itself
            )
            or NO_OVERLAP(f"{together.apart(most)} {diagnosis.layout(scene, self.name)}".strip()),
            expected="one of each at once" if together.others else f"{together.at_least} at once",
            observed="never one of each" if together.others else f"{most} at once" if most > 1 else "one at a time",
            hint=hint,
        )

    @waits_for("runs of callbacks, told on `{name}`")
    def expect_no_overlap(self, names: Sequence[str], *, runs: int = 3, within: float = WITHIN, hint: str = "") -> None:
        """The named callbacks never run at the same time.

        Args:
            names: the callbacks.
            runs: complete runs of each, at least, before that counts.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.activity("/activity").expect_no_overlap(["read", "write"])`

        Codes:
            `overlap`, and those of `expect_runs`.
        """
        title = f"{', '.join(names)} never overlap"
        refuse_names(names)

        def decided() -> bool:
            # What ran at once did so however few runs there were, and one of them may seldom get its turn.
            return self.seen().overlap(names) > 1 or self._came(names, runs) or self._starves(names, runs)

        self._wait(decided, within)
        most = self.seen().overlap(names)
        self._sure_if(most > 1)
        if most <= 1:
            self._wait_for_runs(names, runs, title, 0.0, hint)
        self._expect_that(
            most <= 1,
            title,
            lambda: OVERLAP(
                f"Up to {most} of them ran at once: they are not all in one mutually exclusive group.",
                "Callbacks exclude each other only within the same MutuallyExclusiveCallbackGroup object. "
                "A lock does it, too, if it is taken before `begin` is published and kept until after `end`.",
            ),
            expected="one at a time",
            observed=f"{most} at once",
            hint=hint,
        )

    @waits_for("runs of callbacks, told on `{name}`")
    def expect_period(
        self,
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
            names: the callbacks.
            period: seconds.
            tolerance: allowed deviation, as a share.
            runs: gaps between two begins of each, 3 at least; three times as many decide against it.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.activity("/activity").expect_period(["tick"], 0.1)`

        Codes:
            `period`, and those of `expect_runs`.
        """
        refuse_names(names)
        if runs < 3:
            raise Misuse(f"runs={runs}: one callback that begins late would decide about the median of so few gaps.")
        title = f"{', '.join(names)} run{'s' if len(names) == 1 else ', each'} every {period:g} s"

        def decided() -> bool:
            off = self._off_period(names, period, tolerance, runs)
            long_off = any(len(gaps) >= 3 * runs for gaps in off.values())
            return not off or long_off or self._starves(names, runs)

        self._wait(decided, within)
        late = self._off_period(names, period, tolerance, runs)
        if late and all(len(gaps) < runs for gaps in late.values()):
            self._wait_for_runs(names, runs + 1, title, 0.0, hint)  # so many gaps lie between one run more
        told = ", ".join(f"{name} every {statistics.median(gaps):.2f} s" for name, gaps in late.items() if gaps)
        self._sure_if(all(gaps and statistics.median(gaps) < period for gaps in late.values()))
        for gaps in filter(None, late.values()):
            since = time.monotonic() - sum(gaps)
            self._observer.patience.was_slow(since, statistics.median(gaps), (1 + tolerance) * period)
        self._expect_that(
            not late,
            title,
            lambda: PERIOD(
                f"From begin to begin it was: {told}. {diagnosis.paces(self._scene(), self.name)}".rstrip(),
            ),
            expected=f"{period:g} s within {tolerance:.0%}",
            observed=told,
            hint=hint,
        )

    def _off_period(self, names: Sequence[str], period: float, tolerance: float, least: int) -> dict[str, list[float]]:
        """For each callback with fewer than `least` gaps between its begins, or another median gap: these gaps."""
        gaps = {name: self.seen().gaps(name) for name in names}
        return {
            name: found
            for name, found in gaps.items()
            if len(found) < least or abs(statistics.median(found) - period) > tolerance * period
        }


@dataclass(frozen=True)
class _Together:
    """Which callbacks are to run at the same time."""

    names: Sequence[str]
    others: Sequence[str]
    itself: bool
    at_least: int

    @property
    def title(self) -> str:
        if self.itself:
            several = f", {self.at_least} runs at once" if self.at_least > 2 else ""
            return f"{' and '.join(self.names)} overlap{'s' if len(self.names) == 1 else ''} itself{several}"
        if self.others:
            return f"{', '.join(self.names)} and {', '.join(self.others)} overlap each other"
        return f"{', '.join(self.names)} overlap each other" + (
            f", {self.at_least} at once" if self.at_least > 2 else ""
        )

    def seen(self, found: Concurrency) -> bool:
        """Whether they ran at the same time."""
        if self.itself:
            return all(found.overlap([name]) >= self.at_least for name in self.names)
        if self.others:
            return found.crossed(self.names, self.others)
        return found.distinct_overlap(self.names) >= self.at_least

    def most(self, found: Concurrency) -> int:
        """How many of them ran at the same time."""
        if self.itself:
            return max(found.overlap([name]) for name in self.names)
        return found.distinct_overlap([*self.names, *self.others])

    def apart(self, most: int) -> str:
        """Say that they did not run at the same time."""
        if self.others:
            return f"None of {', '.join(self.names)} ran beside one of {', '.join(self.others)}."
        return f"There were never more than {most} at once."


def refuse_names(names: Sequence[str], may_be_empty: bool = False) -> None:
    """Refuse a text in place of a list of names, because each of its letters would be taken for a name."""
    if isinstance(names, str) or not (names or may_be_empty):
        raise Misuse(f'{names!r} is no list of callbacks\' names; write ["NAME", …].')
