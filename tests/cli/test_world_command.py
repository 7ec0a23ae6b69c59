"""`autograder world` runs a world as a program of its own, until Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
from autograder.sandbox.environment import profile_environment

WITHIN = 120.0


def start(*words: str, **environment: str) -> subprocess.Popen[str]:
    command = [str(Path(sys.executable).with_name("autograder")), "world", *words]
    return subprocess.Popen(
        command, env=os.environ | environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def test_two_cars_are_on_the_graph_with_their_remapped_names_until_ctrl_c() -> None:
    os.environ.update(profile_environment())
    domain = claim_domain()
    observer = Observer(domain.id, left=domain.release)
    words = ["street", "--car", "front", "--car", "rear", "--ros-args", "-r", "cmd_vel:=drive"]
    world = start(*words, ROS_DOMAIN_ID=str(domain.id))
    try:
        assert observer.wait(lambda: observer.nodes() == ["/front/car", "/rear/car"], WITHIN)
        assert observer.wait(lambda: {"/front/drive", "/rear/odom"} <= set(observer.topics()), WITHIN)
        world.send_signal(signal.SIGINT)
        out, err = world.communicate(timeout=WITHIN)
        assert out == "The world street runs with /front/car, /rear/car. Ctrl-C ends it.\n" and err == ""
        assert world.returncode == 0
    finally:
        world.kill()
        world.wait()
        observer.close()


def test_what_keeps_a_world_from_starting_is_told() -> None:
    for words, told in (
        (["garage"], "error: There is no room `garage`."),
        (["room", "--car", "a", "--car", "b"], "2 cars are to be driven, and the map has 1."),
        (["room", "--heartbeet"], "error: The world has no option or argument `--heartbeet`."),
        (["room", "--car", "my car"], "error: The world does not start: "),
        (["room", "--ros-args", "-r", "cmd_vel=drive"], "a remap rule is `-r FROM:=TO`"),
    ):
        _, err = (refused := start(*words)).communicate(timeout=WITHIN)
        assert told in err and refused.returncode == 2 and "Traceback" not in err and "defect" not in err, err
