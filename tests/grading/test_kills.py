"""One of the trials of tests/support/kill_anything.py, which makes as many as one likes."""

from __future__ import annotations

from pathlib import Path

import kill_anything


def test_a_command_that_is_killed_loses_nothing_and_leaves_nothing(tmp_path: Path) -> None:
    trials = kill_anything.Trials(tmp_path, seed=6)
    told = trials.run(1)
    assert told.startswith("after")
