"""Programs of the same user that attack a notebook: its launch goes on as if it were alone."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from kernels import Notebook

SET_UP = "%load_ext autograder\nfrom autograder.checks import launch\nfrom std_msgs.msg import String"
TALKER = """%%node talker
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(String, "chatter", 10)
node.create_timer(0.02, lambda: publisher.publish(String(data="mine")))
rclpy.spin(node)
"""
LOOKS = """with launch("talker") as ros:
    ros.node("/talker").expect()
    heard = ros.topic("/chatter", String).expect_messages(at_least=60)
    seen = sorted({message.data for message in heard}), ros._running.observer.nodes()
seen
"""

ATTACKS = Path(__file__).parents[1] / "attacks" / "neighbours"
NAMES = sorted(path.stem for path in ATTACKS.glob("[a-z]*.py"))


@pytest.fixture(scope="module")
def victim(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Notebook, Path]]:
    work, home = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("home")
    notebook = Notebook(work, HOME=str(home))
    notebook.run(SET_UP)
    notebook.run(TALKER)
    yield notebook, work
    notebook.close()


@pytest.mark.parametrize("name", NAMES)
def test_a_launch_goes_on_whatever_a_neighbour_does(name: str, victim: tuple[Notebook, Path]) -> None:
    notebook, work = victim
    before = {path.name for path in work.iterdir()}
    plain = {key: value for key, value in os.environ.items() if not key.startswith(("FASTRTPS", "ROS_", "AUTOGRADER"))}
    command = [sys.executable, str(ATTACKS / f"{name}.py"), str(work)]
    plain["ROS_LOG_DIR"] = os.environ["ROS_LOG_DIR"]
    neighbour = subprocess.Popen(
        command, env=plain, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        assert neighbour.stdout is not None
        assert neighbour.stdout.readline() == "ready\n", neighbour.stdout.read(2000)
        shown = notebook.run(LOOKS)
        assert shown.result == "(['mine'], ['/talker'])", shown
        assert neighbour.poll() is None
    finally:
        os.killpg(neighbour.pid, 9)
        neighbour.wait()
        for path in work.iterdir():
            if path.name not in before:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        notebook.save()
