"""Programs of the same user, or of another one, that attack a notebook: its launch goes on as if it were alone."""

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
OF_OTHERS = (
    "claims_every_domain", "takes_a_port_of_every_domain", "joins_as_the_node", "garbage_to_ports", "garbage_to_groups",
    "removes_shared_memory", "joins_the_group", "is_busy",
)  # fmt: skip
"""Those that need no right to the user's files, so that another user tries them as well."""
SOMEBODY = 61_234
CASES = [(name, 0) for name in NAMES] + [(name, SOMEBODY) for name in OF_OTHERS]
CHEAP = ("joins_as_the_node", "settings_of_fast_dds")
"""What `make test` tries."""


@pytest.fixture(scope="module")
def victim(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Notebook, Path, Path]]:
    work, home = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("home")
    notebook = Notebook(work, HOME=str(home))
    notebook.run(SET_UP)
    notebook.run(TALKER)
    yield notebook, work, home
    notebook.close()


@pytest.mark.parametrize(
    ("name", "user"),
    [pytest.param(*one, marks=[] if one[0] in CHEAP and not one[1] else pytest.mark.complete) for one in CASES],
)
def test_a_launch_goes_on_whatever_a_neighbour_does(
    name: str, user: int, victim: tuple[Notebook, Path, Path], tmp_path: Path
) -> None:
    notebook, work, home = victim
    if user and os.getuid():
        pytest.skip("only root can be another user")
    before = {path.name for path in work.iterdir()}
    as_user = {"user": user, "group": user, "extra_groups": []} if user else {}
    plain = {key: value for key, value in os.environ.items() if not key.startswith(("FASTRTPS", "ROS_", "AUTOGRADER"))}
    logs = {"ROS_LOG_DIR": "/tmp" if user else os.environ["ROS_LOG_DIR"]}
    command = [sys.executable, str(ATTACKS / f"{name}.py"), str(work), str(home)]
    neighbour = subprocess.Popen(
        command, env=plain | logs, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True, **as_user,  # type: ignore[call-overload]
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
