"""A rate is what the publisher did: neither what was lost on the way nor what a busy machine held up is another one."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from autograder.checks.expect.rates import at_rate, in_words, too_slow
from autograder.graph.recording import Received


def received(stamps: Sequence[float], lost: Sequence[int] = ()) -> list[Received]:
    """Messages published at these moments; those with a number in `lost` did not arrive."""
    return [Received(None, at, at, number) for number, at in enumerate(stamps, 1) if number not in lost]


STEADY = [0.05 * n for n in range(10)]
"""Twenty a second."""


@pytest.mark.parametrize(
    "messages",
    [
        received(STEADY),
        received(STEADY, lost=[2, 3, 5, 6, 8, 9]),
        received([*STEADY[:4], 0.195, *STEADY[4:]]),
        received([at + (0.03 if n in (2, 6) else 0.0) for n, at in enumerate(STEADY)]),
    ],
    ids=["as it should be", "most were lost", "one twice", "two held up"],
)
def test_messages_at_their_rate(messages: list[Received]) -> None:
    assert at_rate(messages, 20, 0.2)


@pytest.mark.parametrize(
    ("messages", "said"),
    [
        (received([0.1 * n for n in range(10)]), "10.0 Hz"),
        (received([0.04 * n for n in range(10)]), "25.0 Hz"),
        (received([at for n in range(5) for at in (0.05 * n, 0.05 * n + 0.001)]), "close together"),
        (received([at for n in range(5) for at in (0.05 * n, 0.05 * n + 0.001)][1:]), "close together"),
        (received([0.0] * 10), "all at once"),
    ],
    ids=["too slow", "too fast", "two timers", "two timers, an odd number of gaps", "a burst"],
)
def test_messages_at_another_rate(messages: list[Received], said: str) -> None:
    assert not at_rate(messages, 20, 0.2)
    assert said in in_words(messages)


def test_messages_chosen_by_what_they_say_are_not_lost_in_between() -> None:
    every_other = received(STEADY, lost=[2, 4, 6, 8, 10])
    assert not at_rate(every_other, 20, 0.2, every=False)
    assert too_slow(every_other, 20, every=False) and not too_slow(every_other, 20)
