"""Expectations of callbacks that publish their begins and ends: how often they begin."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from autograder import diagnosis
from autograder.checks.expect.concurrency import ConcurrencyExpectations, refuse_names
from autograder.checks.expect.expectations import WITHIN
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
            runs: gaps between two begins of each; three times as many decide against it.
            within: seconds until these must have come.
            hint: a pointer for the student.

        Example:
            `ros.expect_period("/activity", ["tick"], 0.1)`

        Codes:
            `period`, and those of `expect_runs`.
        """
        refuse_names(names)
        title = f"{', '.join(names)} run{'s' if len(names) == 1 else ', each'} every {period:g} s"

        def wrong(least: int) -> dict[str, list[float]]:
            gaps = {name: self.concurrency(topic).gaps(name) for name in names}
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
        if late and all(len(found) < runs for found in late.values()):
            self._wait_for_runs(topic, names, runs + 1, title, 0.0, hint)  # so many gaps lie between one run more
        told = ", ".join(f"{name} every {statistics.median(found):.2f} s" for name, found in late.items() if found)
        self._sure_if(all(found and statistics.median(found) < period for found in late.values()))
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
