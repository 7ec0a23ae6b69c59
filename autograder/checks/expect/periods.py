"""Expectations of callbacks that publish their begins and ends: how often they begin."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from autograder import diagnosis
from autograder.checks.expect.concurrency import ConcurrencyExpectations, refuse_names
from autograder.checks.expect.expectations import WITHIN
from autograder.checks.misuse import Misuse
from autograder.reasons import Group, Kind

PERIOD = Kind(
    "period", "the time from one begin of a callback to the next is not the asked one", Group.MESSAGES, "timeline"
)


class PeriodExpectations(ConcurrencyExpectations):
    """How often callbacks begin."""

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
            runs: gaps between two begins of each, 3 at least; three times as many decide against it.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_period("/activity", ["tick"], 0.1)`

        Codes:
            `period`, and those of `expect_runs`.
        """
        refuse_names(names)
        if runs < 3:
            raise Misuse(f"runs={runs}: one callback that begins late would decide about the median of so few gaps.")
        title = f"{', '.join(names)} run{'s' if len(names) == 1 else ', each'} every {period:g} s"

        def decided() -> bool:
            off = self._off_period(topic, names, period, tolerance, runs)
            long_off = any(len(gaps) >= 3 * runs for gaps in off.values())
            return not off or long_off or self._starves(topic, names, runs)

        self.wait(decided, within)
        late = self._off_period(topic, names, period, tolerance, runs)
        if late and all(len(gaps) < runs for gaps in late.values()):
            self._wait_for_runs(topic, names, runs + 1, title, 0.0, hint)  # so many gaps lie between one run more
        told = ", ".join(f"{name} every {statistics.median(gaps):.2f} s" for name, gaps in late.items() if gaps)
        self._sure_if(all(gaps and statistics.median(gaps) < period for gaps in late.values()))
        self._expect_that(
            not late,
            title,
            lambda: PERIOD(
                f"From begin to begin it was: {told}. {diagnosis.paces(self._scene(), topic)}".rstrip(),
            ),
            expected=f"{period:g} s within {tolerance:.0%}",
            observed=told,
            hint=hint,
        )

    def _off_period(
        self, topic: str, names: Sequence[str], period: float, tolerance: float, least: int
    ) -> dict[str, list[float]]:
        """The gaps between the begins of each callback that has fewer than `least`, or another median."""
        gaps = {name: self.concurrency(topic).gaps(name) for name in names}
        return {
            name: found
            for name, found in gaps.items()
            if len(found) < least or abs(statistics.median(found) - period) > tolerance * period
        }
