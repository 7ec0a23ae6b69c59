"""Expectations of callbacks that publish their begins and ends: how often they run, and which run at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from std_msgs.msg import String

from autograder import diagnosis
from autograder.checks import outcomes
from autograder.checks.concurrency import Concurrency
from autograder.checks.expect.expectations import WITHIN, Expectations
from autograder.checks.misuse import Misuse
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

DECISIVE_RUNS = 6
"""Complete runs of each callback after which "they never overlapped" is a finding, not bad luck."""


class ConcurrencyExpectations(Expectations):
    """Which callbacks run, and which run at the same time."""

    @cached_property
    def _overlaps(self) -> list[tuple[str, str]]:
        """Topic and title of each expectation of overlapping callbacks that was met."""
        return []

    @cached_property
    def _concurrencies(self) -> dict[str, Concurrency]:
        """What was made last of the messages on each topic."""
        return {}

    def concurrency(self, topic: str) -> Concurrency:
        """Begins and ends of callbacks that have arrived on a topic so far, and which overlap.

        Args:
            topic: where they publish `NAME begin` and `NAME end` (`std_msgs/String`).

        Example:
            `ros.wait(lambda: ros.concurrency("/activity").runs("slow") >= 3)`
        """
        recording = self._observer.record(topic, String)
        known = self._concurrencies.get(topic)
        if known is None or known.messages != recording.count:  # it is asked again and again while nothing arrives
            known = self._concurrencies[topic] = Concurrency(recording.messages)
        return known

    def _wait_for_runs(self, topic: str, names: Sequence[str], runs: int, title: str, within: float, hint: str) -> None:
        """Wait until each of the callbacks has run completely so often; fail with what keeps one from it."""
        refuse_names(names)

        def come() -> bool:
            return all(self.concurrency(topic).runs(name) >= runs for name in names)

        self.wait(lambda: come() or self._starves(topic, names, runs), within)
        if come():
            return
        found = self.concurrency(topic)
        counts = {name: found.runs(name) for name in names}
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        reason = self._why_too_few(topic, counts, runs)
        self._fail(title, reason, expected=f"{runs} complete runs of each", observed=told or "no run", hint=hint)

    def _why_too_few(self, topic: str, counts: Mapping[str, int], runs: int) -> Reason:
        scene = self._scene()
        alike = diagnosis.why_all_alike(scene) if 0 in counts.values() else None
        if alike:
            return alike
        if not any(counts.values()):
            return diagnosis.why_silent(scene, topic, String, quiet_profile())
        trouble = diagnosis.program_trouble(scene) or diagnosis.inside_reason(scene)
        if trouble:
            return trouble
        reason = diagnosis.why_starved(scene) or TOO_FEW_RUNS(diagnosis.account(scene, topic))
        missing = ", ".join(name for name, count in counts.items() if count < runs)
        others = " while others did" if any(count >= runs for count in counts.values()) else ""
        because = f"{missing} did not run {'once' if runs == 1 else f'{runs} times'}{others}. {reason.because}"
        return replace(reason, because=because)

    def _starves(self, topic: str, names: Sequence[str], runs: int) -> bool:
        """Whether some callback has run so often that one of these, with fewer than `runs` runs, gets no turn."""
        counts = Counter(span.name for span in self.concurrency(topic).spans())
        often = max(2 * DECISIVE_RUNS, 8 * runs)
        return min(counts[name] for name in names) < runs and max(counts.values(), default=0) >= often

    def expect_runs(
        self, topic: str, names: Sequence[str], *, runs: int = 2, within: float = WITHIN, hint: str = ""
    ) -> None:
        """Each of the named callbacks runs completely, again and again.

        Args:
            topic: where they publish `NAME begin` and `NAME end` (`std_msgs/String`).
            names: the callbacks.
            runs: complete runs of each, at least.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_runs("/activity", ["slow", "fast"], runs=3)`

        Codes:
            `too-few-runs`, and what starves a callback or keeps a topic silent.
        """
        title = f"{', '.join(names)} run, each at least {runs} times"
        self._wait_for_runs(topic, names, runs, title, within, hint)
        outcomes.passed(title)

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
            within: seconds until they must have been seen together.
            hint: a pointer for the student.

        Example:
            `ros.expect_overlap("/activity", ["camera", "planner"])`

        Codes:
            `no-overlap` or the cause of it, and those of `expect_runs`.
        """
        refuse_names(names)
        refuse_names(others, may_be_empty=True)
        together = _Together(tuple(names), tuple(others), itself, at_least)
        everybody = [*names, *others]

        def holds() -> bool:
            return together.seen(self.concurrency(topic))

        def decided() -> bool:
            found = self.concurrency(topic)
            # Of runs of one callback the short ones are complete while a long one is still under way beside them.
            enough = not itself and all(found.runs(name) >= DECISIVE_RUNS for name in everybody)
            return holds() or enough or self._starves(topic, everybody, 1)

        self.wait(decided, within)
        if holds():
            outcomes.passed(together.title)
            self._overlaps.append((topic, together.title))
            return
        if not all(self.concurrency(topic).runs(name) for name in everybody):
            self._wait_for_runs(topic, everybody, 1, together.title, 0.1, hint)
        self._never_together(topic, together, hint)

    def _never_together(self, topic: str, together: _Together, hint: str) -> None:
        most = together.most(self.concurrency(topic))
        scene = self._scene()
        self._fail(
            together.title,
            diagnosis.program_trouble(scene)
            or diagnosis.inside_reason(scene)
            or diagnosis.why_not_together(scene, topic, 2 if together.others else together.at_least, together.itself)
            or NO_OVERLAP(f"{together.apart(most)} {diagnosis.layout(scene, topic)}".strip()),
            expected="one of each at once" if together.others else f"{together.at_least} at once",
            observed="never one of each" if together.others else f"{most} at once" if most > 1 else "one at a time",
            hint=hint,
        )

    def expect_no_overlap(
        self, topic: str, names: Sequence[str], *, runs: int = 3, within: float = WITHIN, hint: str = ""
    ) -> None:
        """The named callbacks never run at the same time.

        Args:
            topic: where they publish `NAME begin` and `NAME end` (`std_msgs/String`).
            names: the callbacks.
            runs: complete runs of each, at least, before that counts.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_no_overlap("/activity", ["read", "write"])`

        Codes:
            `overlap`, and those of `expect_runs`.
        """
        title = f"{', '.join(names)} never overlap"
        self._wait_for_runs(topic, names, runs, title, within, hint)
        most = self.concurrency(topic).overlap(names)
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
        """Whether they were under way at once."""
        if self.itself:
            return all(found.overlap([name]) >= self.at_least for name in self.names)
        if self.others:
            return found.crossed(self.names, self.others)
        return found.distinct_overlap(self.names) >= self.at_least

    def most(self, found: Concurrency) -> int:
        """How many of them were under way at once."""
        if self.itself:
            return max(found.overlap([name]) for name in self.names)
        return found.distinct_overlap([*self.names, *self.others])

    def apart(self, most: int) -> str:
        """What is said of them if they were not."""
        if self.others:
            return f"None of {', '.join(self.names)} ran beside one of {', '.join(self.others)}."
        return f"There were never more than {most} at once."


def refuse_names(names: Sequence[str], may_be_empty: bool = False) -> None:
    """Refuse a text where a list of names belongs: its letters would pass for names."""
    if isinstance(names, str) or not (names or may_be_empty):
        raise Misuse(f'{names!r} is no list of callbacks\' names; write ["NAME", …].')
