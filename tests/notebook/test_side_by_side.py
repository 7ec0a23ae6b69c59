"""Launches that run at the same time on one machine: none hears another one's, and nothing of one outlives it."""

from __future__ import annotations

import os
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from side_by_side import run_all
from started_processes import WITHIN
from std_msgs.msg import Int64
from test_msgs.action import Fibonacci

from autograder.core.errors import KitError
from autograder.graph import domains
from autograder.graph.actions import ActionSeen
from autograder.graph.domains import LAST, Domain, claim_domain, group_of, is_free
from autograder.graph.observer import Observer
from autograder.ros2.main import TimeIsUp, run
from autograder.sandbox import environment
from autograder.sandbox.environment import GROUP, profile_environment

SOMEBODY = """
import sys
import rclpy
from std_msgs.msg import Int64

rclpy.init()
node = rclpy.create_node(sys.argv[1])
publisher = node.create_publisher(Int64, "/" + sys.argv[1], 10)
node.create_timer(0.05, lambda: publisher.publish(Int64(data=1)))
print("up", flush=True)
rclpy.spin(node)
"""

EAR = """
import sys, time
import rclpy

rclpy.init()
node = rclpy.create_node(sys.argv[1])
print("up", flush=True)
end = time.monotonic() + 120
while not {*sys.argv[2:]} <= {*node.get_node_names()} and time.monotonic() < end:
    time.sleep(0.05)
print("heard" if time.monotonic() < end else "heard nothing", flush=True)
rclpy.spin(node)
"""


@pytest.fixture(autouse=True)
def profile(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in profile_environment().items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def domain() -> Iterator[Domain]:
    claimed = claim_domain()
    yield claimed
    claimed.release()


def start(
    started: list[subprocess.Popen[str]], name: str, number: int, settings: dict[str, str], *waits_for: str
) -> subprocess.Popen[str]:
    """Start a program with a node in a domain, and wait until it has one.

    It publishes, or says when it has heard of other nodes, if it is given their names.
    """
    plain = {key: value for key, value in os.environ.items() if not key.startswith(("FASTRTPS", "ROS_", GROUP))}
    process = subprocess.Popen(
        [sys.executable, "-c", EAR if waits_for else SOMEBODY, name, *waits_for],
        env=plain | {"ROS_LOG_DIR": os.environ["ROS_LOG_DIR"]} | settings | {"ROS_DOMAIN_ID": str(number)},
        stdout=subprocess.PIPE,
        text=True,
    )
    started.append(process)
    assert process.stdout is not None and process.stdout.readline() == "up\n"
    return process


def in_time(done: Any) -> bool:
    deadline = time.monotonic() + WITHIN
    while not done() and time.monotonic() < deadline:
        time.sleep(0.05)
    return bool(done())


def heard(ear: subprocess.Popen[str]) -> bool:
    """Whether a program has heard of the nodes that it waits for."""
    assert ear.stdout is not None
    return ear.stdout.readline() == "heard\n"


def claimed_in_time(number: int) -> bool:
    """Whether a domain can be claimed; a launch of somebody else's may have it for a while."""

    def claimed() -> bool:
        claim = domains._claimed(number)
        if claim is not None:
            claim.close()
        return claim is not None

    return in_time(claimed)


# Nothing outlives it.


def test_an_observer_that_has_an_action_client_leaves_its_domain_all_the_same(domain: Domain) -> None:
    observer = Observer(domain.id)
    action = ActionSeen(observer, "/fibonacci", Fibonacci)  # as a goal that a notebook keeps in a variable
    assert not is_free(domain.id)
    observer.close()
    assert is_free(domain.id) and action.name == "/fibonacci"


def test_a_command_that_asked_an_action_leaves_its_domain(domain: Domain) -> None:
    with pytest.raises(TimeIsUp):
        run(["action", "send_goal", "/nobody", "test_msgs/action/Fibonacci", "{order: 1}"], domain.id, None, 1.0)
    assert is_free(domain.id)


def test_an_observer_that_cannot_begin_leaves_its_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: Observer) -> bytes:
        raise KitError("The observer does not find itself.")

    monkeypatch.setattr(Observer, "_own_participant", fail)
    claimed = claim_domain()
    with pytest.raises(KitError):
        Observer(claimed.id, left=claimed.release)
    assert is_free(claimed.id)
    assert claimed_in_time(claimed.id), "it is still claimed"


# Domains are claimed.


def test_a_domain_is_in_use_as_long_as_any_participant_lives_in_it(domain: Domain) -> None:
    """The first participant takes the lowest ports; when it has ended, the second keeps its own."""
    first, second = Observer(domain.id), Observer(domain.id)
    first.close()
    assert not is_free(domain.id)
    second.close()
    assert is_free(domain.id)


def test_a_program_with_settings_of_its_own_keeps_launches_out_of_its_domain(
    domain: Domain, started: list[subprocess.Popen[str]]
) -> None:
    start(started, "somebody", domain.id, {})
    assert not is_free(domain.id)


def test_no_two_launches_get_one_domain_and_what_is_given_back_is_given_again() -> None:
    claimed = [claim_domain() for _ in range(20)]
    assert len({each.id for each in claimed}) == 20
    for each in claimed:
        each.release()
    assert all(claimed_in_time(each.id) for each in claimed)


def test_the_domain_of_a_process_that_was_killed_is_given_again() -> None:
    source = (
        "from autograder.graph.domains import claim_domain; held = claim_domain(); print(held.id, flush=True); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", source], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        number = int(process.stdout.readline())
        assert domains._claimed(number) is None
        process.kill()
    assert claimed_in_time(number)


def test_where_every_domain_is_claimed_one_in_which_nobody_lives_is_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who claims them all, and be it out of malice, keeps nobody from working."""
    claims = [domains._claimed(number) for number in range(1, LAST + 1)]
    try:
        monkeypatch.setattr(domains, "is_free", lambda number: number == 42)
        assert claim_domain().id == 42
        monkeypatch.setattr(domains, "is_free", lambda _: False)
        assert 1 <= claim_domain().id <= LAST
    finally:
        for claim in claims:
            if claim is not None:
                claim.close()


# Who hears whom.


def test_launches_of_one_domain_do_not_hear_each_other_if_they_are_of_two_kernels(
    domain: Domain, started: list[subprocess.Popen[str]]
) -> None:
    """As when there are more launches than domains, or a program is started in domain 0 by two notebooks."""
    other = {**profile_environment(), GROUP: "239.1.2.3"}
    start(started, "stranger", domain.id, other)
    observer = Observer(domain.id)
    try:
        said = observer.record("/stranger", Int64)
        start(started, "own", domain.id, profile_environment())
        assert observer.wait(lambda: observer.nodes() == ["/own"], WITHIN)
        ear = start(started, "ear", domain.id, other, "stranger", "late_stranger")
        start(started, "late_stranger", domain.id, other)
        assert heard(ear)  # and so would the observer have heard of it, which hears of the next one of its own
        start(started, "late_own", domain.id, profile_environment())
        assert observer.wait(lambda: "/late_own" in observer.nodes(), WITHIN)
        assert observer.nodes() == ["/late_own", "/own"]
        assert "/stranger" not in observer.topics() and not said.messages
    finally:
        observer.close()


@pytest.mark.parametrize("reach", ["SUBNET", "LOCALHOST"])
def test_a_launch_hears_no_program_with_settings_of_its_own(
    reach: str, domain: Domain, started: list[subprocess.Popen[str]]
) -> None:
    """Such as one in a terminal, whose number a launch has claimed before."""
    observer = Observer(domain.id)
    try:
        settings = {"ROS_AUTOMATIC_DISCOVERY_RANGE": reach}
        ear = start(started, "ear", domain.id, settings, "stranger0", "stranger1")
        strangers = [start(started, f"stranger{number}", domain.id, settings) for number in range(2)]
        assert heard(ear)  # and so would the observer have heard of them, which hears of the next one of its own
        start(started, "own", domain.id, profile_environment())
        assert observer.wait(lambda: "/own" in observer.nodes(), WITHIN)
        assert observer.nodes() == ["/own"]
        assert all(stranger.poll() is None for stranger in strangers)
    finally:
        observer.close()


def test_a_terminal_finds_the_group_of_the_users_own_launch_and_of_nobody_else(
    domain: Domain, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert group_of(domain.id) is None
    observer = Observer(domain.id)
    assert group_of(domain.id) == os.environ[GROUP]
    somebody = os.getuid() + 1
    with monkeypatch.context() as as_somebody:
        as_somebody.setattr(os, "getuid", lambda: somebody)
        assert group_of(domain.id) is None
    observer.close()
    assert in_time(lambda: group_of(domain.id) is None)


# What others on the machine can see, and take away.


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(environment.tempfile, "tempdir", str(tmp_path))
    environment._log_folder.cache_clear()
    yield tmp_path / f"autograder-log-{os.getuid()}"
    environment._log_folder.cache_clear()


def test_nobody_else_reads_the_logs(temporary: Path) -> None:
    temporary.mkdir(mode=0o755)  # as an earlier version made it
    assert Path(profile_environment()["ROS_LOG_DIR"]) == temporary
    assert stat.S_IMODE(temporary.stat().st_mode) == 0o700


def test_a_folder_of_logs_that_leads_elsewhere_is_not_used(temporary: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    temporary.symlink_to(elsewhere)
    logs = Path(profile_environment()["ROS_LOG_DIR"])
    assert logs.resolve() != elsewhere and stat.S_IMODE(logs.stat().st_mode) == 0o700


def test_a_folder_of_logs_that_is_somebody_elses_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment.tempfile, "tempdir", str(tmp_path))
    somebody = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: somebody)
    theirs = tmp_path / f"autograder-log-{somebody}"
    theirs.mkdir()  # by who runs the tests, and so not by somebody
    environment._log_folder.cache_clear()
    try:
        assert Path(profile_environment()["ROS_LOG_DIR"]) != theirs
    finally:
        environment._log_folder.cache_clear()


def test_a_folder_of_logs_that_a_process_made_for_itself_goes_with_it(tmp_path: Path) -> None:
    (tmp_path / f"autograder-log-{os.getuid()}").write_text("no folder")
    look = "from autograder.sandbox.environment import profile_environment; print(profile_environment()['ROS_LOG_DIR'])"
    process = subprocess.run(
        [sys.executable, "-c", look], env=os.environ | {"TMPDIR": str(tmp_path)}, stdout=subprocess.PIPE, text=True,
        check=True,
    )  # fmt: skip
    own = Path(process.stdout.strip())
    assert own.parent == tmp_path and own.name.startswith(f"autograder-log-{os.getuid()}-")
    assert not own.exists()


def test_a_port_below_is_not_taken_for_a_participant(domain: Domain) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as neighbour:
        neighbour.bind(("127.0.0.1", 7400 + 250 * domain.id - 1))
        assert is_free(domain.id)


# In real kernels.


def test_notebooks_of_two_users_do_not_hear_each_other_even_in_one_domain() -> None:
    """As when there are more launches than domains: here the machine has one of them."""
    cells = "^(setup|expect-goals|given-fibonacci|fibonacci|check-fibonacci)$"
    for seen in run_all(["lab6_actions"], 2, 2, domains=1, only=cells, disturbed=False):
        assert (seen.foreign, seen.wrong, seen.cells) == ([], [], 5)
        assert seen.launches >= 2
