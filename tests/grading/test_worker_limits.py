"""What a submission can make the grading worker take in, keep and say is limited, and fails its own check alone."""

from __future__ import annotations

import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
import pytest

from autograder.checks.outcomes import TEXT_KEPT
from autograder.core.results import Isolation, NodeLog
from autograder.grading import supervisor, worker
from autograder.grading.job import CELL_SECONDS, Cell, Job
from autograder.grading.supervisor import run_in_worker, run_in_workers
from autograder.grading.trusted_result import lacks_a_result
from autograder.sandbox.isolation import preflight

PASS = "from autograder.checks import outcomes\nfrom autograder.checks.scoring import score\n"


def job(*sources: str, files: dict[str, str] | None = None) -> Job:
    cells = [Cell(grade_id=f"check{number}", points=1.0, source=PASS + text) for number, text in enumerate(sources)]
    what = {"files": files or {}, "cells": cells, "problems": []}
    return Job(student="ann", lab="toy", digest="0", isolation=Isolation.NONE, seed=1, **what)


def test_a_check_that_takes_all_memory_is_undecided_and_the_next_is_not() -> None:
    result = run_in_worker(
        job(
            "hoard = []\nwhile True:\n    hoard.append(bytearray(1 << 26))",
            "outcomes.passed('it goes on')\nscore(1)",
        )
    )
    assert [check.points for check in result.checks] == [None, 1.0]
    assert "MemoryError" in result.checks[0].outcomes[-1].because


def test_a_text_that_explodes_is_cut_and_costs_no_other_check() -> None:
    result = run_in_worker(
        job(
            "outcomes.passed('long', observed='x' * 200_000_000)\nscore(1)",
            "for _ in range(10_000): outcomes.passed('many', observed='y' * 1000)\nscore(1)",
            "outcomes.passed('it goes on')\nscore(1)",
        )
    )
    assert [check.points for check in result.checks] == [1.0, 1.0, 1.0]
    assert len(result.checks[0].outcomes[0].observed) < 2 * TEXT_KEPT
    assert len(result.checks[1].outcomes) == worker.OUTCOMES_KEPT


FILLS = """
import mmap
for number in range(2):
    file = open(f"/dev/shm/{number}", "w+b")
    file.truncate(12 << 20)
    mapped = mmap.mmap(file.fileno(), 12 << 20)
    for page in range(0, 12 << 20, 4096):
        mapped[page] = 1
"""


@pytest.mark.skipif(not preflight().full, reason="without full isolation /dev/shm is the machine's")
def test_a_program_that_maps_more_than_there_is_room_for_is_told_the_limit() -> None:
    check = 'from autograder.checks import launch\nwith launch("fills") as ros:\n'
    check += '    ros.program("fills").expect_exit(status=0)\n'
    given = job(check + "score(1)", files={"fills.py": FILLS}).model_copy(update={"isolation": Isolation.FULL})
    (result,) = run_in_worker(given).checks
    assert result.points == 0 and result.first_failure is not None
    assert "signal 7 (SIGBUS)" in result.first_failure.because and "16 MiB" in result.first_failure.because


def test_a_check_that_never_ends_is_ended() -> None:
    error, value = worker._run_cell(Cell(grade_id="slow", points=1.0, source="while True: pass"), 0, {}, 0.2)
    assert "TimeoutError" in error and value is None
    assert worker._run_cell(Cell(grade_id="next", points=1.0, source="1 + 1"), 1, {}, 60.0) == ("", 2)


IN_A_CALL_FOR_EVER = """
import ctypes, sys
sys.modules["__main__"].CELL_SECONDS = sys.modules["__main__"].STUCK_SECONDS = 3
"""
LOCKS_TWICE = """
lock, libc = ctypes.create_string_buffer(64), ctypes.PyDLL(None)
libc.pthread_mutex_lock(lock)
libc.pthread_mutex_lock(lock)
"""


def test_a_check_that_gets_stuck_below_python_costs_no_other_check_and_is_not_tried_again(tmp_path: Path) -> None:
    seen = tmp_path / "seen"
    once = f"open({str(seen)!r}, 'a').write('{{}}')\n"
    given = job(
        # From the next check on little time is given, and to the one after it, which another worker runs, again much.
        once.format("a") + IN_A_CALL_FOR_EVER + "outcomes.passed('before')\nscore(1)",
        once.format("b") + LOCKS_TWICE,
        once.format("c") + "outcomes.passed('after')\nscore(1)",
    )
    result = run_in_worker(given)
    assert [check.points for check in result.checks] == [1.0, None, 1.0]
    assert seen.read_text() == "abc"
    stuck = result.checks[1]
    assert stuck.outcomes[0].code == supervisor.STUCK.code
    assert "<check 1 check1>" in stuck.outcomes[0].observed
    assert stuck.flags


def test_a_submission_that_gets_every_check_stuck_is_given_up(tmp_path: Path) -> None:
    given = job(*[f"open({str(tmp_path / 'seen')!r}, 'a').write('x')\n" + LOCKS_TWICE] * 4)
    given.cells.insert(0, Cell(grade_id="set_up", source=IN_A_CALL_FOR_EVER))
    result = run_in_worker(given)
    assert [check.points for check in result.checks] == [None] * 4
    assert {check.outcomes[0].code for check in result.checks} == {supervisor.STUCK.code}
    assert (tmp_path / "seen").read_text() == "x" * supervisor.LOST


@pytest.mark.parametrize(("deaths", "points"), [(1, 1.0), (2, None)])
def test_a_check_at_which_the_worker_dies_is_tried_once_more(tmp_path: Path, deaths: int, points: float | None) -> None:
    seen = tmp_path / "seen"
    seen.write_text("")
    note = f"import os\nopen({str(seen)!r}, 'a').write('x')\n"
    dies = note + f"if len(open({str(seen)!r}).read()) <= {deaths}: os._exit(1)\n"
    good = "outcomes.passed('good')\nscore(1)"
    result = run_in_worker(job(good, dies + good, good))
    assert [check.points for check in result.checks] == [1.0, points, 1.0]
    assert seen.read_text() == "xx"
    if points is None:  # a person has to look, and nothing new is found out by doing it all again
        assert result.checks[1].outcomes[0].code == supervisor.DIED.code
        assert result.checks[1].flags
    assert not lacks_a_result(result)


def test_workers_that_share_the_checks_find_what_one_finds() -> None:
    drawn = "from autograder.checks import vary\noutcomes.passed(vary.token(12))\nscore(1)"
    given = job(drawn, drawn, "outcomes.passed('x') or score(0.5)", drawn, drawn)
    alone, together = run_in_worker(given), run_in_workers(given, 3)
    assert [check.grade_id for check in together.checks] == [f"check{number}" for number in range(5)]
    assert [check.points for check in together.checks] == [1.0, 1.0, None, 1.0, 1.0]
    titles = [[check.outcomes[0].title for check in result.checks] for result in (alone, together)]
    assert titles[0] == titles[1] and len(set(titles[0])) == 5


def test_an_interrupt_that_comes_while_workers_are_begun_ends_those_that_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pool itself stands in for Ctrl-C, because when a signal comes is chance."""
    submit, begun = ThreadPoolExecutor.submit, []

    def interrupted(pool: ThreadPoolExecutor, *call: object) -> object:
        if begun:
            raise KeyboardInterrupt
        begun.append(call)
        return submit(pool, *call)  # type: ignore[arg-type]

    monkeypatch.setattr(ThreadPoolExecutor, "submit", interrupted)
    stuck = "import time\ntime.sleep(1000)  # launch(…)\nscore(1)"  # a check that launches has a worker of its own
    asked = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_in_workers(job(stuck, stuck), 2)
    assert time.monotonic() - asked < CELL_SECONDS  # after which a stuck worker is ended anyway


def test_logs_share_the_room_there_is() -> None:
    logs = [
        NodeLog(program=name, text=text, truncated=False, exit_status=0, stopped_by="")
        for name, text in (
            ("short", "a word"),
            ("long", "x" * 1_000_000),
            ("longer", "begin" + "y" * 2_000_000 + "end"),
        )
    ]
    kept = worker._within(logs, 10_000)
    assert kept[0] == logs[0]
    assert sum(len(log.text) for log in kept) < 10_100
    assert [log.truncated for log in kept] == [False, True, True]
    assert kept[2].text.startswith("begin") and kept[2].text.endswith("end")
    assert worker._within(logs[:1], 10_000) == logs[:1]


def test_a_flooded_topic_takes_at_most_half_of_an_observers_room_and_silences_no_other() -> None:
    begin = "import rclpy\nfrom std_msgs.msg import String\nrclpy.init()\n"
    flood = begin + (
        "node = rclpy.create_node('flood')\npublisher = node.create_publisher(String, '/flood', 10)\n"
        "while True:\n    publisher.publish(b'no message')\n    publisher.publish(String(data='x' * 60_000))\n"
    )
    talk = begin + (
        "node = rclpy.create_node('talk')\npublisher = node.create_publisher(String, '/talk', 10)\n"
        "node.create_timer(0.02, lambda: publisher.publish(String(data='talk')))\nrclpy.spin(node)\n"
    )
    check = (
        "from autograder.checks import launch\nfrom autograder.graph import observer\nfrom std_msgs.msg import String\n"
        "observer.RECORDED = 600_000\n"
        "with launch('flood', 'talk', listen=[('/flood', String), ('/talk', String)]) as ros:\n"
        "    record = ros._running.observer.record\n"
        "    flood, talk = record('/flood', String), record('/talk', String)\n"
        "    full = flood.wait_for(4, 60)\n"
        "    heard = talk.wait_for(talk.count + 20, 60)\n"
        "    texts = [len(one.msg.data) for one in flood.messages]\n"
        "    outcomes.passed(f'{full} {heard} {len(texts) < 6} {set(texts)}')\n"
        "score(1)"
    )
    result = run_in_worker(job(check, files={"flood.py": flood, "talk.py": talk}))
    assert result.checks[0].outcomes[0].title == "True True True {60000}", result


@pytest.mark.parametrize(("times", "points"), [(1, 1.0), (2, 0.0)])
def test_a_check_is_tried_once_more_if_a_program_of_it_is_killed(tmp_path: Path, times: int, points: float) -> None:
    victim = f"victim-{os.getpid()}"[:15]  # as much as the kernel keeps of a name
    safe = tmp_path / "safe"
    program = f"""import ctypes, os, time
ctypes.CDLL(None).prctl(15, b"{victim}", 0, 0, 0)
while not os.path.exists("{safe}"): time.sleep(0.01)
"""
    over, killed = threading.Event(), []

    def kill() -> None:
        while len(killed) < times and not over.wait(0.02):
            for process in psutil.process_iter(["name"]):
                if process.info["name"] == victim and process.pid not in killed:
                    process.kill()
                    killed.append(process.pid)
        if times == 1:
            safe.touch()

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        result = run_in_worker(
            job(
                "from autograder.checks import launch\n"
                "with launch('victim') as ros:\n"
                "    ros.program('victim').expect_exit(status=0, within=120)\nros.score(1)",
                files={"victim.py": program},
            )
        )
    finally:
        over.set()
        killer.join()
    assert len(killed) == times
    assert [check.points for check in result.checks] == [points]


ABROAD = """
import os
import rclpy
from rclpy.node import Node

times = os.path.getsize({counter!r}) if os.path.exists({counter!r}) else 0
with open({counter!r}, "a") as counter:
    counter.write("x")
rclpy.init(domain_id=(int(os.environ["ROS_DOMAIN_ID"]) + 1) % 100 if times < {times} else None)
rclpy.spin(Node("tourist"))
"""


@pytest.mark.parametrize(("times", "points"), [(1, 1.0), (2, 0.0)])
def test_a_check_is_tried_once_more_if_a_node_that_was_made_is_not_on_the_graph(
    tmp_path: Path, times: int, points: float
) -> None:
    counter = tmp_path / "starts"
    result = run_in_worker(
        job(
            "import os\nfrom autograder.checks import launch\n"
            "with launch('tourist', 'guide') as ros:\n"
            "    ros.node('/guide').expect(within=120)\n"
            "    ros.wait(lambda: all(inside.nodes for inside in ros._running.scene().insides), 120)\n"
            f"    here = lambda: os.path.getsize({str(counter)!r}) <= {times} or '/tourist' in ros.graph.nodes()\n"
            "    ros.wait(here, 120)\n"  # so that the short time below decides only where it is in another domain
            "    ros.node('/tourist').expect(within=5)\nros.score(1)",
            files={
                "tourist.py": ABROAD.format(counter=str(counter), times=times),
                "guide.py": "import rclpy\nrclpy.init()\nrclpy.spin(rclpy.create_node('guide'))\n",
            },
        )
    )
    assert counter.stat().st_size == 2
    (check,) = result.checks
    assert check.points == points
    assert points or (check.first_failure and check.first_failure.code == "not-on-graph")
