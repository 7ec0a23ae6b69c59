"""A rate is what the publisher did: neither what was lost on the way nor what a busy machine held up is another one."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autograder.checks.expect.rates import at_rate, in_time, in_words, together, too_slow
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
    assert at_rate(messages, 20, 0.2) and in_time(messages, 20, 0.2)


@pytest.mark.parametrize(
    ("messages", "said", "close"),
    [
        (received([0.1 * n for n in range(10)]), "10.0 Hz", False),
        (received([0.04 * n for n in range(10)]), "25.0 Hz", False),
        (received([at for n in range(5) for at in (0.05 * n, 0.05 * n + 0.001)]), "44.8 Hz", True),
        (received([at for n in range(5) for at in (0.05 * n, 0.05 * n + 0.001)][1:]), "40.0 Hz", True),
        (received([0.0] * 10), "all at once", False),
    ],
    ids=["too slow", "too fast", "two timers", "two timers, an odd number of gaps", "a burst"],
)
def test_messages_at_another_rate(messages: list[Received], said: str, close: bool) -> None:
    assert not at_rate(messages, 20, 0.2)
    assert (in_words(messages), together(messages)) == (said, close)


def test_messages_chosen_by_what_they_say_are_not_lost_in_between() -> None:
    every_other = received(STEADY, lost=[2, 4, 6, 8, 10])
    assert not at_rate(every_other, 20, 0.2, every=False)
    assert too_slow(every_other, 20, every=False) and not too_slow(every_other, 20)


def test_a_timer_that_is_held_up_less_and_less_long_has_no_other_rate() -> None:
    """At one hertz, held up by 0.95 s, 0.5 s and 0.0 s: half a second lies between most of the messages."""
    messages = received([1.95, 2.5, 3.0, 4.0])
    assert at_rate(messages, 2, 0.2) and not in_time(messages, 2, 0.2)
    assert too_slow(messages, 2)


@given(late=st.lists(st.floats(0, 0.999), min_size=4, max_size=7), slower=st.floats(2, 10))
def test_a_slower_timer_is_never_in_time_however_it_is_held_up(late: list[float], slower: float) -> None:
    assert not in_time(received([(n + part) * slower for n, part in enumerate(late)]), 1, 0.2)


def test_a_timer_that_is_in_time_for_a_while_is_in_time() -> None:
    assert in_time(received([0.0, 1.0, *[1.5 + at for at in STEADY[:5]]]), 20, 0.2)


def test_pauses_between_many_messages_are_no_other_rate() -> None:
    """What a callback that works holds up again and again is another sentence of the task than the rate."""
    times = [0.45 * n + at for n in range(3) for at in (0.0, 0.07, 0.14, 0.43)]
    assert in_time(received(times[:10]), 1 / 0.07, 0.2)
