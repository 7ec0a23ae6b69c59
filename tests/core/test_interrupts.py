"""Interrupts of a notebook's cell: they wait while the kit works, and none is forgotten."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from autograder.core.interrupts import CellInterrupts, Interrupted


@pytest.fixture
def cell() -> Iterator[tuple[CellInterrupts, dict[str, Any]]]:
    """The interrupts of a cell, and its variables, with `work`, a function of the kit that is interrupted."""
    assert threading.current_thread() is threading.main_thread()
    kit: dict[str, Any] = {"__name__": "autograder.some.module", "signal": signal}
    exec("def work():\n    signal.raise_signal(signal.SIGINT)\n    return 'whole'", kit)
    variables = {"work": kit["work"], "time": time}
    interrupts = CellInterrupts(variables)
    yield interrupts, variables
    interrupts.close()


def test_an_interrupt_waits_for_the_kit_and_is_raised_in_the_cells_own_code(
    cell: tuple[CellInterrupts, dict[str, Any]],
) -> None:
    _, variables = cell
    with pytest.raises(KeyboardInterrupt):
        exec("done = work()\nlatest = time.monotonic() + 60\nwhile time.monotonic() < latest: pass", variables)
    assert variables["done"] == "whole"


def test_an_interrupt_is_raised_at_a_safe_place_with_the_cells_sentence(
    cell: tuple[CellInterrupts, dict[str, Any]],
) -> None:
    interrupts, variables = cell
    interrupts.sentence = "The check was interrupted."
    assert variables["work"]() == "whole"
    with pytest.raises(Interrupted, match="The check was interrupted"):
        interrupts.raise_waiting()
    interrupts.raise_waiting()  # it is raised once
