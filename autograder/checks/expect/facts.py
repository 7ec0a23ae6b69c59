"""Facts that a check has established itself and states in its own words."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from autograder.checks import outcomes
from autograder.checks.expect.expectations import Expectations
from autograder.checks.expect.topic import CONTENT
from autograder.checks.misuse import Misuse
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
        if f"the launch argument `{name}` has no value" in told:
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
