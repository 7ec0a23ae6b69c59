"""Programs that somebody runs in the domain of a launch, with settings of their own: the launch hears none of them.

Each is started twice, so that one hears the other: what they say is really said by then.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import subprocess
import sys

import pytest
from started_processes import WITHIN
from std_msgs.msg import Int64

from autograder.graph.domains import claim_domain
from autograder.graph.observer import Observer
from autograder.sandbox.environment import GROUP, profile_environment

TALKS = """
import sys
import rclpy
from rclpy.action import ActionServer
from std_msgs.msg import Int64
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node(sys.argv[1], namespace=sys.argv[2])
node.declare_parameter("rate", 20)
publisher = node.create_publisher(Int64, "beat", 10)
node.create_service(Trigger, "gate", lambda request, response: response)
server = ActionServer(node, Fibonacci, "fibonacci", lambda goal: Fibonacci.Result())
node.create_timer(0.05, lambda: publisher.publish(Int64(data=666)))
rclpy.spin(node)
"""
HEARS = """
import sys
import rclpy
from std_msgs.msg import Int64

rclpy.init()
node = rclpy.create_node("listens_to_" + sys.argv[1], namespace=sys.argv[2])
heard = rclpy.Future()
node.create_subscription(Int64, "beat", heard.set_result, 10)
rclpy.spin_until_future_complete(node, heard)
print("heard", flush=True)
rclpy.spin(node)
"""


def in_group(address: str) -> dict[str, str]:
    """The settings of a launch, but for the group."""
    return {**profile_environment(), GROUP: address}


def own_address() -> str:
    """The address under which other machines would find this one; its own if there are no others."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one, contextlib.suppress(OSError):
        one.connect(("192.0.2.1", 9))  # nothing is sent
        return str(one.getsockname()[0])
    return "127.0.0.1"


STRANGERS = {
    "as the installed ROS is": {},
    "all of the subnet": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
    "this machine": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    "what the middleware does by itself": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"},
    "the older word for this machine": {"ROS_LOCALHOST_ONLY": "1"},
    "this machine named as a peer": {"ROS_STATIC_PEERS": "127.0.0.1"},
    "this machine named by its name": {"ROS_STATIC_PEERS": f"localhost;{socket.gethostname()}"},
    "peers only": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_STATIC_PEERS": "127.0.0.1;127.0.1.1"},
    "UDP only": {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"},
    "large data": {"FASTDDS_BUILTIN_TRANSPORTS": "LARGE_DATA"},
    "shared memory and UDP": {"FASTDDS_BUILTIN_TRANSPORTS": "DEFAULT"},
    "another launch's group": in_group("239.1.2.3"),
    "the group of ROS": in_group("239.255.0.1"),
    "the next group": in_group("239.255.0.2"),
    "the launch's profile without a group": {**profile_environment(), GROUP: ""},
    "this machine named as others see it": {"ROS_STATIC_PEERS": own_address()},
}
"""What somebody may have set in a terminal, a service, a container or another course's kit."""
NAMES = {
    "the node's own name": ("own", "/"),
    "the node's own namespace": ("stranger", "/car"),
    "the observer's kind of name": ("grading_observer_012345", "/"),
    "a hidden name": ("_stranger", "/"),
}
"""What a stranger may be called; it has the settings of the installed ROS."""
CASES = {name: (settings, ("stranger", "/")) for name, settings in STRANGERS.items()}
CASES |= {name: ({}, called) for name, called in NAMES.items()}


@pytest.mark.parametrize("case", CASES)
def test_a_launch_hears_no_stranger(case: str, started: list[subprocess.Popen[str]]) -> None:
    settings, (name, namespace) = CASES[case]
    plain = {key: value for key, value in os.environ.items() if not key.startswith(("FASTRTPS", "ROS_", GROUP))}
    plain["ROS_LOG_DIR"] = os.environ["ROS_LOG_DIR"]
    claim = claim_domain()
    observer = Observer(claim.id, left=claim.release)

    def start(source: str, name: str, namespace: str, settings: dict[str, str]) -> subprocess.Popen[str]:
        environment = plain | settings | {"ROS_DOMAIN_ID": str(claim.id)}
        command = [sys.executable, "-c", source, name, namespace]
        started.append(subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True))
        return started[-1]

    try:
        beats = observer.record("/beat", Int64)
        start(TALKS, name, namespace, settings)
        ear = start(HEARS, name, namespace, settings)
        own = start(TALKS, "own", "/car", profile_environment())
        assert observer.wait(lambda: "/car/own" in observer.nodes(), WITHIN)
        assert ear.stdout is not None
        heard, _, _ = select.select([ear.stdout], [], [], WITHIN)  # seconds
        assert heard and "heard\n" in ear.stdout, "the strangers do not hear each other"
        ours = observer.record("/car/beat", Int64)
        assert observer.wait(lambda: len(ours.messages) > 20, WITHIN)
        assert observer.nodes() == ["/car/own"]
        assert not observer.publishers("/beat") and not beats.messages
        assert len(observer.publishers("/car/beat")) == 1 and own.poll() is None
    finally:
        observer.close()
