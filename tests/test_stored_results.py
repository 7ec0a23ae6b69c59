"""A stored result is taken where running again could say nothing new, and only there."""

from __future__ import annotations

import os

import pytest

from autograder.grading.stage_a import Settings


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core cannot become fewer")
def test_as_many_run_at_once_as_the_cores_that_may_be_used_carry() -> None:
    usable = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(usable)})
    try:
        assert Settings().parallel == 5
    finally:
        os.sched_setaffinity(0, usable)
