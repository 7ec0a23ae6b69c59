"""Every attack of `tests/attacks` on the node sandbox, as whoever runs the tests (root, often) and as anyone else.

A line of an attack's docstring says what must happen, and the tests hold it to that:
    Must: refused.                   It reports no escape, and ends by itself with status 0.
    Must: memory limit.              That limit ends it (likewise: process limit).
    Must: ended by signal 6.         It ends by that signal.
    Must: goes on.                   It runs until the end of the launch, which ends it.
    Must: goes on behind all others. So does this one, and all its threads have the lowest priority.
    Must, alone: …                   It runs in a launch of its own (`twice`: in two), since it would harm the others.
    Must, beside an honest node: …   The observer and an honest node beside it do not notice.
"""

from __future__ import annotations

import json
import re
import socket
from typing import Any

import pytest
from boxes import ATTACKS, RUN_STDIN, as_ordinary_user, in_sandbox
from places import TESTS

from autograder.sandbox.isolation import preflight

MUST = {
    name: re.search(r"^Must(?:, [a-z ,]+)?: (.+)\.$", source, re.MULTILINE)
    for name, source in ATTACKS.items()
    if name[0] != "_" and name != "honest"
}
BESIDE_NODE = [name for name, source in ATTACKS.items() if "Must, beside an honest node:" in source]
RUN = 1800.0
"""Seconds for all attacks together: about 40 on a quiet machine."""
TEARDOWN = 50.0
"""Seconds: far beyond what it takes on a crowded machine, and far less than what an attack would go on for."""
GROWN = 400
"""MiB that flooding may make an observer grow."""


@pytest.fixture(scope="module", params=["own user", "ordinary user"])
def report(request: pytest.FixtureRequest) -> dict[str, dict[str, Any]]:
    """What each attack came to."""
    if not preflight().full:
        pytest.skip(preflight().why_not_full)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        given = f"ATTACKS = {ATTACKS!r}\nHOST_PORT = {listener.getsockname()[1]}\n"
        driver = (TESTS / "support" / "attack_driver.py").read_text()
        source = given + driver.replace("from __future__ import annotations\n", "")
        if request.param == "own user":
            said = in_sandbox(source, RUN)
            text = said.stdout + said.stderr
        else:
            text = as_ordinary_user(
                "from autograder.core.results import Isolation\n"
                "from autograder.sandbox.grading_sandbox import run_in_sandbox\n"
                f"run = run_in_sandbox({[*RUN_STDIN]!r}, {source.encode()!r}, Isolation.FULL, {RUN})\n"
                "print(run.stdout.decode(), run.stderr)\n",
                RUN + 30,
            )
    lines = [line for line in text.splitlines() if line.startswith("REPORT")]
    assert lines, text
    found: dict[str, dict[str, Any]] = json.loads(lines[0].removeprefix("REPORT"))
    return found


def test_every_attack_says_what_must_happen() -> None:
    assert not [name for name, must in MUST.items() if must is None]
    assert len(MUST) >= 60


@pytest.mark.parametrize("name", [name for name in MUST if name not in BESIDE_NODE])
def test_attack(report: dict[str, dict[str, Any]], name: str) -> None:
    entry, must = report[name], MUST[name]
    assert must is not None
    assert "ESCAPED" not in entry["output"], entry["output"]
    if must[1] == "refused":
        assert entry["ended"] == 0, entry
    elif must[1].endswith(" limit"):
        assert entry["stopped_by"] == must[1], entry
    elif must[1].startswith("ended by signal "):
        assert entry["ended"] == -int(must[1].split()[-1]), entry
    else:
        assert must[1] in ("goes on", "goes on behind all others")
        assert entry["ended"] in (-9, -15), entry
        assert must[1] == "goes on" or entry["nice"] == [19], entry
    assert entry["after"] == "fine\n"  # the launch can still start a program
    assert entry["left"] == 0  # and its end leaves none
    assert entry["teardown"] < TEARDOWN


@pytest.mark.parametrize("name", BESIDE_NODE)
def test_attack_by_ros(report: dict[str, dict[str, Any]], name: str) -> None:
    entry = report[name]
    assert entry["heard"] and entry["own"] and entry["seen"] and entry["running"], entry
    assert entry["grown"] < GROWN, entry
