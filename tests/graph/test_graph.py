"""The parts that the expectations stand on: names, QoS, overlaps, parameter values on a command line, deadlines."""

from __future__ import annotations

import os
import runpy
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rclpy
from hypothesis import given, settings
from hypothesis import strategies as st
from places import ROOT
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.qos import (
    QoSCompatibility,
    QoSDurabilityPolicy,
    QoSLivelinessPolicy,
    QoSProfile,
    QoSReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.serialization import serialize_message
from rmw_dds_common.msg import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo
from std_msgs.msg import Int64

from autograder.checks.concurrency import Concurrency
from autograder.checks.program import Program
from autograder.core import cpu_use
from autograder.core.cpu_use import CpuUse, CpuWait, Withheld, cpu_uses, kept_waiting, stolen
from autograder.core.errors import KitError
from autograder.graph.domains import claim_domain
from autograder.graph.names import nearest
from autograder.graph.observer import Observer
from autograder.graph.patience import Patience
from autograder.graph.publishing import Stream
from autograder.graph.qos import first_mismatch
from autograder.graph.recording import Received
from autograder.sandbox.environment import profile_environment


def profiles() -> st.SearchStrategy[QoSProfile]:
    periods = st.sampled_from([None, 0.1, 0.2])

    def build(
        reliability: int, durability: int, liveliness: int, deadline: float | None, lease: float | None
    ) -> QoSProfile:
        profile = QoSProfile(depth=1, reliability=reliability, durability=durability, liveliness=liveliness)
        if deadline:
            profile.deadline = Duration(seconds=deadline)
        if lease:
            profile.liveliness_lease_duration = Duration(seconds=lease)
        return profile

    return st.builds(
        build,
        st.sampled_from([QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT]),
        st.sampled_from([QoSDurabilityPolicy.VOLATILE, QoSDurabilityPolicy.TRANSIENT_LOCAL]),
        st.sampled_from([QoSLivelinessPolicy.AUTOMATIC, QoSLivelinessPolicy.MANUAL_BY_TOPIC]),
        periods,
        periods,
    )


@given(profiles(), profiles())
def test_the_mismatch_named_is_one_that_the_middleware_sees_too(offered: QoSProfile, requested: QoSProfile) -> None:
    compatible, reason = qos_check_compatible(offered, requested)
    mismatch = first_mismatch(offered, requested)
    assert (mismatch is None) == (compatible != QoSCompatibility.ERROR), reason


def received(events: Sequence[str]) -> list[Received]:
    return [Received(SimpleNamespace(data=text), 0.0, float(i), i) for i, text in enumerate(events)]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 50), st.integers(1, 20)), max_size=12))
def test_overlap_counts_the_runs_that_are_under_way_together(runs: list[tuple[str, int, int]]) -> None:
    # Ends before begins at the same moment: runs that only touch do not overlap.
    events = sorted(
        [(start, 1, f"{name} begin") for name, start, _ in runs]
        + [(start + length, 0, f"{name} end") for name, start, length in runs]
    )
    activity = Concurrency(received([text for _, _, text in events]))
    most = max((sum(s <= t < s + n for _, s, n in runs) for t in range(80)), default=0)
    assert activity.overlap("abc") == most
    assert activity.distinct_overlap("abc") == max(
        (len({name for name, s, n in runs if s <= t < s + n}) for t in range(80)), default=0
    )
    assert sum(activity.runs(name) for name in "abc") == len(runs)


def test_the_order_of_publication_decides_not_the_order_of_arrival() -> None:
    messages = received(["a begin", "a end", "b begin", "b end"])
    assert Concurrency([messages[i] for i in (0, 2, 1, 3)]).overlap("ab") == 1


@pytest.mark.parametrize(
    ("wanted", "names", "meant"),
    [
        ("/rear/camera", ["/camera", "/talker"], "/camera"),
        ("/talker", ["/talkr", "/listener"], "/talkr"),
        ("/talker", ["/xyz"], None),
        ("/talker", [], None),
    ],
)
def test_the_nearest_name_is_the_one_that_was_meant(wanted: str, names: list[str], meant: str | None) -> None:
    assert nearest(wanted, names) == meant


@settings(max_examples=60, deadline=None)
@given(
    st.one_of(
        st.booleans(),
        st.integers(-(2**40), 2**40),
        # ROS reads a number too small for all its digits, such as 1.0e-310, as a string.
        st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False),
        st.text(st.characters(codec="ascii", categories=("L", "N", "P", "S", "Zs")), max_size=12),
    )
)
def test_a_parameter_keeps_its_type_on_the_command_line(value: bool | int | float | str) -> None:
    context, domain = Context(), claim_domain()
    rclpy.init(args=Program("talker", parameters={"p": value}).arguments(), context=context, domain_id=domain.id)
    try:
        node = rclpy.create_node("talker", context=context, automatically_declare_parameters_from_overrides=True)
        read = node.get_parameter("p").value
        node.destroy_node()
    finally:
        context.try_shutdown()
        domain.release()
    assert type(read) is type(value)
    assert read == value


@pytest.fixture
def observer() -> Iterator[Observer]:
    os.environ.update(profile_environment())
    domain = claim_domain()
    watching = Observer(domain.id, left=domain.release)
    yield watching
    watching.close()


ON_ONE_CPU = f"import os, time\nos.sched_setaffinity(0, {{{min(os.sched_getaffinity(0))}}})\n"
COMPUTES = "while True: pass"
WORKS_NOW_AND_THEN = """
while True:
    end = time.thread_time() + 0.2
    while time.thread_time() < end: pass
    time.sleep(0.4)
"""


@pytest.fixture
def programs() -> Iterator[Callable[[str], int]]:
    """Starts a program of this process's own that keeps to the one CPU, and gives its process id."""
    started: list[subprocess.Popen[bytes]] = []

    def start(source: str) -> int:
        started.append(subprocess.Popen([sys.executable, "-c", ON_ONE_CPU + source]))
        return started[-1].pid

    yield start
    for program in started:
        program.kill()
        program.wait()


@pytest.fixture
def crowded_cpu() -> Iterator[None]:
    """Two programs of strangers that compute on the one CPU: nothing of this process's, since who began them ended."""
    leave = "if os.fork(): os._exit(0)\nos.setsid()\nprint(os.getpid(), flush=True)\nos.close(1)\n"
    command = [sys.executable, "-c", ON_ONE_CPU + leave + COMPUTES]
    strangers = [int(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout) for _ in range(2)]
    yield
    for stranger in strangers:
        os.kill(stranger, signal.SIGKILL)


@pytest.mark.usefixtures("crowded_cpu")
def test_time_in_which_a_program_got_no_cpu_does_not_count_against_it(
    observer: Observer, programs: Callable[[str], int]
) -> None:
    programs(WORKS_NOW_AND_THEN)
    patience, took, deadline = observer.patience.left, 0.0, time.monotonic() + 60
    while took <= 2.2 and time.monotonic() < deadline:  # until the strangers kept it from working meanwhile
        began = time.monotonic()
        assert not observer.wait(lambda: False, within=2.0)
        took = time.monotonic() - began
    assert took > 2.2
    assert observer.patience.left < patience
    observer.patience.left = 0.0
    began = time.monotonic()
    assert not observer.wait(lambda: False, within=2.0)
    assert observer.patience.left <= 0.0


@pytest.mark.usefixtures("crowded_cpu")
def test_a_program_that_waits_for_a_cpu_has_waited_as_long_as_strangers_ran(programs: Callable[[str], int]) -> None:
    programs(WORKS_NOW_AND_THEN)
    before = cpu_uses()
    deadline = time.monotonic() + 60
    while (kept := sum(kept_waiting(before, cpu_uses()).values())) < 0.5 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert kept >= 0.5


def had(seconds: float, *threads: tuple[float, float]) -> CpuUse:
    """What a process of that age has had: of each of its threads for how long it ran, and how long it waited to."""
    waits = {number: CpuWait(seconds, used, waited, 1, ready=False) for number, (used, waited) in enumerate(threads)}
    return CpuUse(sum(used for used, _ in threads), seconds, waits)


NOTHING_YET = {1: had(0.0, (0.0, 0.0)), 2: had(0.0, (0.0, 0.0), (0.0, 0.0))}
HOG, NODE = 1, 2


def test_a_program_that_only_computes_gains_no_time_by_it() -> None:
    threads = [(2.5, 7.5)] * 4  # of one CPU, which they share
    assert kept_waiting({}, {HOG: had(10.0, *threads)})[HOG] == 0.0
    quota = {HOG: had(10.0, (2.5, 7.5)), NODE: had(10.0, (0.1, 2.5), (0.0, 0.0))}  # a quarter of a CPU, all used up
    assert kept_waiting(NOTHING_YET, quota, share=0.25) == {HOG: 0.0, NODE: 0.0}


def test_a_thread_that_runs_without_a_break_has_not_waited() -> None:
    before = {NODE: CpuUse(1.0, 10.0, {1: CpuWait(10.0, 1.0, 0.0, 5, ready=True)})}
    after = {NODE: CpuUse(2.0, 11.0, {1: CpuWait(11.0, 2.0, 0.0, 5, ready=True)})}
    assert kept_waiting(before, after) == {NODE: 0.0}


def test_one_long_wait_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel says how long it was when it is over; up to then the clock does."""
    looks = [(0.0, 0.0, 1), (1.0, 0.0, 1), (2.0, 0.0, 1), (3.0, 3.0, 2)]  # when, and what the kernel counts by then
    clock = iter([100.0, 101.0, 102.0, 103.0])
    seen = iter(
        {NODE: CpuUse(0.0, 10.0, {1: CpuWait(when, 0.0, waited, turns, ready=True)})} for when, waited, turns in looks
    )
    monkeypatch.setattr(cpu_use.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(cpu_use, "cpu_uses", lambda: next(seen))
    withheld = Withheld()
    for _ in looks:
        withheld.measure()
    assert withheld.from_one(100.0) == pytest.approx(3.0)


def held_up(monkeypatch: pytest.MonkeyPatch, *waited: float) -> Withheld:
    """Return what is measured if a node has waited for so many seconds by the end of each second."""
    clock = iter([100.0 + second for second in range(len(waited) + 1)])
    seen = iter([{NODE: had(9.0, (0.0, 0.0))}, *({NODE: had(10.0, (0.0, seconds))} for seconds in waited)])
    monkeypatch.setattr(cpu_use.time, "monotonic", lambda: next(clock, 100.0 + len(waited)))
    monkeypatch.setattr(cpu_use, "cpu_uses", lambda: next(seen))
    monkeypatch.setattr(cpu_use, "stolen", lambda _: [])
    withheld = Withheld()
    for _ in range(len(waited) + 1):
        withheld.measure()
    return withheld


@pytest.mark.parametrize(
    ("waited", "longest"),
    [
        ((0.1, 0.2, 0.4, 0.5), 0.0),  # now and then
        ((0.0, 0.8, 0.8), 0.8),
        ((0.0, 0.4, 1.3, 1.3), 1.3),  # from the middle of a second to the end of the next
        ((0.9, 0.9, 0.9, 0.9, 1.8), 0.9),  # twice, and not in a row
    ],
)
def test_a_hold_up_is_what_was_lost_in_a_row(
    waited: tuple[float, ...], longest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert held_up(monkeypatch, *waited).longest() == pytest.approx(longest)


@pytest.mark.parametrize(("alone", "lacked"), [(False, 1.3), (True, 0.0)])
def test_a_failure_after_a_hold_up_is_looked_at_again_whatever_passed_between(
    alone: bool, lacked: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    patience = Patience(alone)
    patience.withheld = held_up(monkeypatch, 0.0, 0.4, 1.3, *[1.3] * 20)
    monkeypatch.setattr(patience.withheld, "measure", lambda *_: None)
    patience.passed()
    assert patience.decided() == pytest.approx(lacked)
    patience.is_sure()
    assert patience.decided() == 0.0


def by_a_host(stat: Path, monkeypatch: pytest.MonkeyPatch, used: float, taken: tuple[float, float]) -> Withheld:
    """Return what is measured in a second in which a program ran for `used` s and a host took that much of two CPUs."""
    clock, seen = iter([100.0, 101.0]), iter([{NODE: had(10.0, (5.0, 0.0))}, {NODE: had(11.0, (5.0 + used, 0.0))}])
    monkeypatch.setattr(cpu_use.time, "monotonic", lambda: next(clock, 101.0))
    monkeypatch.setattr(cpu_use, "cpu_uses", lambda: next(seen))
    withheld = Withheld(str(stat))
    for first, second in ((0.0, 0.0), taken):
        ticks = [round(seconds * os.sysconf("SC_CLK_TCK")) for seconds in (first + second, 30 + first, 40 + second)]
        stat.write_text(
            "".join(
                f"{cpu} 9 0 9 99 1 0 2 {stolen} 0 0\n"
                for cpu, stolen in zip(("cpu", "cpu0", "cpu1"), ticks, strict=True)
            )
            + "intr 5 0 7\n"
        )
        withheld.measure()
    return withheld


def test_what_a_host_takes_from_its_machine_is_withheld(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No program runs meanwhile, and the kernel of the machine counts this for none of them."""
    withheld = by_a_host(tmp_path / "stat", monkeypatch, used=0.1, taken=(0.2, 0.5))
    assert withheld.from_one(100.0) == pytest.approx(0.4)
    assert withheld.from_all(100.0) == pytest.approx(0.6)
    assert withheld.from_one(100.5) == pytest.approx(0.2)


def test_a_program_that_only_computes_gains_nothing_by_what_its_host_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    withheld = by_a_host(tmp_path / "stat", monkeypatch, used=0.6, taken=(0.4, 0.0))
    assert withheld.from_one(100.0) == withheld.from_all(100.0) == 0.0


def test_a_machine_that_does_not_count_what_its_host_takes_lacks_nothing(tmp_path: Path) -> None:
    (tmp_path / "short").write_text("cpu 1 2 3\ncpu0 1 2 3\n")
    assert stolen(str(tmp_path / "short")) == stolen(str(tmp_path / "missing")) == []
    assert all(seconds >= 0 for seconds in stolen())


def test_what_a_program_had_before_its_end_counts_where_it_was_used() -> None:
    """Its parent's account takes in all of it at once when it ends."""
    before = {HOG: had(10.0, (9.0, 0.0)), NODE: had(10.0, (0.1, 0.0))}
    crowded = {NODE: replace(had(11.0, (0.1, 0.8)), children=9.0)}
    assert kept_waiting(before, crowded)[NODE] == pytest.approx(0.8)
    forks = {**before, NODE: replace(had(11.0, (0.1, 0.8)), children=1.0)}  # of its own that lived for a moment
    assert kept_waiting(before, forks)[NODE] == 0.0


def test_what_others_took_was_withheld_from_who_computes_too() -> None:
    crowded = {HOG: had(10.0, (1.0, 9.0)), NODE: had(10.0, (0.1, 4.0), (0.0, 0.2))}  # ten share the one CPU
    kept = kept_waiting(NOTHING_YET, crowded)
    assert kept[HOG] == pytest.approx(8.9) and kept[NODE] == pytest.approx(3.0)


def test_what_a_quota_withholds_from_who_rests_now_and_then_is_withheld() -> None:
    after = {NODE: had(10.0, (0.4, 1.2), (0.1, 0.3))}
    assert kept_waiting(NOTHING_YET, after, share=0.25)[NODE] == pytest.approx(1.1)


def test_a_wait_that_lacks_its_time_is_told_and_one_that_had_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    patience, now = Patience(), time.monotonic()
    monkeypatch.setattr(patience, "kept", lambda when: 7.0)
    patience.waited(began=now - 6.0, within=2.0, came=False)
    assert 0 < patience.decided() <= 3.0
    patience.waited(began=now - 10.0, within=2.0, came=False)
    monkeypatch.setattr(patience, "kept", lambda when: 0.0)
    assert patience.decided() == 0.0


@pytest.mark.parametrize(
    ("gap", "kept", "lacks"),
    [
        (0.196, 4.8, True),  # a loop with 0.1 s of sleep, at a quarter of a CPU
        (0.2, 0.1, False),  # a loop with 0.2 s of sleep, on a quiet machine
        (0.3, 3.0, False),  # a loop with 0.3 s of sleep, on a busy one
        (0.126, 0.1, False),  # hardly too slow, on a quiet machine
        (0.1, 4.8, False),  # as it should be
    ],
)
def test_a_pace_lacks_its_time_if_it_would_be_right_without_what_was_withheld(
    monkeypatch: pytest.MonkeyPatch, gap: float, kept: float, lacks: bool
) -> None:
    patience, began = Patience(alone=True), time.monotonic() - 10.0
    monkeypatch.setattr(patience, "kept", lambda when: kept if when == began else 0.0)
    patience.was_slow(began, gap, 0.125)
    assert (patience.decided() > 0) == lacks
    assert patience.decided() == 0.0


@pytest.fixture
def talking(observer: Observer) -> Iterator[Observer]:
    """An observer in whose domain somebody publishes numbers all the time."""
    context = Context()
    rclpy.init(context=context, domain_id=observer.domain_id)
    node = rclpy.create_node("talker", context=context)
    publisher = node.create_publisher(Int64, "/numbers", 10)
    over = threading.Event()

    def talk() -> None:
        while not over.wait(0.01):
            publisher.publish(Int64(data=1))

    thread = threading.Thread(target=talk)
    thread.start()
    yield observer
    over.set()
    thread.join()
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def test_a_message_that_comes_while_a_subscription_is_made_does_not_deafen_the_observer(
    talking: Observer, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, came = talking.node.create_subscription, threading.Event()

    def make_slowly(msg_type: type, topic: str, take: Callable[..., None], *rest: Any, **more: Any) -> object:
        def taken(message: bytes, info: dict[str, int]) -> None:
            try:
                take(message, info)
            finally:
                came.set()

        made = make(msg_type, topic, taken, *rest, **more)
        assert came.wait(30)  # the observer's own thread is quicker than this one
        return made

    monkeypatch.setattr(talking.node, "create_subscription", make_slowly)
    assert talking.record("/numbers", Int64).wait_for(20, within=30)


def test_a_stream_that_is_stopped_just_when_it_is_due_does_not_deafen_the_observer(
    talking: Observer, monkeypatch: pytest.MonkeyPatch
) -> None:
    take, due, stopped = talking._executor._take_timer, threading.Event(), threading.Event()

    def take_slowly(timer: object) -> object:
        due.set()
        assert stopped.wait(30)  # the thread that stops the stream is quicker than the observer's own
        return take(timer)

    monkeypatch.setattr(talking._executor, "_take_timer", take_slowly)
    stream = Stream(talking, "/sent", Int64(), 100.0, QoSProfile(depth=1), lambda heard: None)
    stream.start()
    assert due.wait(30)
    stream.stop()
    stopped.set()
    assert talking.record("/numbers", Int64).wait_for(20, within=30)


def test_an_observer_that_hears_nothing_any_more_says_so(talking: Observer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(talking.record("/numbers", Int64), "_keep", lambda *_: 1 / 0)
    with pytest.raises(KitError, match="hears nothing any more: ZeroDivisionError"):
        talking.wait(lambda: False, 30)


def test_an_observer_whose_executor_sleeps_on_after_its_context_was_shut_down_says_so(talking: Observer) -> None:
    """As when rclpy wakes the executor at Ctrl-C just before it shuts the context down, and it waits again."""
    talking.node.context.handle.shutdown()  # only rcl's part, which wakes nobody
    with pytest.raises(KitError, match=r"hears nothing any more: RuntimeError.'its ROS context was shut down'"):
        talking.wait(lambda: False, 30)


def test_an_observer_that_is_shut_down_with_all_of_rclpy_says_so() -> None:
    """As by an interrupt once somebody has called rclpy.init() in a cell: from then on rclpy takes the signals."""
    script = """
import contextlib, os, signal, time
import rclpy
from autograder.core.errors import KitError
from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
domain = claim_domain()
observer = Observer(domain.id, left=domain.release)
rclpy.init()
with contextlib.suppress(KeyboardInterrupt):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
try:
    observer.wait(lambda: False, 30)
except KitError as error:
    print(error.what)
observer.close()
"""
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=180, check=False)
    assert "The observer hears nothing any more: RuntimeError('its ROS context was shut down')." in said.stdout, said


def test_a_node_that_the_middleware_lists_although_its_process_has_left_is_not_on_the_graph(observer: Observer) -> None:
    """What is told of a participant that DDS has already removed is made here by hand: the race is rare."""
    contexts = [Context(), Context()]
    for context in contexts:
        rclpy.init(context=context, domain_id=observer.domain_id)
    node, second = [rclpy.create_node("talker", context=context) for context in contexts]
    forge = runpy.run_path(str(ROOT / "tests" / "attacks" / "graded" / "_rmw.py"))["publisher"]
    tell = forge(node, b"ros_discovery_info", "rmw_dds_common", "ParticipantEntitiesInfo")
    late = ParticipantEntitiesInfo(gid=Gid(data=[0] * 15 + [1]))
    late.node_entities_info_seq = [NodeEntitiesInfo(node_namespace="/", node_name=name) for name in ("talker", "left")]
    assert observer.wait(lambda: observer.nodes() == ["/talker", "/talker"], 20)

    def listed() -> bool:
        tell(serialize_message(late))
        names = [name for name, _ in observer.node.get_node_names_and_namespaces()]
        return names.count("talker") == 3 and "left" in names

    assert observer.wait(listed, 20)
    assert observer.nodes() == ["/talker", "/talker"]
    second.destroy_node()
    assert observer.wait(lambda: observer.nodes() == ["/talker"], 20)
    node.destroy_node()
    assert observer.wait(lambda: observer.nodes() == [], 20)
    for context in contexts:
        context.shutdown()


def test_one_of_two_nodes_of_one_name_in_one_process_stays_on_the_graph_when_the_other_is_destroyed(
    observer: Observer,
) -> None:
    context = Context()
    rclpy.init(context=context, domain_id=observer.domain_id)
    nodes = [rclpy.create_node("talker", context=context) for _ in range(2)]
    assert observer.wait(lambda: observer.nodes() == ["/talker", "/talker"], 20)
    nodes[1].destroy_node()
    assert observer.wait(lambda: observer.nodes() == ["/talker"], 20)
    nodes[0].destroy_node()
    assert observer.wait(lambda: observer.nodes() == [], 20)
    context.shutdown()
