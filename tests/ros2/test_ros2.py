"""The kit's `ros2`: it prints what the real tool was measured to print, and a notebook can look at what it started."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from kernels import SET_UP, TALKER, Notebook
from places import ROOT, TESTS
from rcl_interfaces.msg import ListParametersResult
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_msgs.msg import String
from test_msgs.msg import BoundedSequences, UnboundedSequences

from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
from autograder.ros2 import session
from autograder.ros2.main import COMMANDS, TimeIsUp, run
from autograder.ros2.messages import Shape, to_csv, to_yaml
from autograder.ros2.options import to_match
from autograder.sandbox.environment import profile_environment

ROBOT = TESTS / "ros2_robot"
MEASURED = [
    tuple(re.fullmatch(r"([^\n]*)\n(.*?)exit (\d)", block.strip(), re.DOTALL).groups())  # type: ignore[union-attr]
    for block in re.split(r"^\$ ", (ROBOT / "measured.txt").read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
]
NODES = ["/demo", "/vehicle/camera_driver", "/vehicle/right_demo"]
WITHIN = 120
"""Far beyond what a start takes on a busy machine, in seconds."""
A_WHILE = (3.5, 15.0, 60.0)
"""For how long what goes on until it is ended is looked at, in seconds: for longer where a busy machine shows less."""


class Robot:
    """The three nodes, running; and an observer, such as a notebook has."""

    def __init__(self, environment: dict[str, str]) -> None:
        self.claim = claim_domain()
        self.domain = self.claim.id
        plain = {name: value for name, value in os.environ.items() if not name.startswith("FASTRTPS")}
        self.environment = {**plain, **environment, "ROS_DOMAIN_ID": str(self.domain)}
        self.process = subprocess.Popen([sys.executable, ROBOT / "robot.py"], env=self.environment)
        os.environ.update(profile_environment())
        self.observer = Observer(self.domain)

    def wait(self) -> None:
        assert self.observer.wait(lambda: self.observer.nodes() == NODES, WITHIN)

    def close(self) -> None:
        self.observer.close()
        self.process.terminate()
        self.process.wait(WITHIN)
        self.claim.release()


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    made = Robot(profile_environment())
    made.wait()
    yield made
    made.close()


def say(robot: Robot, command: str, seconds: float = WITHIN) -> tuple[str, int]:
    """What a command prints, and its exit status; one that has to be ended ends with that of Ctrl-C."""
    said = StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            status = run(shlex.split(command), robot.domain, robot.observer, seconds)
        except TimeIsUp:
            status = 2
    return said.getvalue(), status


def alike(text: str) -> str:
    """The text without what differs from run to run: counters, ids, times."""
    text = re.sub(r"hello \d+", "hello N", text)
    text = re.sub(r"GID: ([0-9a-f]{2}\.){15}[0-9a-f]{2}", "GID: …", text)
    text = re.sub(r"ID: [0-9a-f]{32}", "ID: …", text)
    return text.replace("waiting for service to become available...\n", "").strip("\n")


def lines_alike(text: str) -> list[str]:
    """The shape of each line: numbers with as many decimals as they have."""
    return [re.sub(r"\d+(\.\d+)?", lambda one: "N." + "N" * len(one[1] or "."), line) for line in text.splitlines()]


@pytest.mark.parametrize(("command", "said", "status"), MEASURED, ids=[one[0] for one in MEASURED])
def test_it_prints_what_the_real_tool_prints(
    robot: Robot, command: str, said: str, status: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if command.endswith("d.yaml"):
        Path("d.yaml").write_text(say(robot, "param dump /demo")[0])
    if status == "2":  # goes on until it is ended
        expected = [line for line in lines_alike(said) if line != "…"]
        for seconds in A_WHILE:
            found, ended = say(robot, command, seconds)
            if len(found.splitlines()) >= len(expected):
                break
        assert (lines_alike(found)[: len(expected)], ended) == (expected, 2)
        return
    found, ended = say(robot, command)
    if "…\n" in said:
        said = said.partition("…\n")[0]
        assert found.startswith(said)
    elif "Goal accepted" in said:  # which may come after the first feedback
        assert sorted(alike(found).split("\n\n")) == sorted(alike(said).split("\n\n"))
    elif command.startswith("interface package"):  # in which the real tool keeps no order
        assert sorted(found.splitlines()) == sorted(said.splitlines())
    else:
        assert alike(found) == alike(said)
    assert ended == int(status)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("topic echo /chatter --filter 'm.data >'", "Invalid filter 'm.data >'"),
        ("topic echo /chatter --filter m.nothing", "Invalid filter 'm.nothing'"),
        ("topic hz /chatter --filter m.nothing", "Invalid filter 'm.nothing'"),
        ("topic pub '/no name' std_msgs/msg/String", "no name"),
        (
            "topic pub /x test_msgs/BoundedSequences '{uint8_values: [1, 2, 3, 4]}'",
            "takes 3 elements at most, and not 4",
        ),
        ("topic pub /x test_msgs/Arrays '{uint8_values: [1]}'", "takes exactly 3 elements, and not 1"),
        ("topic pub /x test_msgs/BasicTypes '{uint8_value: x}'", "Failed to populate field"),
        ("service call /x test_msgs/Arrays '{string_values: [a]}'", "takes exactly 3 elements, and not 1"),
        ("action info 'no name'", "no name"),
        ("topic pub /x std_msgs/String '{data: \"'", "needs to be a dictionary"),
        ("service call /switch std_srvs/SetBool '{'", "Failed to populate field"),
    ],
)
def test_what_cannot_be_done_is_told_in_words(robot: Robot, command: str, told: str) -> None:
    said, status = say(robot, command)
    assert told in said and "Traceback" not in said and status == 1


def test_a_regular_expression_that_is_none_is_told(robot: Robot) -> None:
    said, status = say(robot, "param list --filter '[' /demo")
    assert status == 2 and "'[' is not a regular expression" in said


def test_values_come_on_standard_input(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    for command, given, told in (
        ("service call --stdin /switch std_srvs/SetBool", "{data: true}", "message='now True'"),
        ("topic pub --once --stdin /in std_msgs/String", "data: hello", "data='hello'"),
        ("action send_goal --stdin /fibonacci test_msgs/Fibonacci", "order: 200", "rejected"),
    ):
        monkeypatch.setattr(sys, "stdin", StringIO(given))
        said, status = say(robot, command)
        assert told in said and status == 0


def test_what_failed_stands_on_standard_error(robot: Robot) -> None:
    for command in ("param set /demo rate 99", "param delete /demo frame"):
        said, error = StringIO(), StringIO()
        with redirect_stdout(said), redirect_stderr(error):
            assert run(shlex.split(command), robot.domain, robot.observer) == 0
        assert said.getvalue() == "" and "parameter failed: " in error.getvalue()


def test_messages_are_written_as_the_real_tool_writes_them() -> None:
    """Measured with rosidl_runtime_py 0.13."""
    text, arrays, bounded = String(data="weit ü"), UnboundedSequences(), BoundedSequences()
    assert to_yaml(text) == "data: weit ü\n"
    arrays.bool_values, arrays.string_values = [True, False], ["a"]
    flow = to_yaml(arrays, flow=True).splitlines()
    assert flow[0] == "bool_values: [true, false]" and "string_values: [a]" in flow
    for names, prefixes, line in (([], ["b"], "b"), (["a"], [], "a,"), (["", "a"], ["b"], "a,b"), ([], [], "")):
        assert to_csv(ListParametersResult(names=names, prefixes=prefixes), Shape()) == line
    assert "uint8_values: '<sequence type: uint8[3], length: 0>'" in to_yaml(bounded, Shape(arrays=False))
    assert to_csv(text, Shape(strings=False)) == "<string length: <6>>"


def terminal(robot: Robot, *words: str) -> subprocess.Popen[str]:
    environment = {name: value for name, value in robot.environment.items() if not name.startswith("FASTRTPS")}
    return subprocess.Popen(
        [Path(sys.executable).with_name("autograder"), "ros2", *words],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("settings", [profile_environment(), {}], ids=["notebook", "terminal"])
def test_a_terminal_sees_programs_of_a_notebook_and_of_another_terminal(settings: dict[str, str]) -> None:
    made = Robot(settings)
    try:
        if settings:
            made.wait()
        else:  # a notebook does not hear it, and is not there
            made.observer.close()
            deadline = time.monotonic() + WITHIN
            while "/demo" not in terminal(made, "node", "list").communicate(timeout=WITHIN)[0]:
                assert time.monotonic() < deadline
        listed = terminal(made, "node", "list")
        unknown = terminal(made, "node", "info", "/nope")
        wrong = terminal(made, "node", "nonsense")
        heard = terminal(made, "topic", "echo", "/chatter")
        assert (*listed.communicate(timeout=WITHIN), listed.returncode) == ("\n".join([*NODES, ""]), "", 0)
        assert (*unknown.communicate(timeout=WITHIN), unknown.returncode) == ("", "Unable to find node '/nope'\n", 1)
        assert wrong.communicate(timeout=WITHIN)[1].startswith("usage: ros2 node") and wrong.returncode == 2
        assert heard.stdout is not None and heard.stdout.readline().startswith("data: hello")
        heard.send_signal(signal.SIGINT)
        assert (heard.communicate(timeout=WITHIN)[1], heard.returncode) == ("", 2)
    finally:
        made.close()


TEN_NODES = """
import rclpy
from std_msgs.msg import String
rclpy.init()
nodes = [rclpy.create_node(f"node_{number}") for number in range(10)]
topics = [nodes[number % 10].create_publisher(String, f"topic_{number}", 10) for number in range(19)]
executor = rclpy.executors.SingleThreadedExecutor()
for node in nodes:
    executor.add_node(node)
print("ready", flush=True)
executor.spin()
"""


@pytest.fixture
def ten_nodes() -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A process with ten nodes and 21 topics, and its domain."""
    claim = claim_domain()
    os.environ.update(profile_environment())
    environment = {**os.environ, "ROS_DOMAIN_ID": str(claim.id)}
    made = subprocess.Popen([sys.executable, "-c", TEN_NODES], env=environment, stdout=subprocess.PIPE, text=True)
    assert made.stdout is not None and made.stdout.readline() == "ready\n"
    yield made, claim.id
    made.kill()
    made.communicate()
    claim.release()


def test_what_a_newcomer_has_not_heard_of_yet_is_known_to_be_missing(
    ten_nodes: tuple[subprocess.Popen[str], int],
) -> None:
    observer = Observer(ten_nodes[1])
    try:
        assert observer.wait(lambda: len(session.look(observer.node).ends) == 181, WITHIN)
        assert observer.wait(lambda: session.look(observer.node).is_complete(), WITHIN)
        seen = session.look(observer.node)
        assert len(seen.nodes) == 10 and seen.participants == session.participants_here(ten_nodes[1]) == 2
        # Writers come in the order of their numbers, readers in that of theirs: the end of a list is what is missing.
        readers = sorted(end.number for end in seen.ends.values() if not end.writes)
        for heard in readers[:-1]:
            fewer = {gid: end for gid, end in seen.ends.items() if end.writes or end.number <= heard}
            assert not replace(seen, ends=fewer).is_complete()
            fewer = {gid: end for gid, end in seen.ends.items() if not end.writes or end.number <= heard}
            assert not replace(seen, ends=fewer).is_complete()
        # What was destroyed long ago is no gap.
        gone = {gid: end for gid, end in seen.ends.items() if end.number not in (20, 21)}
        assert replace(seen, ends=gone).is_complete()
        one = next(gid for gid, end in seen.ends.items() if end.node == "/node_3")
        unknown = {**seen.ends, one: replace(seen.ends[one], node="/_NODE_NAME_UNKNOWN_")}
        assert not replace(seen, ends=unknown).is_complete()
    finally:
        observer.close()


def test_a_command_waits_for_a_program_that_is_slow_to_answer(
    ten_nodes: tuple[subprocess.Popen[str], int], monkeypatch: pytest.MonkeyPatch
) -> None:
    made, domain = ten_nodes
    made.send_signal(signal.SIGSTOP)  # as one that gets no turn on a busy machine
    looks, count = 0, session.participants_here

    def looked(asked: int) -> int:
        nonlocal looks
        looks += 1
        if looks == session._REPEATED + 4:  # where there is nothing it would have gone on by now
            made.send_signal(signal.SIGCONT)
        return count(asked)

    monkeypatch.setattr(session, "participants_here", looked)
    said, warned = StringIO(), StringIO()
    with redirect_stdout(said), redirect_stderr(warned):
        assert run(["topic", "list"], domain) == 0
    assert looks >= session._REPEATED + 4
    assert (len(said.getvalue().splitlines()), warned.getvalue()) == (21, "")


def test_a_program_that_does_not_answer_at_all_is_told(ten_nodes: tuple[subprocess.Popen[str], int]) -> None:
    made, domain = ten_nodes
    made.send_signal(signal.SIGSTOP)
    said = StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        assert run(["node", "list"], domain) == 0
    assert said.getvalue() == "WARNING: a program here does not answer: what follows may not be all there is.\n"


def test_what_a_shell_has_made_deaf_to_ctrl_c_goes_on(robot: Robot) -> None:
    """As it does with what it puts into the background."""
    deaf = 'trap "" INT; exec "$@"'
    command = [
        "sh",
        "-c",
        deaf,
        "sh",
        Path(sys.executable).with_name("autograder"),
        "ros2",
        "topic",
        "echo",
        "/chatter",
    ]
    with subprocess.Popen(command, env=robot.environment, stdout=subprocess.PIPE, text=True) as heard:
        assert heard.stdout is not None
        try:
            assert heard.stdout.readline().startswith("data: hello")
            for _ in range(20):
                heard.send_signal(signal.SIGINT)
                assert heard.stdout.readline() and heard.stdout.readline()
        finally:
            heard.kill()


def test_a_goal_that_is_interrupted_is_cancelled(robot: Robot) -> None:
    sent = terminal(robot, "action", "send_goal", "/fibonacci", "test_msgs/action/Fibonacci", "{order: 100}")
    assert sent.stdout is not None
    while "accepted" not in (line := sent.stdout.readline()):
        assert line, "it ended"
    sent.send_signal(signal.SIGINT)
    said, _ = sent.communicate(timeout=WITHIN)
    assert said.endswith("Canceling goal...\nGoal canceled.\n") and sent.returncode == 2


# In a notebook.


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Notebook]:
    made = Notebook(tmp_path_factory.mktemp("notebook"))
    made.run(SET_UP)
    made.run(TALKER, "talker")
    yield made
    made.close()


def begun(notebook: Notebook, cell: str, nodes: str = "['/talker']") -> str:
    """Return what a cell says that begins a robot, and what the robot says of itself when its nodes are there."""
    robot = cell.partition(" = ")[0]
    there = f"assert {robot}.wait(lambda: {robot}.graph.nodes() == {nodes}, within={WITHIN}), {robot}.graph.nodes()"
    shown = notebook.run(f"{cell}\n{there}\nprint({robot})")
    assert not shown.error, shown.error
    return shown.text


def test_a_robot_goes_on_from_cell_to_cell(notebook: Notebook) -> None:
    assert "No program is running" in notebook.run("%ros2 node list").text
    assert "running: talker (nodes so far: /talker)" in begun(notebook, 'robot = launch("talker").start()')
    assert notebook.run("%ros2 node list").text == "/talker\n"
    assert notebook.run("%ros2 topic echo /chatter -n 2").text == "data: hello\n---\n" * 2
    shown = notebook.run("%ros2 topic info /chater\n_exit_code").text
    # The second sentence is the notebook's own.
    assert shown == "Unknown topic '/chater'\n(there is no /chater; the nearest name is /chatter)\n1\n"
    assert "running: talker" in notebook.run("robot").text
    assert "✓ passed" in notebook.run('robot.node("/talker").expect()').text
    shown = notebook.run('robot.node("/nope").expect(within=0)')
    assert "✗ failed" in shown.text and "Traceback" not in shown.error
    # A check has programs and a domain of its own, and the robot goes on.
    inside = notebook.run('with launch("talker", name="other") as ros:\n    ros.graph.wait(lambda: ros.graph.nodes())\n'
                          "    %ros2 node list")  # fmt: skip
    assert "/other\n" in inside.text  # on a busy machine with what the talker has printed before it
    assert notebook.run("%ros2 node list").text == "/talker\n"
    assert notebook.run("robot.stop()\n%ros2 node list").text.endswith('robot = launch("NAME").start()\n')


def test_a_second_robot_ends_the_first(notebook: Notebook) -> None:
    begun(notebook, 'first = launch("talker").start()')
    assert "has been stopped" in begun(notebook, 'second = launch("talker", name="second").start()', "['/second']")
    assert notebook.run("%ros2 node list").text == "/second\n"
    assert "has ended" in notebook.run("first").text
    notebook.run("second.stop()")


def test_a_program_that_ends_by_itself_is_told_once(notebook: Notebook) -> None:
    notebook.run("%%node broken\nimport rclpy\nraise SystemExit(3)", "broken")
    cell = 'robot = launch("talker", "broken").start()'
    ended = "assert robot.wait(lambda: not robot.program('broken').running(), within=600)"
    shown = begun(notebook, f"{cell}\n{ended}")
    assert "broken has ended, with exit status 3" in shown and "running: talker" in shown
    assert notebook.run("%ros2 node list").text == "/talker\n"
    assert "broken has ended" in notebook.run("robot").text
    notebook.run("robot.stop()")


def test_what_goes_on_ends_with_the_cell(notebook: Notebook) -> None:
    notebook.run("from autograder.notebook import magics")
    begun(notebook, 'robot = launch("talker").start()')
    for seconds in A_WHILE:
        notebook.run(f"magics._ENDLESS = {seconds}")
        shown = notebook.run("%ros2 topic hz /chatter").text
        assert f"(stopped after {seconds:g} s" in shown
        if "average rate: " in shown:
            break
    assert "average rate: " in shown
    notebook.run("robot.stop()")


def test_what_runs_is_not_what_its_cell_says_now(notebook: Notebook) -> None:
    begun(notebook, 'robot = launch("talker").start()')
    notebook.run(TALKER + "\n", "talker")
    assert "The cell of talker has been run again since" in notebook.run("robot").text
    assert notebook.run("%ros2 node list").text.endswith("Call .start() once more.\n/talker\n")
    assert "again" not in begun(notebook, 'robot = launch("talker").start()')
    notebook.run("robot.stop()")


def test_a_robot_is_no_check(notebook: Notebook) -> None:
    shown = notebook.run('ros = launch("talker").start()\nros.score(1)')
    assert "a check is a block" in shown.error
    assert "No program is running" in notebook.run("%ros2 node list").text


def test_nothing_is_left_running_when_the_kernel_ends(tmp_path: Path) -> None:
    made = Notebook(tmp_path)
    made.run(SET_UP)
    made.run(TALKER, "talker")
    pid = made.run('robot = launch("talker").start()\nrobot.program("talker")._program.pid').text.split()[-1]
    assert Path(f"/proc/{pid}").exists()
    made.close()
    deadline = time.monotonic() + WITHIN
    while Path(f"/proc/{pid}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{pid}").exists()


# In a terminal: which `ros2` it is.


def test_an_installed_ros2_goes_first(tmp_path: Path) -> None:
    ours = Path(sys.executable).with_name("ros2")
    real = tmp_path / "ros2"
    real.write_text('#!/bin/sh\necho the real one: "$@"\nexit 7\n')
    real.chmod(0o755)
    for path, said, status in (
        (f"{ours.parent}:{os.environ['PATH']}", '"data: false\n"\n', 0),
        (f"{ours.parent}:{tmp_path}:{os.environ['PATH']}", "the real one: interface proto std_msgs/msg/Bool\n", 7),
    ):
        command = [str(ours), "interface", "proto", "std_msgs/msg/Bool"]
        ran = subprocess.run(command, env={**os.environ, "PATH": path}, capture_output=True, text=True)
        assert (ran.stdout, ran.stderr, ran.returncode) == (said, "", status)


@pytest.mark.parametrize("start", ["exec ", ""])
def test_a_script_that_starts_the_kits_ros2_does_not_start_itself_again(tmp_path: Path, start: str) -> None:
    ours = Path(sys.executable).with_name("ros2")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ros2").write_text(f'#!/bin/sh\n{start}"{ours}" "$@"\n')
        (tmp_path / name / "ros2").chmod(0o755)
    path = f"{tmp_path}/a:{tmp_path}/b:{os.environ['PATH']}"
    command = [tmp_path / "a" / "ros2", "interface", "proto", "std_msgs/msg/Bool"]
    ran = subprocess.run(command, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=WITHIN)
    assert (ran.stdout, ran.stderr, ran.returncode) == ('"data: false\n"\n', "", 0)


def test_what_is_not_here_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["run", "demo", "talker"]) == 1
    assert "launch(" in capsys.readouterr().err


def test_the_page_of_the_book_names_every_verb() -> None:
    page = (ROOT / "lectures" / "appendix" / "command_line.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        row = next(line for line in page.splitlines() if line.startswith(f"| `ros2 {command}` |"))
        helped = StringIO()
        with redirect_stdout(helped):
            assert run([command, "--help"]) == 0
        verbs = re.findall(r"^    (\w+)", helped.getvalue(), re.MULTILINE)
        assert set(verbs) == set(re.findall(r"`(\w+)`", row.partition(" | ")[2])), command


@pytest.mark.parametrize(
    ("offered", "matching"),
    [
        ([], "reliable volatile"),
        (["reliable volatile", "reliable volatile"], "reliable volatile"),
        (["reliable volatile", "best_effort volatile"], "best_effort volatile"),
        (["best_effort volatile", "best_effort volatile"], "best_effort volatile"),
        (["reliable transient_local", "reliable transient_local"], "reliable transient_local"),
        (["reliable volatile", "reliable transient_local"], "reliable volatile"),
    ],
)
def test_a_subscription_asks_for_what_every_publisher_offers(offered: list[str], matching: str) -> None:
    def profile(words: str) -> QoSProfile:
        reliability, durability = words.split()
        made = QoSProfile(depth=10)
        made.reliability = QoSReliabilityPolicy.get_from_short_key(reliability)
        made.durability = QoSDurabilityPolicy.get_from_short_key(durability)
        return made

    assert to_match([TopicEndpointInfo(qos_profile=profile(words)) for words in offered]) == profile(matching)


def test_a_node_that_nothing_spins_is_told(notebook: Notebook) -> None:
    stuck = "import threading\nimport rclpy\nrclpy.init()\nnode = rclpy.create_node('stuck')\nthreading.Event().wait()"
    notebook.run(f"%%node stuck\n{stuck}", "stuck")
    begun(notebook, 'robot = launch("stuck", "talker").start()', "['/stuck', '/talker']")
    notebook.run("from autograder.notebook import magics\nmagics._ENDLESS = 50.0")
    shown = notebook.run("%ros2 param list").text
    assert "/stuck:\nException while calling service of node '/stuck': None\n/talker:\n  start" in shown
    notebook.run("magics._ENDLESS = 1.0")
    shown = notebook.run("%ros2 param get /stuck use_sim_time").text
    assert "a node answers only while something spins it" in shown
    notebook.run("robot.stop()")
